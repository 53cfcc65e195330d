//! What each fault of the virtual worm brings about: which alarms, which fault of the controller, by when, and nothing else.

use super::harness::{self, BATTERY, LEVEL, Obeying, STEEP, config, crawling, wired};
use std::fmt::Write;
use worm_estimator::message::{Alarm, AlarmKind, CommandKind, Fault, Mode};
use wormd::control::{Service, ServiceOutcome};
use wormd::link::virtual_worm::Options;
use wormd::soak::Machine;

/// When the fault begins, s since the crawl began: the alarms have calibrated on three cycles of 2.5 s.
const BEGINS_S: f64 = 16.3;
/// How long the worm is watched after that, s.
const WATCHED_S: f64 = 25.0;

struct Case {
    toml: &'static str,
    fault: &'static str,
    /// The alarm that must come first, and within how many seconds; none for what a worm must bear.
    first: Option<(AlarmKind, f64)>,
    /// Alarms that may follow from the same cause.
    then: &'static [AlarmKind],
    ends_in: Mode,
    by: Fault,
}

const fn case(
    toml: &'static str,
    fault: &'static str,
    first: Option<(AlarmKind, f64)>,
    then: &'static [AlarmKind],
    ends_in: Mode,
    by: Fault,
) -> Case {
    Case {
        toml,
        fault,
        first,
        then,
        ends_in,
        by,
    }
}

const STEEPEST: &str = "canal.slope_deg = 45\n";

use AlarmKind::{
    BatteryLow, DeviceFault, EnergyOverBudget, JammedCell, LinkFault, ModelMismatch, MoreLoad, MotorStall, NoProgress,
    SlidingDown, TrackerFault,
};
use Fault as F;
use Mode::{Crawling, Fault as Faulty, Holding};

const CASES: &[Case] = &[
    case(LEVEL, "stall", Some((MotorStall, 0.1)), &[], Faulty, F::Alarm),
    case(LEVEL, "jam:cell=2", Some((JammedCell, 3.2)), &[], Faulty, F::Alarm),
    case(
        STEEP,
        "jam:cell=4,share=0.4",
        Some((JammedCell, 3.2)),
        &[],
        Faulty,
        F::Alarm,
    ),
    case(
        LEVEL,
        "jam:cell=1,share=0.8",
        Some((ModelMismatch, 25.0)),
        &[],
        Crawling,
        F::None,
    ),
    case(
        STEEP,
        "slip:friction=0.4",
        Some((SlidingDown, 3.0)),
        &[NoProgress],
        Holding,
        F::None,
    ),
    case(
        STEEPEST,
        "slip:friction=0.3",
        Some((SlidingDown, 3.0)),
        &[NoProgress],
        Holding,
        F::None,
    ),
    case(
        LEVEL,
        "slide:speed=0.003",
        Some((NoProgress, 3.0)),
        &[SlidingDown],
        Holding,
        F::None,
    ),
    case(
        STEEP,
        "slide:speed=0.01",
        Some((SlidingDown, 3.0)),
        &[NoProgress],
        Holding,
        F::None,
    ),
    case(
        STEEP,
        "slope:deg=70",
        Some((NoProgress, 3.0)),
        &[SlidingDown],
        Holding,
        F::None,
    ),
    case(
        LEVEL,
        "friction-inside:scale=3",
        Some((EnergyOverBudget, 8.0)),
        &[MoreLoad],
        Crawling,
        F::None,
    ),
    case(
        BATTERY,
        "battery:charge=0.08@0",
        Some((BatteryLow, 15.0)),
        &[],
        Crawling,
        F::None,
    ),
    case(
        LEVEL,
        "sag:volts=1.4",
        Some((DeviceFault, 0.3)),
        &[],
        Faulty,
        F::UnderVoltage,
    ),
    case(
        LEVEL,
        "silence:device=servo",
        Some((LinkFault, 0.2)),
        &[TrackerFault],
        Faulty,
        F::LinkLost,
    ),
    case(
        LEVEL,
        "silence:device=tracker",
        Some((TrackerFault, 0.7)),
        &[],
        Faulty,
        F::TrackerStale,
    ),
    case(LEVEL, "blind:cell=3", Some((TrackerFault, 1.0)), &[], Crawling, F::None),
    case(
        LEVEL,
        "dropout:share=0.6",
        Some((TrackerFault, 2.0)),
        &[],
        Crawling,
        F::None,
    ),
    case(LEVEL, "dropout:share=0.1", None, &[], Crawling, F::None),
    case(LEVEL, "noise:m=0.0005", None, &[], Crawling, F::None),
    case(
        LEVEL,
        "overheat:ambient=90",
        Some((DeviceFault, 2.5)),
        &[],
        Faulty,
        F::OverTemperature,
    ),
    case(
        LEVEL,
        "hardware-error:bits=32",
        Some((DeviceFault, 0.1)),
        &[],
        Faulty,
        F::ServoHardware,
    ),
    case(
        LEVEL,
        "reboot:off=0.05",
        Some((LinkFault, 0.2)),
        &[DeviceFault],
        Faulty,
        F::ServoRestarted,
    ),
    case(LEVEL, "drop:share=0.3", Some((LinkFault, 1.0)), &[], Crawling, F::None),
    case(
        LEVEL,
        "corrupt:share=0.3",
        Some((LinkFault, 1.0)),
        &[],
        Crawling,
        F::None,
    ),
    case(LEVEL, "drop:share=0.02", None, &[], Crawling, F::None),
    case(LEVEL, "delay:ms=2", None, &[], Crawling, F::None),
    case(
        LEVEL,
        "drag:force=0.3",
        Some((ModelMismatch, 25.0)),
        &[],
        Crawling,
        F::None,
    ),
];

