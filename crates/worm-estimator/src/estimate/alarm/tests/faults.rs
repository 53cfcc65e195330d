//! Every fault of the table is reported in time, and cleared when it is over.

use super::fault_table::{config, table};
use super::worm::Bench;
use crate::config::{Battery, Config};
use crate::message::{Alarm, AlarmKind, Mode};
use AlarmKind::*;

#[test]
fn every_fault_is_reported_in_time_with_its_cell() {
    println!("{:<40} {:>9} {:>9}  since", "fault", "delay s", "bound s");
    let mut failures = Vec::new();
    for case in table() {
        for seed in 0..5 {
            let mut bench = Bench::new(config(case.slope_deg, case.cycles_per_s), seed);
            bench.command(Mode::Crawling, case.cycles_per_s);
            bench.run((case.before + 0.05 * seed as f64 / 5.0) / case.cycles_per_s.abs());
            if !bench.changes.is_empty() {
                failures.push(format!("{}: {:?} before the fault", case.name, bench.changes));
                continue;
            }
            (case.fault)(&mut bench);
            let onset_s = bench.time_s();
            bench.run(case.within_s + 5.0);
            let reported = bench.changes.iter().find(|alarm| alarm.kind == case.expected.code());
            let other = bench.changes.iter().find(|alarm| {
                alarm.kind != case.expected.code() && !case.also.iter().any(|kind| kind.code() == alarm.kind)
            });
            if let Some(other) = other {
                failures.push(format!("{}: also {other:?}", case.name));
            }
            let Some(alarm) = reported else {
                failures.push(format!("{}: not reported", case.name));
                continue;
            };
            let delay_s = alarm.time_ns as f64 * 1e-9 - onset_s;
            let since_s = alarm.since_ns as f64 * 1e-9 - onset_s;
            if seed == 0 {
                println!("{:<40} {delay_s:>9.3} {:>9.3}  {since_s:+.3}", case.name, case.within_s);
            }
            if delay_s > case.within_s || alarm.cell != case.cell.unwrap_or(u32::MAX) || alarm.raised != 1 {
                failures.push(format!("{}: after {delay_s:.3} s {alarm:?}", case.name));
            }
        }
    }
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
}

/// Every alarm that was raised is cleared when its cause is gone and the worm crawls on or stands still.
#[test]
fn what_is_raised_is_cleared_when_it_is_over() {
    for case in table().iter().filter(|case| case.cycles_per_s.abs() > 0.05) {
        let mut bench = Bench::new(config(case.slope_deg, case.cycles_per_s), 7);
        bench.command(Mode::Crawling, case.cycles_per_s);
        bench.run(case.before / case.cycles_per_s.abs());
        (case.fault)(&mut bench);
        bench.run(case.within_s + 5.0);
        bench.trouble = super::worm::Trouble::none();
        bench.command(Mode::Crawling, case.cycles_per_s);
        bench.run(15.0 / case.cycles_per_s.abs());
        assert_eq!(bench.raised(), [], "{}: {:#?}", case.name, bench.changes);
        for kind in AlarmKind::ALL {
            let of_kind: Vec<&Alarm> = bench.changes.iter().filter(|alarm| alarm.kind == kind.code()).collect();
            for (index, alarm) in of_kind.iter().enumerate() {
                assert_eq!(alarm.raised, u32::from(index % 2 == 0), "{}: {of_kind:#?}", case.name);
                assert!(alarm.since_ns <= alarm.time_ns && alarm.value.is_finite() && alarm.threshold.is_finite());
            }
        }
        for (index, alarm) in bench.changes.iter().enumerate() {
            assert_eq!(alarm.sequence, index as u64, "{}", case.name);
        }
    }
}

/// A stop clears what only exists in motion, so that the controller can be reset.
#[test]
fn a_stopped_worm_is_no_longer_stalled() {
    for fault in [
        (|bench: &mut Bench| bench.trouble.stalled = true) as fn(&mut Bench),
        |bench| bench.trouble.jammed = Some(1),
    ] {
        let mut bench = Bench::new(Config::default(), 1);
        bench.crawl_cycles(5.0);
        fault(&mut bench);
        bench.run(2.0);
        assert_eq!(bench.raised().len(), 1);
        bench.command(Mode::Fault, 0.0);
        bench.run(3.0);
        assert_eq!(bench.raised(), []);
    }
}

/// What a worm slid while it held is no lack of progress of the next cycle; else it would hold again and again.
#[test]
fn a_slide_during_a_hold_is_no_lack_of_progress_after_it() {
    let mut bench = Bench::new(Config::default(), 1);
    bench.crawl_cycles(6.0);
    bench.command(Mode::Holding, 0.0);
    bench.run(1.0);
    bench.trouble.slide_m_per_s = 0.01;
    bench.run(4.0);
    assert_eq!(bench.raised(), [SlidingDown]);
    bench.trouble.slide_m_per_s = 0.0;
    bench.run(6.0);
    assert_eq!(bench.raised(), []);
    bench.changes.clear();
    bench.crawl_cycles(3.0);
    assert_eq!(bench.changes, []);
}

