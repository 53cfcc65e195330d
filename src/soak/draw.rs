//! The faults that are drawn, and what may and must follow from each: one table.

use super::session::Paused;
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use worm_estimator::config::Config;
use worm_estimator::message::{AlarmKind, Fault};

/// For how many gait cycles after its end a fault may still explain an alarm: as long as the slowest alarm averages.
pub const AFTERMATH_CYCLES: f64 = 15.0;

/// What is done to the worm.
#[derive(Debug, Clone, PartialEq)]
pub enum Cause {
    /// A fault of the virtual worm, as one would write it.
    VirtualWorm(String),
    /// A part of the computer does not run, ms.
    Pause(Paused, u64),
}

/// How long a fault lasts.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Lasts {
    Seconds(f64, f64),
    Cycles(f64, f64),
}

/// One row of the table.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// Name in the report.
    pub name: &'static str,
    cause: fn(&mut Xoshiro256PlusPlus, &Config) -> Cause,
    lasts: Lasts,
    /// By when it must be noticed: so many seconds, and so many gait cycles. None for what may go unnoticed.
    must: Option<(f64, f64)>,
    /// It can be noticed only while the worm crawls.
    crawling: bool,
    /// The alarms that may follow.
    pub alarms: &'static [AlarmKind],
    /// The faults of the controller that may follow.
    pub faults: &'static [Fault],
    /// How long the operator may need until the worm crawls again, s.
    pub recovery_s: f64,
    /// The servo is hot for minutes afterwards.
    pub overheats: bool,
}

/// A drawn fault.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// Its row.
    pub row: &'static Row,
    /// What is done.
    pub cause: Cause,
    /// For how long, s.
    pub lasts_s: f64,
    /// By when it must be noticed, s after its beginning.
    pub must_s: Option<f64>,
    /// Whether that holds only while the worm crawls.
    pub crawling: bool,
}

use AlarmKind::{
    DeviceFault, EnergyOverBudget, FrictionLoss, InferredJam, JammedCell, LinkFault, ModelMismatch, MoreLoad,
    MotorStall, NoProgress, SlidingDown, TrackerFault,
};

/// What a body that moves differently may raise.
const BODY: &[AlarmKind] = &[
    ModelMismatch,
    NoProgress,
    SlidingDown,
    EnergyOverBudget,
    FrictionLoss,
    MoreLoad,
];
/// What may follow when a cell does not move as far as it should.
const JAM: &[AlarmKind] = &[
    JammedCell,
    NoProgress,
    SlidingDown,
    ModelMismatch,
    EnergyOverBudget,
    InferredJam,
    FrictionLoss,
    MoreLoad,
];
/// What may follow when the servo is silent or without power.
const SERVO_GONE: &[AlarmKind] = &[LinkFault, TrackerFault, DeviceFault];
/// What the controller says then: which comes first depends on the length of the silence.
const SERVO_GONE_FAULTS: &[Fault] = &[Fault::LinkLost, Fault::ServoRestarted, Fault::WatchdogTripped];

/// How long the operator may usually need, s.
pub const RECOVERY_S: f64 = 30.0;

fn spec(text: String) -> Cause {
    Cause::VirtualWorm(text)
}

fn cell(rng: &mut Xoshiro256PlusPlus, config: &Config) -> usize {
    rng.random_range(1..=config.worm.cells)
}

/// A row whose fault is noticed for certain while the worm crawls.
const fn row(
    name: &'static str,
    cause: fn(&mut Xoshiro256PlusPlus, &Config) -> Cause,
    lasts: Lasts,
    must: Option<(f64, f64)>,
    alarms: &'static [AlarmKind],
    faults: &'static [Fault],
) -> Row {
    Row {
        name,
        cause,
        lasts,
        must,
        crawling: true,
        alarms,
        faults,
        recovery_s: RECOVERY_S,
        overheats: false,
    }
}