/// Why the case did not go as it should, if it did not, and what happened.
fn run(case: &Case) -> (String, String) {
    let config = config(case.toml);
    // What the case does not say itself.
    let begins_s = case
        .fault
        .split_once('@')
        .map_or(BEGINS_S, |(_, begins_s)| begins_s.parse().expect("a time"));
    let what = case.fault.split('@').next().unwrap_or_default();
    let options = Options {
        faults: vec![format!("{what}@{begins_s}").parse().expect("a fault")],
        ..Options::default()
    };
    let mut session = crawling(&config, wired(&config, &options), 1000.0);
    session.run_s(BEGINS_S + WATCHED_S, |_| {});
    let began_s = session.machine.crawl_began_s().expect("it has crawled") + begins_s;
    let after_s = |time_ns: u64| time_ns as f64 * 1e-9 - began_s;
    let slope_deg = config.canal.slope_deg;
    let mut story = format!("{slope_deg:>2}° {:<26}", case.fault);
    for kind in session.raised_kinds() {
        let alarm = session.raised.iter().find(|alarm| alarm.kind == kind.code());
        let after_s = alarm.map_or(f64::NAN, |alarm| after_s(alarm.time_ns));
        write!(story, " {} {after_s:.2} s,", kind.name()).expect("text has room");
    }
    write!(story, " {}", session.mode().name()).expect("text has room");
    if session.fault() != F::None {
        write!(story, " ({})", session.fault().name()).expect("text has room");
    }
    let kinds = session.raised_kinds();
    let mut wrong = String::new();
    match case.first {
        None if !kinds.is_empty() => wrong += "an alarm; ",
        None => {}
        Some((kind, within_s)) => {
            let first = session.raised.first().map(|alarm| (alarm.kind, after_s(alarm.time_ns)));
            if !first.is_some_and(|(first, after_s)| first == kind.code() && (0.0..=within_s).contains(&after_s)) {
                write!(wrong, "not {} first within {within_s} s; ", kind.name()).expect("text has room");
            }
            if kinds.iter().skip(1).any(|kind| !case.then.contains(kind)) {
                wrong += "an unrelated alarm; ";
            }
        }
    }
    let is_share = |alarm: &&Alarm| [LinkFault.code(), TrackerFault.code()].contains(&alarm.kind);
    if session
        .raised
        .iter()
        .filter(is_share)
        .any(|alarm| alarm.value <= alarm.threshold)
    {
        wrong += "raised below its threshold; ";
    }
    if (session.mode(), session.fault()) != (case.ends_in, case.by) {
        write!(wrong, "not {} ({})", case.ends_in.name(), case.by.name()).expect("text has room");
    }
    (wrong, story)
}

const STORIES: &str = "\
slope, fault: alarms and how long after it they came, how it ended
 0° stall                      motor-stall 0.03 s, fault (alarm)
 0° jam:cell=2                 jammed-cell 2.16 s, fault (alarm)
30° jam:cell=4,share=0.4       jammed-cell 0.91 s, fault (alarm)
 0° jam:cell=1,share=0.8       model-mismatch 11.33 s, crawling
30° slip:friction=0.4          sliding-down 0.34 s, no-progress 0.41 s, holding
45° slip:friction=0.3          sliding-down 0.14 s, no-progress 0.16 s, holding
 0° slide:speed=0.003          no-progress 1.73 s, sliding-down 3.27 s, holding
30° slide:speed=0.01           sliding-down 0.38 s, no-progress 0.40 s, holding
30° slope:deg=70               no-progress 1.02 s, holding
 0° friction-inside:scale=3    energy-over-budget 3.84 s, more-load 4.00 s, crawling
 0° battery:charge=0.08@0      battery-low 13.31 s, crawling
 0° sag:volts=1.4              device-fault 0.26 s, fault (under-voltage)
 0° silence:device=servo       link-fault 0.10 s, tracker-fault 0.67 s, fault (link-lost)
 0° silence:device=tracker     tracker-fault 0.50 s, fault (tracker-stale)
 0° blind:cell=3               tracker-fault 0.59 s, crawling
 0° dropout:share=0.6          tracker-fault 0.84 s, crawling
 0° dropout:share=0.1          crawling
 0° noise:m=0.0005             crawling
 0° overheat:ambient=90        device-fault 0.98 s, fault (over-temperature)
 0° hardware-error:bits=32     device-fault 0.00 s, fault (servo-hardware)
 0° reboot:off=0.05            link-fault 0.10 s, device-fault 0.16 s, fault (servo-restarted)
 0° drop:share=0.3             link-fault 0.44 s, crawling
 0° corrupt:share=0.3          link-fault 0.94 s, crawling
 0° drop:share=0.02            crawling
 0° delay:ms=2                 crawling
 0° drag:force=0.3             model-mismatch 11.33 s, crawling
