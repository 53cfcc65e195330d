//! Every fault × severity × mode × moment in the gait: what the worm does, how soon it is noticed, and how it recovers.
//!
//! Whatever the table says, in every cell
//! - every tick keeps the invariants of `wormd::soak::invariants`: nothing moves without a command to, the motor stands within
//!   two ticks of a latched fault and the servo's deceleration, the first reason stays, and no goal jumps to an old one;
//! - a severe fault of a crawling worm is noticed;
//! - a latched fault stays the first one, whatever comes on top;
//! - the worm crawls again, from speed zero and up the ramp, once the cause is gone.
//!
//! `WORMD_PRINT_TABLE=1` prints the table. docs/faults.md holds the same rows.

use super::fault_cases::Cause::{Cable, Pause, Worm};
use super::fault_cases::Severity::{Mild, Severe};
use super::fault_cases::{CASES, Case};
use super::harness::{config, session, wired};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use worm_estimator::config::Config;
use worm_estimator::message::{AlarmKind, CommandKind, CommandOutcome, Fault, Mode};
use wormd::link::Faults;
use wormd::link::virtual_worm::{Fault as WormFault, Options};
use wormd::soak::invariants::{Invariants, Truth};
use wormd::soak::{Machine, Session, Wired};

const CYCLE_S: f64 = 1.25;
const RATE_HZ: f64 = 1000.0;
/// Moments in the gait at which a crawling worm is hit, in cycles: the beginning, the middle and the end of steps.
const PHASES: [f64; 3] = [0.02, 0.38, 0.74];
/// Cycles before: the alarms have calibrated on three.
const CALIBRATED: f64 = 4.3;

const MODES: [Mode; 5] = [Mode::Armed, Mode::Crawling, Mode::Holding, Mode::Stopping, Mode::Fault];

/// What became of one cell.
#[derive(Debug, Clone, PartialEq)]
struct Outcome {
    does: String,
    reason: String,
    noticed_s: Option<f64>,
    recovers: &'static str,
}

/// A worm in some mode, looked at in every tick.
struct Run {
    session: Session<Wired>,
    invariants: Invariants,
}

impl Run {
    fn tick(&mut self, kind: Option<CommandKind>) -> Result<Option<CommandOutcome>, String> {
        let tick = match kind {
            Some(kind) => self.session.send(kind, 0.0),
            None => self.session.tick(None),
        };
        if kind == Some(CommandKind::Reset) && tick.verdict == Some(CommandOutcome::Accepted) {
            self.invariants.note_reset();
        }
        let truth = Truth::of(&mut self.session);
        match self.invariants.look(&tick, &truth) {
            None => Ok(tick.verdict),
            Some(broken) => Err(format!(
                "{}: {} at {} s",
                broken.rule,
                broken.text,
                self.session.now_s()
            )),
        }
    }

    fn run_s(&mut self, seconds: f64) -> Result<(), String> {
        let until_s = self.session.now_s() + seconds;
        while self.session.now_s() < until_s {
            self.tick(None)?;
        }
        Ok(())
    }

    fn command(&mut self, kind: CommandKind) -> Result<(), String> {
        match self.tick(Some(kind))? {
            Some(CommandOutcome::Accepted) => Ok(()),
            other => Err(format!("{kind}: {other:?} at {} s", self.session.now_s())),
        }
    }

    /// Brings a worm into the mode, at this phase of its gait.
    fn into(config: &Config, mode: Mode, phase: f64) -> Result<Self, String> {
        let mut run = Self {
            session: session(
                config,
                wired(
                    config,
                    &Options {
                        step_s: Some(1e-3),
                        ..Options::default()
                    },
                ),
                RATE_HZ,
            ),
            invariants: Invariants::new(config),
        };
        run.run_s(0.05)?;
        run.command(CommandKind::Arm)?;
        run.run_s(0.2)?;
        if mode == Mode::Armed {
            return Ok(run);
        }
        run.command(CommandKind::Crawl)?;
        run.run_s((CALIBRATED + phase) * CYCLE_S)?;
        match mode {
            Mode::Holding => {
                run.command(CommandKind::Hold)?;
                run.run_s(0.6)?;
            }
            Mode::Stopping => run.command(CommandKind::Stop)?,
            Mode::Fault => {
                run.switch_on("stall")?;
                run.run_s(0.3)?;
                run.session.machine.clear_faults(None);
                run.run_s(0.05)?;
            }
            Mode::Disarmed | Mode::Armed | Mode::Crawling => {}
        }
        if run.session.mode() != mode {
            return Err(format!("{} instead of {mode}", run.session.mode()));
        }
        Ok(run)
    }

    fn switch_on(&mut self, spec: &str) -> Result<(), String> {
        let fault = spec.parse().map_err(|error| format!("{spec}: {error}"))?;
        self.session.machine.switch_on(fault).map_err(|error| error.to_string())
    }