/// Every kind of fault, each drawn as often as the others.
pub const ROWS: &[Row] = &[
    row(
        "stall",
        |_, _| spec("stall".to_owned()),
        Lasts::Seconds(1.0, 8.0),
        // Measured: 18, 33, 65 and 82 ms at 1.25, 2.5, 5 and 10 s a cycle. No ramp begins shortly before: the worm has crawled
        // at this speed for several cycles.
        Some((0.06, 0.012)),
        &[MotorStall],
        &[Fault::Alarm],
    ),
    row(
        "jam",
        |rng, config| {
            let cell = cell(rng, config);
            spec(format!("jam:cell={cell},share={:.3}", rng.random_range(0.0..0.2)))
        },
        Lasts::Cycles(3.0, 6.0),
        Some((0.5, 2.2)),
        JAM,
        &[Fault::Alarm],
    ),
    row(
        "jam, partial",
        |rng, config| {
            let cell = cell(rng, config);
            spec(format!("jam:cell={cell},share={:.3}", rng.random_range(0.5..0.9)))
        },
        Lasts::Cycles(3.0, 12.0),
        None,
        JAM,
        &[Fault::Alarm],
    ),
    row(
        "slip",
        |rng, _| spec(format!("slip:friction={:.3}", rng.random_range(0.2..0.8))),
        Lasts::Cycles(2.0, 12.0),
        None,
        BODY,
        &[],
    ),
    row(
        "slide",
        |rng, _| spec(format!("slide:speed={:.4}", rng.random_range(0.012..0.03))),
        Lasts::Cycles(4.0, 6.0),
        Some((2.0, 2.5)),
        BODY,
        &[],
    ),
    row(
        "drag",
        |rng, _| spec(format!("drag:force={:.3}", rng.random_range(0.05..0.6))),
        Lasts::Cycles(5.0, 25.0),
        None,
        BODY,
        &[],
    ),
    row(
        "friction inside",
        |rng, _| spec(format!("friction-inside:scale={:.2}", rng.random_range(1.2..3.0))),
        Lasts::Cycles(2.0, 12.0),
        None,
        // It comes at once, and the servo's own loop makes up for it slowly: at 2.7 times the friction, a worm at 1.1 s a cycle
        // turned at 67 % of the command for a tenth of a second. More than 20 % too slow is what the alarm calls a stall.
        &[EnergyOverBudget, MotorStall, MoreLoad, FrictionLoss],
        &[Fault::Alarm],
    ),
    Row {
        crawling: false,
        ..row(
            "silent servo",
            |_, _| spec("silence:device=servo".to_owned()),
            Lasts::Seconds(0.3, 4.0),
            Some((0.12, 0.0)),
            SERVO_GONE,
            SERVO_GONE_FAULTS,
        )
    },
    Row {
        crawling: false,
        ..row(
            "silent servo, briefly",
            |_, _| spec("silence:device=servo".to_owned()),
            // Shorter than every timeout: the servo's own watchdog (80 ms) counts from the last exchange before it to the first after it.
            Lasts::Seconds(0.01, 0.07),
            None,
            &[LinkFault],
            &[],
        )
    },
    row(
        "silent tracker",
        |_, _| spec("silence:device=tracker".to_owned()),
        Lasts::Seconds(1.5, 6.0),
        Some((0.7, 0.0)),
        &[TrackerFault],
        &[Fault::TrackerStale],
    ),
    row(
        "blind to a cell",
        |rng, config| spec(format!("blind:cell={}", cell(rng, config))),
        Lasts::Seconds(3.0, 20.0),
        Some((1.5, 0.0)),
        &[TrackerFault],
        &[],
    ),
    row(
        "dropout",
        |rng, _| spec(format!("dropout:share={:.2}", rng.random_range(0.55..0.9))),
        Lasts::Seconds(4.0, 20.0),
        Some((3.0, 0.0)),
        &[TrackerFault],
        &[Fault::TrackerStale],
    ),
    row(
        "dropout, mild",
        |rng, _| spec(format!("dropout:share={:.2}", rng.random_range(0.02..0.12))),
        Lasts::Seconds(5.0, 60.0),
        None,
        &[],
        &[],
    ),
    row(
        "lost answers",
        |rng, _| spec(format!("drop:share={:.2}", rng.random_range(0.35..0.5))),
        Lasts::Seconds(3.0, 15.0),
        Some((2.0, 0.0)),
        &[LinkFault, TrackerFault],
        // Now and then every answer in a row, or each of a service's.
        &[Fault::LinkLost],
    ),
    row(
        "lost answers, few",
        |rng, _| spec(format!("drop:share={:.3}", rng.random_range(0.001..0.05))),
        Lasts::Seconds(5.0, 60.0),
        None,
        &[],
        &[],
    ),
    row(
        "damaged answers",
        |rng, _| spec(format!("corrupt:share={:.2}", rng.random_range(0.35..0.5))),
        Lasts::Seconds(3.0, 15.0),
        Some((2.0, 0.0)),
        &[LinkFault, TrackerFault],
        // Now and then every answer in a row, or each of a service's.
        &[Fault::LinkLost],
    ),
    row(
        "late answers",
        |rng, _| spec(format!("delay:ms={:.2}", rng.random_range(0.5..2.0))),
        Lasts::Seconds(5.0, 60.0),
        None,
        &[],
        &[],
    ),
    Row {
        crawling: false,
        ..row(
            "servo restart",
            |rng, _| spec(format!("reboot:off={:.3}", rng.random_range(0.01..1.0))),
            Lasts::Seconds(1.5, 3.0),
            Some((0.4, 0.0)),
            SERVO_GONE,
            SERVO_GONE_FAULTS,
        )
    },
    Row {
        crawling: false,
        recovery_s: 400.0,
        overheats: true,
        ..row(
            "overheating",
            |rng, _| spec(format!("overheat:ambient={:.0}", rng.random_range(70.0..76.0))),
            Lasts::Seconds(6.0, 9.0),
            Some((6.0, 0.0)),
            // A hot winding takes more current through more resistance.
            &[DeviceFault, EnergyOverBudget],
            &[Fault::OverTemperature, Fault::ServoHardware],
        )
    },
    Row {
        crawling: false,
        ..row(
            "hardware error",
            |_, _| spec("hardware-error:bits=32".to_owned()),
            Lasts::Seconds(0.5, 4.0),
            Some((0.1, 0.0)),
            &[DeviceFault],
            &[Fault::ServoHardware],
        )
    },
    Row {
        crawling: false,
        ..row(
            "supply sag",
            |rng, _| spec(format!("sag:volts={:.2}", rng.random_range(1.4..1.8))),
            Lasts::Seconds(2.0, 6.0),
            Some((1.0, 0.0)),
            // The same duty of 3.2 to 3.6 V instead of 5 V turns the motor at 70 % of the command until the servo's own loop has made
            // up for it (measured at 1.07 and 1.17 s a cycle); a fast worm lags by the threshold of a stall within 80 ms, before the
            // voltage has been low for long enough.
            &[DeviceFault, MotorStall],
            &[Fault::UnderVoltage, Fault::ServoHardware, Fault::Alarm],
        )
    },
    row(
        "supply sag, mild",
        |rng, _| spec(format!("sag:volts={:.2}", rng.random_range(0.05..0.4))),
        Lasts::Seconds(5.0, 30.0),
        None,
        &[],
        &[],
    ),
    row(
        "estimator silent",
        |rng, _| Cause::Pause(Paused::Estimator, rng.random_range(900..3000)),
        Lasts::Seconds(3.1, 3.2),
        Some((0.7, 0.0)),
        &[],
        &[Fault::EstimatorSilent],
    ),
    row(
        "computer paused",
        |rng, _| Cause::Pause(Paused::Computer, rng.random_range(20..600)),
        Lasts::Seconds(1.0, 2.0),
        None,
        &[],
        &[],
    ),
    row(
        "controller paused",
        |rng, _| Cause::Pause(Paused::Controller, rng.random_range(20..60)),
        Lasts::Seconds(1.0, 2.0),
        None,
        &[],
        &[],
    ),
    row(
        "controller paused for long",
        |rng, _| Cause::Pause(Paused::Controller, rng.random_range(120..600)),
        Lasts::Seconds(1.0, 2.0),
        Some((0.1, 0.0)),
        &[],
        &[Fault::HostPaused],
    ),
];

/// Draws a fault for this worm, which turns its gait in `cycle_s`.
pub fn draw(rng: &mut Xoshiro256PlusPlus, config: &Config, cycle_s: f64) -> Drawn {
    let row = &ROWS[rng.random_range(0..ROWS.len())];
    let lasts_s = match row.lasts {
        Lasts::Seconds(from, to) => rng.random_range(from..to),
        Lasts::Cycles(from, to) => cycle_s * rng.random_range(from..to),
    };
    Drawn {
        row,
        cause: (row.cause)(rng, config),
        lasts_s,
        must_s: row.must.map(|(seconds, cycles)| seconds + cycles * cycle_s),
        crawling: row.crawling,
    }
}
