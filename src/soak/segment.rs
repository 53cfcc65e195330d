//! One segment: a drawn worm with its operator, quiet stretches and faults in turn.

mod judgement;

use super::draw::{self, Cause, Drawn, ROWS};
use super::invariants::{Invariants, Truth};
use super::machine::{Machine, Wired};
use super::report::{FaultTally, FindingKind, Found, Tally};
use super::session::{Paused, Session, Tick};
use super::{RATE_HZ, SEGMENT_S, STEP_S, worm};
use crate::link::virtual_worm::{Options, PlantLedger};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::collections::VecDeque;
use worm_estimator::config::Config;
use worm_estimator::message::{AlarmKind, Command, CommandKind, CommandOutcome, Mode};

/// How much of a segment is without a fault at the least between two, s.
const QUIET_S: std::ops::Range<f64> = 60.0..420.0;
/// Cycles at a steady speed before a fault: the alarms have calibrated on three.
const STEADY_CYCLES: std::ops::Range<f64> = 4.5..7.0;
/// How many gait cycles the operator may need beyond the usual time until the worm crawls again.
const RECOVERY_CYCLES: f64 = 6.0;
/// The segment is over: its time is up, or an invariant is broken.
struct Over;

/// The fault under way, or one that ended not long ago.
struct Episode {
    drawn: Drawn,
    began_s: f64,
    /// Whether it had to be noticed.
    must_s: Option<f64>,
    noticed_s: Option<f64>,
    /// Whether it was counted what became of it.
    is_judged: bool,
    /// Until when it explains alarms, s; none while it lasts.
    explains_until_s: Option<f64>,
}

struct Segment {
    config: Config,
    rng: Xoshiro256PlusPlus,
    session: Session<Wired>,
    invariants: Invariants,
    began_s: f64,
    /// Alarms of the session that were looked at.
    alarms_seen: usize,
    last_mode: Mode,
    episode: Option<Episode>,
    /// How warm the servo's case was before it was overheated, °C.
    cool_c: Option<f64>,
    /// Time from which on cycles are undisturbed, s.
    undisturbed_since_s: f64,
    /// Cycles of the ledger that were looked at, and the newest ones with their ends.
    ledger_seen: usize,
    accounts: VecDeque<(f64, PlantLedger)>,
    /// What the operator wants, cycles per second.
    speed: f64,
    tally: Tally,
}

/// Runs segment `number` of a soak with this seed.
pub fn run(seed: u64, number: u64) -> Tally {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed ^ number.wrapping_mul(0x9E37_79B9_7F4A_7C15));
    let tally = Tally {
        segment: number,
        faults: ROWS
            .iter()
            .map(|row| FaultTally {
                fault: row.name,
                ..FaultTally::default()
            })
            .collect(),
        ..Tally::default()
    };
    match Segment::new(&mut rng, tally.clone()) {
        Ok(mut segment) => {
            // Either way it is over.
            let _over: Result<(), Over> = segment.live();
            segment.judge_unfinished();
            segment.close()
        }
        Err(error) => Tally {
            findings: vec![Found {
                kind: FindingKind::Invariant,
                time_s: 0.0,
                sort: "a sound worm starts".to_owned(),
                text: format!("a sound worm starts: {error}"),
            }],
            ..tally
        },
    }
}

impl Segment {
    fn new(rng: &mut Xoshiro256PlusPlus, tally: Tally) -> Result<Self, Box<dyn std::error::Error>> {
        let config = worm::draw(rng)?;
        let options = Options {
            seed: Some(rng.random()),
            step_s: Some(STEP_S),
            ..Options::default()
        };
        let mut session = Session::new(&config, Wired::new(&config, &options)?, RATE_HZ)?;
        session.cycles = Some(Vec::new());
        Ok(Self {
            invariants: Invariants::new(&config),
            began_s: session.now_s(),
            session,
            rng: rng.clone(),
            alarms_seen: 0,
            last_mode: Mode::Disarmed,
            episode: None,
            cool_c: None,
            undisturbed_since_s: 0.0,
            ledger_seen: 0,
            accounts: VecDeque::new(),
            speed: config.gait_cycles_per_s(),
            config,
            tally,
        })
    }

    fn live(&mut self) -> Result<(), Over> {
        self.pass_s(0.1)?;
        self.must_accept(CommandKind::Arm, 0.0)?;
        self.pass_s(0.1)?;
        loop {
            self.crawl_quietly()?;
            self.suffer()?;
        }
    }

    fn close(mut self) -> Tally {
        let ledger = self.session.machine.plant().ledger();
        self.tally.cycles = ledger.cycles().len() as u64 + ledger.forgotten_cycles();
        self.tally.time_s = self.session.now_s() - self.began_s;
        self.tally
    }

