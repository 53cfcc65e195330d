//! A worm that has no tracker, and one whose tracker dies under way and may: they arm, crawl, hold and stop, with every guard that needs no
//! positions, and never say that they know what only positions tell.

use super::harness::{Obeying, config, crawling, session, wired};
use std::fmt::Write;
use worm_estimator::message::{AlarmKind, CommandKind, Fault, Mode};
use wormd::link::virtual_worm::Options;
use wormd::soak::{Machine, Session, Wired};

const NO_TRACKER: &str = "tracker.present = false\n";
const MAY_DIE: &str = "control.on_stale_tracker = \"continue\"\n";
const BATTERY: &str = "tracker.present = false\n[battery]\ncapacity_j = 400.0\nfull_v = 5.6\nempty_v = 4.0\n\
                       internal_resistance_ohm = 0.2\nhotel_power_w = 0.5\nreserve_share = 0.1\n";

/// A worm that crawls, with a fault that begins so long after the crawl.
fn with_fault(toml: &str, fault: &str) -> Session<Wired> {
    let config = config(toml);
    let options = Options {
        faults: vec![fault.parse().expect("a fault")],
        ..Options::default()
    };
    crawling(&config, wired(&config, &options), 1000.0)
}

const STORIES: &str = "\
stall                      motor-stall 0.03 s, fault (alarm)
friction-inside:scale=3    energy-over-budget 3.84 s, more-load 4.00 s, crawling
sag:volts=1.4              device-fault 0.26 s, fault (under-voltage)
silence:device=servo       link-fault 0.10 s, fault (link-lost)
overheat:ambient=90        device-fault 0.98 s, fault (over-temperature)
hardware-error:bits=32     device-fault 0.00 s, fault (servo-hardware)
reboot:off=0.05            link-fault 0.10 s, device-fault 0.16 s, fault (servo-restarted)
drop:share=0.3             link-fault 0.44 s, crawling
drop:share=0.02            crawling
delay:ms=2                 crawling
silence:device=tracker     crawling
";

/// Beside the same faults with a tracker (`faults`): the same alarms as soon, and no tracker that is missed.
#[test]
fn faults_that_need_no_positions_are_found_without_a_tracker() {
    const BEGINS_S: f64 = 16.3;
    let mut table = String::new();
    for line in STORIES.lines() {
        let fault = line.split(' ').next().unwrap_or_default();
        let mut session = with_fault(NO_TRACKER, &format!("{fault}@{BEGINS_S}"));
        session.run_s(BEGINS_S + 25.0, |tick| assert_eq!(tick.state.sample, 0));
        let began_s = session.machine.crawl_began_s().expect("it has crawled") + BEGINS_S;
        write!(table, "{fault:<26}").expect("text has room");
        for kind in session.raised_kinds() {
            let alarm = session.raised.iter().find(|alarm| alarm.kind == kind.code());
            let after_s = alarm.map_or(f64::NAN, |alarm| alarm.time_ns as f64 * 1e-9 - began_s);
            write!(table, " {} {after_s:.2} s,", kind.name()).expect("text has room");
        }
        write!(table, " {}", session.mode().name()).expect("text has room");
        if session.fault() != Fault::None {
            write!(table, " ({})", session.fault().name()).expect("text has room");
        }
        table += "\n";
    }
    assert_eq!(table, STORIES, "\n{table}");
}

/// Advance of the paper's worm on the level, by its exact cycle.
const LEVEL_ADVANCE_M: f64 = 6.833e-3;

#[test]
fn a_worm_without_a_tracker_arms_crawls_holds_and_stops() {
    let config = config(BATTERY);
    let mut session = session(&config, wired(&config, &Options::default()), 1000.0);
    session.cycles = Some(Vec::new());
    session.begin();
    session.command(CommandKind::Crawl, 0.0);
    session.run_s(18.0, |_| {});
    session.command(CommandKind::Hold, 0.0);
    session.run_s(2.0, |_| {});
    assert_eq!(session.mode(), Mode::Holding);
    session.command(CommandKind::Crawl, -0.4);
    session.run_s(6.0, |_| {});
    assert_eq!(session.mode(), Mode::Crawling);
    session.command(CommandKind::Stop, 0.0);
    session.run_s(2.0, |_| {});
    assert_eq!((session.mode(), session.fault()), (Mode::Disarmed, Fault::None));
    assert_eq!(session.raised_kinds(), []);

    let estimate = session.observer.latest();
    assert!(estimate.energy_electrical_j > 2.0 && estimate.phase.is_finite() && estimate.battery_fraction > 0.5);
    let unknown = [
        estimate.position_m[0],
        estimate.deformation_m[0],
        estimate.force_n[0],
        estimate.forward_slide_m[0],
        estimate.backward_slide_m[0],
        estimate.energy_loss_j,
    ];
    assert!(unknown.iter().all(|value| value.is_nan()), "{unknown:?}");
    let truth: Vec<f64> = session
        .machine
        .plant()
        .ledger()
        .cycles()
        .iter()
        .map(|cycle| cycle.electrical_j)
        .collect();
    let cycles = session.cycles.as_ref().expect("are collected");
    assert!(
        cycles.len() >= 5 && session.ranges.len() == cycles.len(),
        "{}",
        cycles.len()
    );
    for (cycle, truth_j) in cycles.iter().zip(truth).skip(1).take(3) {
        let off = cycle.energy_electrical_j / truth_j - 1.0;
        assert!(off.abs() < 0.02, "electrical energy {off:+.3}");
        assert!(cycle.advance_m.is_nan() && cycle.energy_loss_j.is_nan() && cycle.cot.is_nan());
    }
    let forward = session
        .ranges
        .iter()
        .rfind(|range| range.direction > 0)
        .expect("a range");
    let (advance_m, sigma_m) = (forward.advance_per_cycle_m, forward.advance_per_cycle_sigma_m);
    assert!(
        (advance_m - LEVEL_ADVANCE_M).abs() < 1.645 * sigma_m,
        "{advance_m} ± {sigma_m} m"
    );
    // 8 % is what the model leaves of any worm; the rest is the fit's, of a few cycles.
    assert!(
        (0.08..0.2).contains(&(sigma_m / advance_m)),
        "{advance_m} ± {sigma_m} m"
    );
    assert!(
        (forward.range_m / (forward.cycles * advance_m) - 1.0).abs() < 1e-9,
        "{forward:?}"
    );
    // What a cycle backward advances, the current does not say.
    let range = session.ranges.last().expect("a battery has a range");
    assert!(range.time_s > 0.0 && range.cycles > 0.0 && range.range_m.is_nan());
}

