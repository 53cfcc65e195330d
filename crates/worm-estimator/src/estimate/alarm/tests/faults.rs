//! Fault × when × expected alarm, delay and cell.

use super::worm::Bench;
use crate::config::{Battery, Config};
use crate::message::{Alarm, AlarmKind, Fault, Mode};
use AlarmKind::*;

struct Case {
    name: &'static str,
    slope_deg: f64,
    /// Gait cycles per second, signed.
    cycles_per_s: f64,
    /// Cycles of sound crawling before the fault.
    before: f64,
    /// Switches the fault on.
    fault: fn(&mut Bench),
    expected: AlarmKind,
    cell: Option<u32>,
    /// Largest delay, s.
    within_s: f64,
    /// Other alarms that may be raised as well.
    also: &'static [AlarmKind],
}

fn config(slope_deg: f64, cycles_per_s: f64) -> Config {
    let mut config = Config::default();
    config.canal.slope_deg = slope_deg;
    config.gait.cycle_s = 1.0 / cycles_per_s.abs();
    config
}

fn case(name: &'static str, fault: fn(&mut Bench), expected: AlarmKind, within_s: f64) -> Case {
    Case {
        name,
        slope_deg: 0.0,
        cycles_per_s: 0.4,
        before: 6.3,
        fault,
        expected,
        cell: None,
        within_s,
        also: &[],
    }
}

fn table() -> Vec<Case> {
    let stall: fn(&mut Bench) = |bench| bench.trouble.stalled = true;
    let slip: fn(&mut Bench) = |bench| bench.trouble.slipping = true;
    let slide: fn(&mut Bench) = |bench| bench.trouble.slide_m_per_s = 0.01;
    let hold_and_slide: fn(&mut Bench) = |bench| {
        bench.command(Mode::Holding, 0.0);
        bench.run(2.0);
        bench.trouble.slide_m_per_s = 0.01;
    };
    vec![
        case("hard stall", stall, MotorStall, 0.1),
        Case {
            cycles_per_s: 0.2,
            ..case("hard stall, half speed", stall, MotorStall, 0.1)
        },
        Case {
            cycles_per_s: 0.8,
            ..case("hard stall, double speed", stall, MotorStall, 0.1)
        },
        Case {
            cycles_per_s: -0.4,
            ..case("hard stall, backward", stall, MotorStall, 0.1)
        },
        Case {
            cycles_per_s: 1.0 / 120.0,
            before: 0.3,
            ..case("hard stall, 120 s cycle", stall, MotorStall, 2.5)
        },
        Case {
            before: 0.15,
            ..case("hard stall in the first step", stall, MotorStall, 0.1)
        },
        case(
            "cam 40 % too slow",
            |bench| bench.trouble.sluggish = 0.4,
            MotorStall,
            0.2,
        ),
        case(
            "stall with 30 % of exchanges lost",
            |bench| {
                bench.trouble.link_failing = 0.3;
                bench.run(1.0);
                bench.trouble.stalled = true;
            },
            MotorStall,
            0.1,
        ),
    ]
    .into_iter()
    .map(|case| Case {
        also: &[LinkFault],
        ..case
    })
    .chain([
        Case {
            cell: Some(1),
            also: &[NoProgress],
            ..case(
                "cell 2 jams between steps",
                |bench| bench.trouble.jammed = Some(1),
                JammedCell,
                0.45,
            )
        },
        Case {
            cell: Some(2),
            before: 6.6,
            ..case(
                "cell 3 jams in its step",
                |bench| bench.trouble.jammed = Some(2),
                JammedCell,
                0.6,
            )
        },
        Case {
            cell: Some(1),
            ..case(
                "cell 2 loses 60 %",
                |bench| {
                    bench.trouble.jammed = Some(1);
                    bench.trouble.jam_fraction = 0.6;
                },
                JammedCell,
                0.5,
            )
        },
        Case {
            cell: Some(1),
            before: 0.1,
            ..case(
                "cell 2 jams in the first cycle",
                |bench| bench.trouble.jammed = Some(1),
                JammedCell,
                1.0,
            )
        },
        Case {
            cell: Some(0),
            slope_deg: 45.0,
            cycles_per_s: -0.4,
            before: 6.1,
            ..case(
                "cell 1 jams, backward",
                |bench| bench.trouble.jammed = Some(0),
                JammedCell,
                2.6,
            )
        },
        case("slip stall, level", slip, NoProgress, 2.5),
        Case {
            before: 0.0,
            also: &[SlidingDown],
            ..case("slip stall from the start", slip, NoProgress, 5.0)
        },
        Case {
            slope_deg: 30.0,
            also: &[SlidingDown],
            ..case("slip stall, 30°", slip, NoProgress, 2.5)
        },
        Case {
            slope_deg: 45.0,
            also: &[SlidingDown],
            ..case("slip stall, 45°", slip, NoProgress, 2.5)
        },
        Case {
            slope_deg: 45.0,
            cycles_per_s: -0.4,
            ..case("slip stall, backward, 45°", slip, NoProgress, 2.5)
        },
        Case {
            cycles_per_s: 0.1,
            ..case("slip stall, slow", slip, NoProgress, 10.0)
        },
        Case {
            slope_deg: 45.0,
            also: &[NoProgress],
            ..case("slides while climbing", slide, SlidingDown, 1.0)
        },
        Case {
            slope_deg: 45.0,
            cycles_per_s: -0.4,
            ..case("slides while descending", slide, SlidingDown, 1.0)
        },
        Case {
            slope_deg: -45.0,
            ..case("slides while descending forward", slide, SlidingDown, 1.0)
        },
        Case {
            slope_deg: 45.0,
            ..case("slides in a hold", hold_and_slide, SlidingDown, 0.4)
        },
        Case {
            slope_deg: 30.0,
            ..case(
                "slides disarmed",
                |bench| {
                    bench.command(Mode::Disarmed, 0.0);
                    bench.run(2.0);
                    bench.trouble.slide_m_per_s = 0.01;
                },
                SlidingDown,
                0.4,
            )
        },
        Case {
            slope_deg: 30.0,
            ..case(
                "creeps 1 mm/s in a fault",
                |bench| {
                    bench.command(Mode::Fault, 0.0);
                    bench.run(2.0);
                    bench.trouble.slide_m_per_s = 0.001;
                },
                SlidingDown,
                3.3,
            )
        },
        Case {
            also: &[SlidingDown],
            ..case(
                "slip stall after a reversal",
                |bench| {
                    bench.command(Mode::Crawling, -0.4);
                    bench.run(20.0);
                    bench.trouble.slipping = true;
                },
                NoProgress,
                2.5,
            )
        },
        Case {
            also: &[NoProgress],
            cell: Some(1),
            ..case(
                "cell 2 jams after a change of speed",
                |bench| {
                    bench.command(Mode::Crawling, 0.8);
                    bench.run(2.0);
                    bench.trouble.jammed = Some(1);
                },
                JammedCell,
                1.5,
            )
        },
        case(
            "hard stall as the speed changes",
            |bench| {
                bench.command(Mode::Crawling, 0.8);
                bench.run(0.1);
                bench.trouble.stalled = true;
            },
            MotorStall,
            0.1,
        ),
        case(
            "electrical energy +30 %",
            |bench| bench.trouble.electrical_factor = 1.3,
            EnergyOverBudget,
            7.5,
        ),
        case(
            "electrical energy +20 %",
            |bench| bench.trouble.electrical_factor = 1.2,
            EnergyOverBudget,
            10.0,
        ),
        case(
            "locomotion energy +30 %",
            |bench| bench.trouble.loss_factor = 1.3,
            EnergyOverBudget,
            7.5,
        ),
        Case {
            before: 20.0,
            ..case(
                "electrical energy doubles",
                |bench| bench.trouble.electrical_factor = 2.0,
                EnergyOverBudget,
                5.5,
            )
        },
        case(
            "half of the exchanges fail",
            |bench| bench.trouble.link_failing = 0.5,
            LinkFault,
            0.3,
        ),
        Case {
            also: &[TrackerFault],
            ..case(
                "the controller says link lost",
                |bench| {
                    bench.trouble.link_failing = 1.0;
                    bench.trouble.fault = Fault::LinkLost;
                },
                LinkFault,
                0.01,
            )
        },
        case(
            "tracker falls silent",
            |bench| bench.trouble.tracker_dead = true,
            TrackerFault,
            0.55,
        ),
        Case {
            cell: Some(3),
            ..case(
                "cell 4 is not seen",
                |bench| bench.trouble.hidden_cell = Some(3),
                TrackerFault,
                0.8,
            )
        },
        case(
            "half of the positions are not seen",
            |bench| bench.trouble.dropout = 0.5,
            TrackerFault,
            1.6,
        ),
        case(
            "hardware error",
            |bench| bench.trouble.hardware_error = 0x20,
            DeviceFault,
            0.002,
        ),
        case(
            "hot servo",
            |bench| bench.trouble.temperature_c = 62.0,
            DeviceFault,
            0.6,
        ),
        case(
            "the controller says over-current",
            |bench| bench.trouble.fault = Fault::OverCurrent,
            DeviceFault,
            0.002,
        ),
    ])
    .collect()
}