    /// Without a fault, as an operator would have it.
    fn crawl_quietly(&mut self) -> Result<(), Over> {
        let until_s = self.session.now_s() + self.rng.random_range(QUIET_S);
        let gait = self.config.gait_cycles_per_s();
        while self.session.now_s() < until_s {
            match self.rng.random_range(0..6) {
                0 => self.must_accept(CommandKind::Hold, 0.0)?,
                1 if self.session.mode() == Mode::Crawling => {
                    self.must_accept(CommandKind::Stop, 0.0)?;
                    let rest_s = self.rng.random_range(1.0..8.0);
                    self.pass_s(rest_s)?;
                    self.must_accept(CommandKind::Arm, 0.0)?;
                }
                2 => self.speed = -self.speed,
                3 => self.speed = gait.copysign(self.speed) * self.rng.random_range(0.6..1.2),
                _ => {}
            }
            let pause_s = self.rng.random_range(0.5..6.0);
            self.pass_s(pause_s)?;
            let speed = self.speed;
            self.must_accept(CommandKind::Crawl, speed)?;
            let cycles = self.rng.random_range(0.3..20.0);
            self.pass_s(cycles / speed.abs())?;
            if self.session.mode() != Mode::Crawling {
                let text = format!("{} instead of crawling", self.session.mode());
                return self.broken("a sound worm crawls on", text);
            }
        }
        Ok(())
    }

    /// A fault at some moment of some mode, until the worm crawls again.
    fn suffer(&mut self) -> Result<(), Over> {
        let drawn = draw::draw(&mut self.rng, &self.config, 1.0 / self.speed.abs());
        let speed = self.speed;
        self.must_accept(CommandKind::Crawl, speed)?;
        let steady_s = self.rng.random_range(STEADY_CYCLES) / speed.abs();
        self.pass_s(steady_s)?;
        match self.rng.random_range(0..10) {
            0 => {
                self.must_accept(CommandKind::Hold, 0.0)?;
                let rest_s = self.rng.random_range(0.0..3.0);
                self.pass_s(rest_s)?;
            }
            1 => self.must_accept(CommandKind::Stop, 0.0)?,
            _ => {}
        }
        self.tally_of(&drawn).drawn += 1;
        self.episode = Some(Episode {
            began_s: self.session.now_s(),
            // Torque is on in every mode but disarmed; only a crawling worm shows everything.
            must_s: drawn.must_s.filter(|_| match self.session.mode() {
                Mode::Crawling => true,
                Mode::Holding => !drawn.crawling,
                _ => false,
            }),
            noticed_s: None,
            is_judged: false,
            explains_until_s: None,
            drawn: drawn.clone(),
        });
        if drawn.row.overheats {
            // Of two in a row, the first found it cool.
            let case_c = self.session.machine.plant().motor().case_c();
            self.cool_c = Some(self.cool_c.map_or(case_c, |cool_c| cool_c.min(case_c)));
        }
        let lasts_s = drawn.lasts_s;
        match &drawn.cause {
            Cause::VirtualWorm(spec) => {
                let switched_on = spec
                    .parse()
                    .map_err(|error| format!("{spec}: {error}"))
                    .and_then(|fault| self.session.machine.switch_on(fault).map_err(|error| error.to_string()));
                if let Err(error) = switched_on {
                    return self.broken("a drawn fault can be switched on", error);
                }
            }
            Cause::Pause(paused, ms) => self.session.pause(*paused, *ms),
        }
        if matches!(&drawn.cause, Cause::Pause(Paused::Controller | Paused::Computer, _)) {
            // Nobody could notice anything while nothing ran.
            if let Some(episode) = &mut self.episode {
                episode.began_s = self.session.now_s();
            }
        }
        self.pass_s(lasts_s)?;
        self.session.machine.clear_faults(None);
        self.judge();
        self.recover(drawn.row.recovery_s)?;
        // Crawls on until nothing that follows can be the fault's.
        let speed = self.speed;
        let aftermath_s = draw::AFTERMATH_CYCLES / speed.abs() + 10.0;
        if let Some(episode) = &mut self.episode {
            episode.explains_until_s = Some(self.session.now_s() + aftermath_s);
        }
        self.crawl_to_the_end_of_the_episode()?;
        self.find_standing_alarms();
        self.episode = None;
        self.undisturbed_since_s = self.session.now_s();
        Ok(())
    }