/// A worm that held because it slipped may crawl on once it has grip again.
#[test]
fn a_cycle_without_progress_does_not_stop_the_crawl_after_the_hold() {
    let mut bench = Bench::new(Config::default(), 1);
    bench.crawl_cycles(6.0);
    bench.trouble.slipping = true;
    bench.crawl_cycles(1.0);
    assert_eq!(bench.raised(), [NoProgress]);
    bench.command(Mode::Holding, 0.0);
    bench.run(4.0);
    assert_eq!(bench.raised(), []);
    bench.trouble.slipping = false;
    bench.changes.clear();
    bench.crawl_cycles(3.0);
    assert_eq!(bench.changes, []);
}

/// Likewise a worm that slid while it crawled down: the cycle in which it slid is not held against it twice.
#[test]
fn a_slide_on_the_way_down_does_not_stop_the_crawl_after_the_hold() {
    let mut bench = Bench::new(config(20.0, -0.4), 1);
    bench.command(Mode::Crawling, -0.4);
    bench.run(15.0);
    bench.trouble.slide_m_per_s = 0.01;
    bench.run(0.7);
    assert_eq!(bench.raised(), [SlidingDown]);
    bench.command(Mode::Holding, 0.0);
    bench.trouble.slide_m_per_s = 0.0;
    bench.run(6.0);
    assert_eq!(bench.raised(), []);
    bench.changes.clear();
    bench.command(Mode::Crawling, -0.4);
    bench.run(7.5);
    assert_eq!(bench.changes, []);
}

#[test]
fn arming_is_visible() {
    let mut bench = Bench::new(Config::default(), 1);
    bench.run(1.0);
    assert!(!bench.is_armed(MotorStall) && !bench.is_armed(JammedCell) && !bench.is_armed(BatteryLow));
    assert!(bench.is_armed(SlidingDown) && bench.is_armed(LinkFault) && bench.is_armed(TrackerFault));
    bench.crawl_cycles(2.5);
    assert!(bench.is_armed(MotorStall) && bench.is_armed(JammedCell) && bench.is_armed(NoProgress));
    assert!(!bench.is_armed(EnergyOverBudget));
    bench.crawl_cycles(4.0);
    assert!(bench.is_armed(EnergyOverBudget));
    bench.command(Mode::Crawling, 0.2);
    bench.run(6.0);
    assert!(!bench.is_armed(EnergyOverBudget) && bench.is_armed(MotorStall) && bench.is_armed(NoProgress));
    bench.run(25.0);
    assert!(bench.is_armed(EnergyOverBudget));
    bench.restart_controller();
    bench.run(1.0);
    assert!(!bench.is_armed(EnergyOverBudget) && !bench.is_armed(NoProgress));
    assert_eq!(bench.changes, []);
}

/// The controller's restart clears what was raised, and numbering goes on.
#[test]
fn a_controller_restart_clears() {
    let mut bench = Bench::new(Config::default(), 1);
    bench.trouble.hardware_error = 4;
    bench.run(0.1);
    bench.trouble.hardware_error = 0;
    bench.restart_controller();
    bench.run(0.1);
    let reported: Vec<_> = bench
        .changes
        .iter()
        .map(|alarm| (alarm.sequence, alarm.raised))
        .collect();
    assert_eq!(reported, [(0, 1), (1, 0)]);
}

#[test]
fn the_battery_warns_while_the_way_home_is_still_possible() {
    let mut config = Config {
        battery: Some(Battery {
            capacity_j: 900.0,
            full_v: 5.6,
            empty_v: 4.0,
            internal_resistance_ohm: 0.2,
            hotel_power_w: 0.5,
            reserve_share: 0.1,
            ..Battery::default()
        }),
        ..Config::default()
    };
    config.control.rate_hz = 200.0;
    let mut bench = Bench::new(config, 3);
    bench.battery_j = 700.0;
    bench.run(2.0);
    let fraction = bench.monitor.battery_fraction();
    assert!((fraction - 700.0 / 900.0).abs() < 0.04, "after two seconds: {fraction}");
    bench.command(Mode::Crawling, 0.4);
    while bench.raised().is_empty() && bench.time_s() < 2000.0 {
        bench.run(1.0);
    }
    assert_eq!(bench.raised(), [BatteryLow]);
    let fraction = bench.battery_j / 900.0;
    assert!(
        (bench.monitor.battery_fraction() - fraction).abs() < 0.03,
        "{fraction} {}",
        bench.monitor.battery_fraction()
    );
    // Half of what was above the reserve at the start went into the way out; the other half goes home.
    assert!((0.38..0.5).contains(&fraction), "{fraction}");
}