#[test]
fn every_fault_is_told_in_time_with_its_cell() {
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
            let told = bench.changes.iter().find(|alarm| alarm.kind == case.expected.code());
            let other = bench.changes.iter().find(|alarm| {
                alarm.kind != case.expected.code() && !case.also.iter().any(|kind| kind.code() == alarm.kind)
            });
            if let Some(other) = other {
                failures.push(format!("{}: also {other:?}", case.name));
            }
            let Some(alarm) = told else {
                failures.push(format!("{}: not told", case.name));
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

/// Every alarm that was raised is cleared when its cause is gone and the worm crawls on, or stands.
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
    let told: Vec<_> = bench
        .changes
        .iter()
        .map(|alarm| (alarm.sequence, alarm.raised))
        .collect();
    assert_eq!(told, [(0, 1), (1, 0)]);
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
        }),
        ..Config::default()
    };
    config.control.rate_hz = 200.0;
    let mut bench = Bench::new(config, 3);
    bench.battery_j = 700.0;
    bench.run(2.0);
    let fraction = bench.watch.battery_fraction();
    assert!((fraction - 700.0 / 900.0).abs() < 0.04, "after two seconds: {fraction}");
    bench.command(Mode::Crawling, 0.4);
    while bench.raised().is_empty() && bench.time_s() < 2000.0 {
        bench.run(1.0);
    }
    assert_eq!(bench.raised(), [BatteryLow]);
    let fraction = bench.battery_j / 900.0;
    assert!(
        (bench.watch.battery_fraction() - fraction).abs() < 0.03,
        "{fraction} {}",
        bench.watch.battery_fraction()
    );
    // Half of what was above the reserve at the start went into the way out; the other half goes home.
    assert!((0.38..0.5).contains(&fraction), "{fraction}");
}