/// The tracker is silent from 16.3 to 26.3 s of the crawl.
#[test]
fn a_tracker_that_dies_and_comes_back_does_not_stop_a_worm_that_may_go_on() {
    let mut session = with_fault(MAY_DIE, "silence:device=tracker@16.3..26.3");
    session.cycles = Some(Vec::new());
    session.run_s(24.0, |_| {});
    assert_eq!((session.mode(), session.fault()), (Mode::Crawling, Fault::None));
    assert_eq!(session.raised_kinds(), [AlarmKind::TrackerFault]);
    let blind = session.observer.latest();
    assert!(blind.position_m[0].is_nan() && blind.deformation_m[0].is_nan());
    let needs_positions = [AlarmKind::JammedCell, AlarmKind::NoProgress, AlarmKind::SlidingDown];
    let is_armed = |mask: u32, kind: AlarmKind| mask >> kind.code() & 1 == 1;
    assert!(needs_positions.iter().all(|kind| !is_armed(blind.armed_mask, *kind)));

    session.run_s(20.0, |_| {});
    assert_eq!((session.mode(), session.fault()), (Mode::Crawling, Fault::None));
    assert_eq!(session.raised_kinds(), [AlarmKind::TrackerFault]);
    let seeing = session.observer.latest();
    assert!(needs_positions.iter().all(|kind| is_armed(seeing.armed_mask, *kind)));
    assert_eq!(seeing.raised_mask, 0, "the alarm is over");
    assert!(seeing.position_m[0].is_finite() && seeing.deformation_m[0].is_finite());
    let advances_mm: Vec<f64> = session
        .cycles
        .iter()
        .flatten()
        .map(|cycle| 1e3 * cycle.advance_m)
        .collect();
    // The silence touches the cycles from the seventh to the eleventh.
    assert_eq!(
        advances_mm.iter().map(|mm| mm.is_nan()).collect::<Vec<_>>(),
        (0..advances_mm.len())
            .map(|index| (6..=10).contains(&index))
            .collect::<Vec<_>>(),
        "{advances_mm:.2?}"
    );
    assert!(
        advances_mm[12..].iter().all(|mm| (mm - 6.833).abs() < 0.25),
        "{advances_mm:.2?}"
    );
    let electrical = session.cycles.iter().flatten().map(|cycle| cycle.energy_electrical_j);
    assert!(electrical.skip(1).all(|energy_j| (energy_j / 0.42 - 1.0).abs() < 0.03));
}

#[test]
fn a_worm_whose_tracker_is_dead_is_armed_again_only_where_it_may_go_on() {
    for (toml, fault, armed) in [(MAY_DIE, Fault::Alarm, true), ("", Fault::TrackerStale, false)] {
        let mut session = with_fault(toml, "silence:device=tracker@10");
        session.run_s(15.0, |_| {});
        session
            .machine
            .switch_on("stall@0.1..0.4".parse().expect("a fault"))
            .expect("this worm can have it");
        session.run_s(5.0, |_| {});
        assert_eq!((session.mode(), session.fault()), (Mode::Fault, fault));
        let verdict = session.send(CommandKind::Reset, 0.0).verdict;
        session.run_s(1.0, |_| {});
        assert_eq!(session.mode() == Mode::Armed, armed, "{verdict:?}");
        if armed {
            session.command(CommandKind::Crawl, 0.0);
            let phase = session.machine.plant().body().phase();
            session.run_s(6.0, |_| {});
            assert!(session.machine.plant().body().phase() - phase > 2.0);
        }
    }
}