    /// Whether the worm crawls a cycle after `reset` and `crawl`, within a few attempts.
    fn crawls_again(&mut self, attempts: u32) -> Result<bool, String> {
        for _ in 0..attempts {
            let phase = self.session.machine.plant().body().phase();
            match self.session.mode() {
                Mode::Fault => {
                    let verdict = self.tick(Some(CommandKind::Reset))?;
                    // A servo that is too hot needs time.
                    self.run_s(if verdict == Some(CommandOutcome::Accepted) {
                        0.3
                    } else {
                        4.0
                    })?;
                }
                Mode::Disarmed => {
                    self.tick(Some(CommandKind::Arm))?;
                    self.run_s(0.3)?;
                }
                Mode::Armed | Mode::Holding => {
                    if self.tick(Some(CommandKind::Crawl))? == Some(CommandOutcome::AlarmStands) {
                        self.run_s(2.1)?;
                    }
                }
                Mode::Stopping => self.run_s(0.6)?,
                Mode::Crawling => {}
            }
            if self.session.mode() == Mode::Crawling {
                self.run_s(1.6 * CYCLE_S)?;
                let cycles = self.session.machine.plant().body().phase() - phase;
                if self.session.mode() == Mode::Crawling && cycles > 1.2 {
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }
}

fn run_cell(case: &Case, mode: Mode, phase: f64) -> Result<Outcome, String> {
    let config = config(&format!("gait.cycle_s = {CYCLE_S}\n{}", case.toml));
    let mut run = Run::into(&config, mode, phase)?;
    let before = (run.session.raised.len(), run.session.fault());
    let mut began_s = run.session.now_s();
    match (case.cause)() {
        Worm(spec) => run.switch_on(spec)?,
        Cable(_, faults) => run.session.machine.set_line_faults(faults),
        Pause(_, paused, ms) => {
            run.session.pause(paused, ms);
            began_s = run.session.now_s();
        }
    }
    let mut stopped_s = None;
    while run.session.now_s() < began_s + case.lasts_s {
        // The service that ends a tick takes its time.
        let before_tick_s = run.session.now_s();
        run.tick(None)?;
        if mode != Mode::Fault && run.session.mode() == Mode::Fault {
            stopped_s.get_or_insert(before_tick_s + 1.0 / RATE_HZ - began_s);
        }
    }
    let alarm = run.session.raised.get(before.0).copied();
    let alarm_name = |kind: u32| AlarmKind::try_from(kind).map_or("unknown", AlarmKind::name);
    let alarm_s = alarm.map(|alarm| alarm.time_ns as f64 * 1e-9 - began_s);
    let now = run.session.mode();
    let does = match (mode, now) {
        (Mode::Fault, Mode::Fault) | (Mode::Stopping, Mode::Disarmed) => "goes on",
        (_, Mode::Fault) => "stops",
        (Mode::Crawling, Mode::Holding) => "holds",
        (before, now) if before == now => "goes on",
        _ => return Err(format!("{mode} became {now}")),
    };
    let latched = run.session.fault();
    if mode == Mode::Fault && latched != before.1 {
        return Err(format!("{} became {latched}", before.1));
    }
    let reason = match (mode, now) {
        (Mode::Fault, _) => alarm.map_or("–", |alarm| alarm_name(alarm.kind)).to_owned(),
        (_, Mode::Fault) if latched == Fault::Alarm => alarm.map_or("", |alarm| alarm_name(alarm.kind)).to_owned(),
        (_, Mode::Fault) => latched.name().to_owned(),
        _ => alarm.map_or("–", |alarm| alarm_name(alarm.kind)).to_owned(),
    };
    let noticed_s = match (stopped_s, alarm_s) {
        (Some(stopped_s), Some(alarm_s)) => Some(f64::min(stopped_s, alarm_s)),
        (stopped_s, alarm_s) => stopped_s.or(alarm_s),
    }
    .map(|noticed_s| noticed_s.max(0.0));
    if case.severity == Severe && mode == Mode::Crawling && noticed_s.is_none() {
        return Err("silent".to_owned());
    }
    // Does it recover while the cause is there? A pause is over by then.
    let gone = matches!((case.cause)(), Pause(..));
    let recovers = if does == "goes on" && mode != Mode::Fault {
        "–"
    } else if !gone && run.crawls_again(3)? {
        if does == "holds" { "crawl" } else { "reset" }
    } else {
        run.session.machine.clear_faults(None);
        run.session.machine.set_line_faults(Faults::NONE);
        run.run_s(0.2)?;
        match (run.crawls_again(12)?, gone, does) {
            (true, true, _) => "reset",
            (true, false, "holds") => "crawl once it is gone",
            (true, false, _) => "reset once it is gone",
            (false, ..) => {
                return Err(format!(
                    "does not recover: {} {}",
                    run.session.mode(),
                    run.session.fault()
                ));
            }
        }
    };
    // Whatever it did, without the cause it crawls.
    run.session.machine.clear_faults(None);
    run.session.machine.set_line_faults(Faults::NONE);
    run.run_s(0.2)?;
    // A supply or a servo that has suffered needs time; nothing else does.
    if !run.crawls_again(12)? {
        return Err(format!(
            "does not crawl again: {} {}",
            run.session.mode(),
            run.session.fault()
        ));
    }
    Ok(Outcome {
        does: does.to_owned(),
        reason,
        noticed_s,
        recovers,
    })
}

/// Bounds in which times are stated, ms.
const BOUNDS_MS: [f64; 13] = [
    5.0, 10.0, 20.0, 50.0, 100.0, 150.0, 200.0, 500.0, 1000.0, 2000.0, 5000.0, 10_000.0, 20_000.0,
];

/// What a case comes to in a mode, over all phases: the columns behind the mode.
fn columns(case: &Case, mode: Mode) -> Result<String, String> {
    // Only a worm that moves has moments.
    let phases = if mode == Mode::Crawling { &PHASES } else { &PHASES[1..2] };
    let cause = (case.cause)();
    let mut outcomes = Vec::new();
    for &phase in phases {
        let outcome = run_cell(case, mode, phase)
            .map_err(|error| format!("{} while {mode}, phase {phase}: {error}", cause.name()))?;
        outcomes.push(outcome);
    }
    let all = |part: fn(&Outcome) -> &str| {
        let mut parts: Vec<&str> = Vec::new();
        for outcome in &outcomes {
            if !parts.contains(&part(outcome)) {
                parts.push(part(outcome));
            }
        }
        parts.sort_unstable();
        parts.join(" or ")
    };
    let noticed_s = outcomes.iter().filter_map(|outcome| outcome.noticed_s);
    let slowest_ms = noticed_s.fold(f64::NAN, f64::max) * 1e3;
    let bound = BOUNDS_MS.iter().find(|bound_ms| slowest_ms <= **bound_ms);
    Ok(format!(
        "{} | {} | {} | {} |",
        all(|outcome| &outcome.does),
        all(|outcome| &outcome.reason),
        bound.map_or_else(|| "–".to_owned(), |bound| bound.to_string()),
        all(|outcome| outcome.recovers),
    ))
}

/// The rows of a case: modes that come to the same share one.
fn rows(case: &Case) -> Result<String, Vec<String>> {
    let mut rows: Vec<(String, String)> = Vec::new();
    let mut wrong = Vec::new();
    for mode in MODES {
        match columns(case, mode) {
            Err(error) => wrong.push(error),
            Ok(columns) => match rows.iter_mut().find(|(_, same)| *same == columns) {
                Some((modes, _)) => *modes += &format!(", {mode}"),
                None => rows.push((mode.to_string(), columns)),
            },
        }
    }
    if !wrong.is_empty() {
        return Err(wrong);
    }
    let severity = if case.severity == Mild { "mild" } else { "severe" };
    let name = (case.cause)().name();
    let line = |(modes, columns): &(String, String)| format!("| {name} | {severity} | {modes} | {columns}\n");
    Ok(rows.iter().map(line).collect())
}

#[test]
fn every_fault_in_every_mode_is_survived_or_stops_the_worm_for_the_right_reason() {
    let prints = std::env::var_os("WORMD_PRINT_TABLE").is_some();
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let threads = std::thread::available_parallelism().map_or(1, |threads| threads.get());
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(case) = CASES.get(index) else { return };
                    let rows = rows(case);
                    if prints {
                        eprintln!("{rows:?}");
                    }
                    done.lock().expect("no thread panicked").push((index, rows));
                }
            });
        }
    });
    let mut done = done.into_inner().expect("no thread panicked");
    done.sort_by_key(|(index, _)| *index);
    let wrong: Vec<_> = done
        .iter()
        .filter_map(|(_, rows)| rows.as_ref().err())
        .flatten()
        .collect();
    let table: String = done
        .iter()
        .filter_map(|(_, rows)| rows.as_ref().ok())
        .map(String::as_str)
        .collect();
    if prints {
        println!("{HEAD}{table}");
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert_eq!(table, TABLE, "\n{HEAD}{table}");
}

#[test]
fn every_kind_of_fault_has_a_row() {
    let specs: Vec<&str> = CASES.iter().map(|case| (case.cause)().name()).collect();
    let has_row = |kind: &str| specs.iter().any(|spec| spec.split(':').next() == Some(kind));
    let missing: Vec<&str> = WormFault::kinds().filter(|kind| !has_row(kind)).collect();
    assert!(missing.is_empty(), "no row for {missing:?}");
}

#[test]
fn the_page_on_faults_holds_the_same_rows() {
    let page = include_str!("../../docs/faults.md");
    assert!(
        page.contains(&format!("{HEAD}{TABLE}")),
        "docs/faults.md: print the table and put it there"
    );
}

const HEAD: &str = "\
| fault | severity | mode | the worm | first reason | noticed within, ms | recovers by |
|---|---|---|---|---|---|---|
";

const TABLE: &str = include_str!("fault_table.txt");
