//! Every fault that can be injected, and what `wormd why` says of it: the first reason must be the right one.

use super::harness::{LEVEL, Obeying, STEEP, SWITCH, config, session, wired};
use worm_estimator::message::{Command, CommandKind, CommandRecord, Mode, Reply, ShortText, State};
use worm_log::Log;
use wormd::link::virtual_worm::Options;
use wormd::soak::Paused;
use wormd::why::{Explanation, explain_stop};

const CYCLE: &str = "gait.cycle_s = 1.25\n";
const RATE_HZ: f64 = 1000.0;
/// The alarms have calibrated on three cycles.
const CALIBRATED_S: f64 = 4.4 * 1.25;

/// What is done to a crawling worm.
enum Done {
    Fault(&'static str),
    Pause(Paused, u64),
    Command(CommandKind),
    /// Its driver falls silent, and the relay makes it hold.
    DriverSilent,
}
use Done::{Command as Told, DriverSilent, Fault, Pause};

/// What is done, for how long it lasts, how the worm differs, whether the worm stops, and what the reason must be.
type Case = (Done, f64, &'static str, bool, &'static [&'static str]);

const CASES: &[Case] = &[
    (Fault("stall"), 1.5, LEVEL, true, &["alarm motor-stall"]),
    (
        Fault("friction-inside:scale=5"),
        8.0,
        LEVEL,
        true,
        &["alarm motor-stall"],
    ),
    (
        Fault("friction-inside:scale=2"),
        12.0,
        LEVEL,
        false,
        &["alarm energy-over-budget", "alarm more-load"],
    ),
    (Fault("jam:cell=2,share=0"), 4.0, LEVEL, true, &["alarm jammed-cell"]),
    (Fault("slip:friction=0.3"), 6.0, STEEP, true, &["alarm no-progress"]),
    (
        Fault("slide:speed=0.02"),
        4.0,
        LEVEL,
        true,
        &["alarm no-progress", "alarm sliding-down"],
    ),
    (
        Fault("slope:deg=75"),
        6.0,
        STEEP,
        true,
        &["alarm no-progress", "alarm sliding-down"],
    ),
    (Fault("drag:force=1"), 20.0, LEVEL, false, &["alarm model-mismatch"]),
    (
        Fault("sag:volts=1.5"),
        3.0,
        LEVEL,
        true,
        &["fault servo-hardware", "fault under-voltage"],
    ),
    (Fault("silence:device=servo"), 2.0, LEVEL, true, &["fault link-lost"]),
    (
        Fault("silence:device=tracker"),
        2.0,
        LEVEL,
        true,
        &["fault tracker-stale"],
    ),
    (Fault("drop:share=0.5"), 4.0, LEVEL, false, &["alarm link-fault"]),
    (Fault("corrupt:share=0.5"), 4.0, LEVEL, false, &["alarm link-fault"]),
    (Fault("delay:ms=300"), 2.0, LEVEL, true, &["fault link-lost"]),
    (Fault("reboot:off=0.01"), 2.0, LEVEL, true, &["fault servo-restarted"]),
    (
        Fault("overheat:ambient=68"),
        10.0,
        LEVEL,
        true,
        &["fault over-temperature"],
    ),
    (
        Fault("hardware-error:bits=32"),
        2.0,
        LEVEL,
        true,
        &["fault servo-hardware"],
    ),
    (Fault("blind:cell=3"), 3.0, LEVEL, false, &["alarm tracker-fault"]),
    (Fault("dropout:share=0.7"), 4.0, LEVEL, false, &["alarm tracker-fault"]),
    (
        Fault("emergency-stop:bits=1"),
        1.0,
        SWITCH,
        true,
        &["fault emergency-stop"],
    ),
    (
        Pause(Paused::Estimator, 1000),
        2.0,
        LEVEL,
        true,
        &["fault estimator-silent"],
    ),
    (Pause(Paused::Controller, 300), 1.0, LEVEL, true, &["fault host-paused"]),
    (Told(CommandKind::Hold), 2.0, LEVEL, true, &["command hold"]),
    (Told(CommandKind::Stop), 2.0, LEVEL, true, &["command stop"]),
    (DriverSilent, 2.0, LEVEL, true, &["driver-silent driver-silent"]),
    // What is noticed and stops nothing, and what is not even noticed.
    (Fault("noise:m=0.0003"), 3.0, LEVEL, false, &["none none"]),
    (Fault("drop:share=0.02"), 3.0, LEVEL, false, &["none none"]),
    (Fault("slope:deg=2"), 3.0, LEVEL, false, &["none none"]),
    (Fault("battery:charge=0.9"), 3.0, "[battery]\n", false, &["none none"]),
    (Fault("wrong-model:number=1190"), 2.0, LEVEL, false, &["none none"]),
    (Fault("watchdog-defect:firmware=51"), 2.0, LEVEL, false, &["none none"]),
];

fn explained((done, lasts_s, toml, ..): &Case) -> Explanation {
    let config = config(&format!("{CYCLE}{toml}"));
    let options = Options {
        step_s: Some(1e-3),
        ..Options::default()
    };
    let mut session = session(&config, wired(&config, &options), RATE_HZ);
    let mut states: Vec<State> = Vec::new();
    let mut commands = Vec::new();
    session.begin();
    session.command(CommandKind::Crawl, 0.0);
    session.run_s(CALIBRATED_S, |tick| states.push(tick.state));
    match done {
        Fault(spec) => session
            .machine
            .switch_on(spec.parse().expect("a fault"))
            .expect("it can be switched on"),
        Pause(paused, ms) => session.pause(*paused, *ms),
        Told(_) | DriverSilent => {
            let (kind, sender) = match done {
                Told(kind) => (kind, "ops"),
                _ => (&CommandKind::Hold, "relay: Zoe silent 0.8 s"),
            };
            let tick = session.send(*kind, 0.0);
            let told = Command {
                sender: ShortText::new(sender),
                user: 1000,
                ..Command::new(*kind)
            };
            let reply = Reply {
                sequence: tick.state.sequence,
                verdict: 0,
                mode: tick.state.mode,
                fault: tick.state.fault,
                alarm_mask: 0,
            };
            commands.push(CommandRecord::new(
                0,
                (tick.state.time_ns, tick.state.phase),
                false,
                &told,
                &reply,
            ));
            states.push(tick.state);
        }
    }
    session.run_s(*lasts_s, |tick| states.push(tick.state));
    let log = Log {
        file: "virtual.mcap".into(),
        states,
        alarms: session.raised.clone(),
        commands,
        ..Log::default()
    };
    explain_stop(&log, &config, None, None)
}

#[test]
fn the_first_reason_is_the_right_one_for_every_fault() {
    let mut wrong = Vec::new();
    std::thread::scope(|scope| {
        let runs: Vec<_> = CASES
            .iter()
            .map(|case| (case, scope.spawn(|| explained(case))))
            .collect();
        for (case, run) in runs {
            let (done, _, _, stops, wanted) = case;
            let found = run.join().expect("no run panics");
            let reason = format!("{} {}", found.reason.kind, found.reason.name);
            let name = match done {
                Fault(spec) => (*spec).to_owned(),
                Pause(paused, ms) => format!("{paused:?} paused for {ms} ms"),
                Told(kind) => format!("command {kind}"),
                DriverSilent => "a silent driver".to_owned(),
            };
            println!("{name}: {reason}: {}", found.reason.sentence);
            if found.stopped != *stops || !wanted.contains(&reason.as_str()) {
                wrong.push(format!(
                    "{name}: stopped {}, {reason} instead of {wanted:?}",
                    found.stopped
                ));
            }
            assert!(found.remedy.len() > 5, "{name}: {}", found.remedy);
            assert!(found.reason.time_s <= 0.0, "{name}: the reason comes before the stop");
            let is_ordered = found.events.windows(2).all(|pair| pair[0].time_s <= pair[1].time_s);
            assert!(is_ordered, "{name}: {:?}", found.events);
        }
    });
    assert_eq!(wrong, Vec::<String>::new());
}

#[test]
fn who_wanted_it_and_which_cell_are_named() {
    let told = explained(&(Told(CommandKind::Stop), 1.0, LEVEL, true, &[]));
    assert_eq!(
        (told.reason.sender.as_deref(), told.reason.user),
        (Some("ops"), Some(1000))
    );
    assert_eq!(
        (told.from, told.to),
        (Some(Mode::Crawling.name()), Some(Mode::Stopping.name()))
    );
    let silent = explained(&(DriverSilent, 1.0, LEVEL, true, &[]));
    let sentence = &silent.reason.sentence;
    assert!(
        sentence.starts_with("Zoe, who drove, was not heard for 0.8 s"),
        "{sentence}"
    );
    assert!(silent.remedy.contains("when somebody watches"), "{}", silent.remedy);
    let jammed = explained(&(Fault("jam:cell=2,share=0"), 4.0, LEVEL, true, &[]));
    assert_eq!(jammed.reason.cell, Some(2));
    assert!(
        jammed.reason.since_s.is_some_and(|since_s| since_s < 0.0),
        "{:?}",
        jammed.reason
    );
    // A hot servo warns before the controller stops it.
    let hot = explained(&(Fault("overheat:ambient=68"), 10.0, LEVEL, true, &[]));
    let signs: Vec<_> = hot.signs.iter().map(|sign| sign.alarm).collect();
    assert_eq!(signs, ["device-fault"], "{:?}", hot.signs);
}
