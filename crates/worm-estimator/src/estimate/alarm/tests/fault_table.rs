//! Fault × when × expected alarm, delay and cell, as a table.

use super::worm::Bench;
use crate::config::Config;
use crate::message::{AlarmKind, Fault, Mode};
use AlarmKind::*;

pub(super) struct Case {
    pub(super) name: &'static str,
    pub(super) slope_deg: f64,
    /// Gait cycles per second, signed.
    pub(super) cycles_per_s: f64,
    /// Cycles of sound crawling before the fault.
    pub(super) before: f64,
    /// Switches the fault on.
    pub(super) fault: fn(&mut Bench),
    pub(super) expected: AlarmKind,
    pub(super) cell: Option<u32>,
    /// Largest delay, s.
    pub(super) within_s: f64,
    /// Other alarms that may be raised as well.
    pub(super) also: &'static [AlarmKind],
}

pub(super) fn config(slope_deg: f64, cycles_per_s: f64) -> Config {
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

pub(super) fn table() -> Vec<Case> {
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