";

#[test]
fn every_fault_raises_its_alarm_and_no_other() {
    let mut table = String::from("slope, fault: alarms and how long after it they came, how it ended\n");
    let mut wrongs = String::new();
    for case in CASES {
        let (wrong, story) = run(case);
        writeln!(table, "{}", story).expect("text has room");
        if !wrong.is_empty() {
            writeln!(wrongs, "{}: {wrong}", case.fault).expect("text has room");
        }
    }
    assert!(wrongs.is_empty(), "{wrongs}\n{table}");
    assert_eq!(table, STORIES, "\n{table}");
}

#[test]
fn once_the_cause_is_over_a_reset_lets_the_worm_crawl_on() {
    for (fault, by) in [
        ("stall@16.3..17.0", F::Alarm),
        ("jam:cell=2@16.3..20", F::Alarm),
        ("silence:device=servo@16.3..16.6", F::LinkLost),
        ("silence:device=tracker@16.3..17.3", F::TrackerStale),
        ("reboot:off=0.3@16.3", F::ServoRestarted),
        ("sag:volts=1.4@16.3..17.3", F::UnderVoltage),
        ("hardware-error:bits=32@16.3..17.3", F::ServoHardware),
    ] {
        let config = config(LEVEL);
        let options = Options {
            faults: vec![fault.parse().expect("a fault")],
            ..Options::default()
        };
        let mut session = crawling(&config, wired(&config, &options), 1000.0);
        session.run_s(25.0, |_| {});
        assert_eq!((session.mode(), session.fault()), (Faulty, by), "{fault}");
        let raised = session.raised.len();
        session.command(CommandKind::Reset, 0.0);
        session.run_s(0.5, |_| {});
        assert_eq!((session.mode(), session.fault()), (Mode::Armed, F::None), "{fault}");
        session.command(CommandKind::Crawl, 0.0);
        let phase = session.machine.plant().body().phase();
        session.run_s(20.0, |_| {});
        assert_eq!(session.mode(), Crawling, "{fault}");
        assert_eq!(session.raised.len(), raised, "{fault}: {:?}", session.raised_kinds());
        let cycles = session.machine.plant().body().phase() - phase;
        assert!((cycles - 7.95).abs() < 0.02, "{fault}: {cycles} cycles in 20 s");
    }
}

/// Each attempt takes a third of a second, in which the controller asks for no sample. The tracker is not at fault.
#[test]
fn attempts_to_arm_a_servo_that_is_too_hot_are_no_silence_of_the_tracker() {
    let config = config(LEVEL);
    let options = Options {
        faults: vec!["overheat:ambient=75@9".parse().expect("a fault")],
        ..Options::default()
    };
    for rate_hz in [250.0, 1000.0] {
        let mut session = crawling(&config, wired(&config, &options), rate_hz);
        session.run_s(5.0, |_| {});
        session.command(CommandKind::Stop, 0.0);
        session.run_s(12.0, |_| {});
        for _ in 0..10 {
            let began_s = session.now_s();
            session.command(CommandKind::Arm, 0.0);
            assert!(session.now_s() > began_s + 0.2, "{rate_hz} Hz: it takes its time");
            session.run_s(0.5, |_| {});
            assert_eq!(session.mode(), Mode::Disarmed, "{rate_hz} Hz: it is still too hot");
        }
        assert_eq!(session.raised_kinds(), [DeviceFault], "{rate_hz} Hz");
    }
}

/// Arming restarts a servo with a hardware error and waits two seconds for it, of the worm's time: however fast this computer is.
#[test]
fn a_servo_that_does_not_come_back_is_waited_for_in_the_worms_time() {
    let config = config(LEVEL);
    let mut session = harness::session(&config, wired(&config, &Options::default()), 250.0);
    session.run_s(0.1, |_| {});
    for fault in ["hardware-error:bits=32", "silence:device=servo@0.03"] {
        let fault = fault.parse().expect("a fault");
        session.machine.switch_on(fault).expect("this worm can have it");
        session.run_s(0.008, |_| {});
    }
    let began_s = session.now_s();
    let tick = session.send(CommandKind::Arm, 0.0);
    assert_eq!(tick.service, Some(ServiceOutcome::Failed(Service::Arm)));
    let took_s = session.now_s() - began_s;
    assert!((1.9..2.5).contains(&took_s), "{took_s} s");
}