    fn crawl_to_the_end_of_the_episode(&mut self) -> Result<(), Over> {
        while let Some(until_s) = self.episode.as_ref().and_then(|episode| episode.explains_until_s)
            && self.session.now_s() < until_s
        {
            self.pass_s(1.0)?;
            if self.session.mode() != Mode::Crawling {
                self.recover(draw::RECOVERY_S)?;
            }
        }
        // What follows is calibrated anew.
        self.recover(draw::RECOVERY_S)
    }

    /// The operator makes the worm crawl again: resets, arms, commands, until it does.
    fn recover(&mut self, within_s: f64) -> Result<(), Over> {
        // A slow worm needs cycles to show that it crawls, too.
        let within_s = within_s + RECOVERY_CYCLES / self.speed.abs();
        let until_s = self.session.now_s() + within_s;
        let mut refused = 0;
        while self.session.now_s() < until_s {
            let speed = self.speed;
            match self.session.mode() {
                Mode::Fault => {
                    self.try_command(CommandKind::Reset, 0.0)?;
                    self.pass_s(1.0)?;
                }
                Mode::Disarmed => {
                    self.try_command(CommandKind::Arm, 0.0)?;
                    self.pass_s(0.5)?;
                }
                Mode::Stopping => self.pass_s(0.5)?,
                Mode::Armed | Mode::Holding => {
                    if self.try_command(CommandKind::Crawl, speed)? == Some(CommandOutcome::AlarmStands) {
                        refused += 1;
                        if refused > 2 && self.try_command(CommandKind::Reset, 0.0)? == Some(CommandOutcome::Accepted) {
                            self.tally.permitted += 1;
                        }
                        self.pass_s(1.5)?;
                    }
                }
                Mode::Crawling => {
                    let phase = self.session.machine.plant().body().phase();
                    self.pass_s(1.0 / speed.abs())?;
                    let done = (self.session.machine.plant().body().phase() - phase).abs();
                    if self.session.mode() == Mode::Crawling && done > 0.7 {
                        return Ok(());
                    }
                }
            }
        }
        let text = format!(
            "{} (fault {}) {within_s} s later, {refused} times refused because of {:?}",
            self.session.mode(),
            self.session.fault(),
            self.standing()
        );
        self.broken("a worm whose fault is over crawls again", text)
    }

    /// The alarms that stand.
    fn standing(&self) -> Vec<&'static str> {
        let mask = self.session.observer.latest().raised_mask;
        let kinds = AlarmKind::ALL.iter().filter(|kind| mask >> kind.code() & 1 == 1);
        kinds.map(|kind| kind.name()).collect()
    }

    fn try_command(&mut self, kind: CommandKind, cycles_per_s: f64) -> Result<Option<CommandOutcome>, Over> {
        let command = Command {
            cycles_per_s,
            ..Command::new(kind)
        };
        self.tick(Some(command)).map(|tick| tick.verdict)
    }

    fn must_accept(&mut self, kind: CommandKind, cycles_per_s: f64) -> Result<(), Over> {
        match self.try_command(kind, cycles_per_s)? {
            Some(CommandOutcome::Accepted) => Ok(()),
            other => {
                let text = format!(
                    "{kind} while {}: {other:?}, alarms {:?}",
                    self.session.mode(),
                    self.standing()
                );
                self.broken("a sound worm obeys", text)
            }
        }
    }

    fn pass_s(&mut self, seconds: f64) -> Result<(), Over> {
        let until_s = self.session.now_s() + seconds;
        while self.session.now_s() < until_s {
            self.tick(None)?;
        }
        Ok(())
    }

    /// One tick, and everything that is to be said about it.
    fn tick(&mut self, command: Option<Command>) -> Result<Tick, Over> {
        let tick = self.session.tick(command);
        if command.is_some_and(|command| command.kind == CommandKind::Reset.code())
            && tick.verdict == Some(CommandOutcome::Accepted)
        {
            self.invariants.note_reset();
        }
        self.take_accounts();
        let truth = Truth::of(&mut self.session);
        if let Some(broken) = self.invariants.look(&tick, &truth) {
            return self.end_with(broken);
        }
        while self.alarms_seen < self.session.raised.len() {
            let alarm = self.session.raised[self.alarms_seen];
            self.alarms_seen += 1;
            self.take_alarm(&alarm, &tick.state);
        }
        self.take_mode(&tick.state)?;
        for cycle in self.session.cycles.as_mut().map(std::mem::take).unwrap_or_default() {
            let undisturbed = self.is_undisturbed(&cycle);
            if let Some(broken) = Invariants::look_at_cycle(&cycle, undisturbed) {
                return self.end_with(broken);
            }
            if undisturbed {
                self.compare(&cycle);
            }
        }
        if self.session.now_s() - self.began_s >= SEGMENT_S {
            return Err(Over);
        }
        Ok(tick)
    }
}
