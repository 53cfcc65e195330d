//! What is done to a worm in the table of faults: each cause with its severity, how long it lasts, and the configuration that it needs.

use super::harness::{BATTERY, LEVEL, STEEP, SWITCH};
use wormd::link::Faults;
use wormd::soak::Paused;

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Severity {
    Mild,
    Severe,
}
use Severity::{Mild, Severe};

/// What is done to the worm.
#[derive(Debug, Clone)]
pub enum Cause {
    /// A fault of the virtual worm.
    Worm(&'static str),
    /// The bus's fault injector, byte by byte.
    Cable(&'static str, Faults),
    /// A part of the computer does not run for so many milliseconds.
    Pause(&'static str, Paused, u64),
}

pub struct Case {
    pub toml: &'static str,
    pub cause: fn() -> Cause,
    pub severity: Severity,
    pub lasts_s: f64,
}

const fn case(severity: Severity, lasts_s: f64, toml: &'static str, cause: fn() -> Cause) -> Case {
    Case {
        toml,
        cause,
        severity,
        lasts_s,
    }
}

use Cause::{Cable, Pause, Worm};

pub const CASES: &[Case] = &[
    case(Severe, 1.5, LEVEL, || Worm("stall")),
    case(Mild, 4.0, LEVEL, || Worm("friction-inside:scale=2")),
    case(Severe, 15.0, LEVEL, || Worm("friction-inside:scale=5")),
    case(Mild, 4.0, LEVEL, || Worm("jam:cell=2,share=0.9")),
    case(Severe, 4.0, LEVEL, || Worm("jam:cell=2,share=0")),
    case(Mild, 4.0, STEEP, || Worm("slip:friction=0.9")),
    case(Severe, 6.0, STEEP, || Worm("slip:friction=0.3")),
    case(Mild, 4.0, LEVEL, || Worm("slide:speed=0.0001")),
    case(Severe, 4.0, LEVEL, || Worm("slide:speed=0.02")),
    case(Mild, 4.0, LEVEL, || Worm("slope:deg=2")),
    case(Severe, 6.0, STEEP, || Worm("slope:deg=75")),
    case(Mild, 4.0, LEVEL, || Worm("drag:force=0.02")),
    case(Severe, 25.0, LEVEL, || Worm("drag:force=1")),
    case(Mild, 4.0, BATTERY, || Worm("battery:charge=0.9")),
    // A charge that is lost at once shows only in the voltage, after minutes.
    case(Mild, 10.0, BATTERY, || Worm("battery:charge=0.05")),
    case(Mild, 4.0, LEVEL, || Worm("sag:volts=0.3")),
    case(Severe, 3.0, LEVEL, || Worm("sag:volts=1.5")),
    case(Mild, 0.03, LEVEL, || Worm("silence:device=servo")),
    case(Severe, 2.0, LEVEL, || Worm("silence:device=servo")),
    case(Mild, 0.1, LEVEL, || Worm("silence:device=tracker")),
    case(Severe, 2.0, LEVEL, || Worm("silence:device=tracker")),
    case(Mild, 4.0, LEVEL, || Worm("drop:share=0.02")),
    case(Severe, 4.0, LEVEL, || Worm("drop:share=0.5")),
    case(Mild, 4.0, LEVEL, || Worm("corrupt:share=0.02")),
    case(Severe, 4.0, LEVEL, || Worm("corrupt:share=0.5")),
    case(Mild, 4.0, LEVEL, || Worm("delay:ms=2")),
    case(Severe, 2.0, LEVEL, || Worm("delay:ms=300")),
    case(Mild, 2.0, LEVEL, || Worm("reboot:off=0.01")),
    case(Severe, 2.0, LEVEL, || Worm("reboot:off=0.5")),
    case(Mild, 4.0, LEVEL, || Worm("overheat:ambient=45")),
    case(Severe, 3.0, LEVEL, || Worm("overheat:ambient=68")),
    case(Severe, 2.0, LEVEL, || Worm("hardware-error:bits=32")),
    case(Severe, 3.0, LEVEL, || Worm("blind:cell=3")),
    case(Mild, 4.0, LEVEL, || Worm("dropout:share=0.1")),
    case(Severe, 4.0, LEVEL, || Worm("dropout:share=0.7")),
    case(Mild, 4.0, LEVEL, || Worm("noise:m=0.0003")),
    // The model number is read only when torque is switched on.
    case(Mild, 2.0, LEVEL, || Worm("wrong-model:number=1190")),
    // So is the firmware; the motor of such a servo goes on when the link breaks.
    case(Mild, 2.0, LEVEL, || Worm("watchdog-defect:firmware=51")),
    case(Severe, 1.0, SWITCH, || Worm("emergency-stop:bits=1")),
    case(Mild, 3.0, LEVEL, || {
        Cable(
            "bytes lost: 1 in 1000",
            Faults {
                drop: 1e-3,
                ..Faults::NONE
            },
        )
    }),
    case(Severe, 3.0, LEVEL, || {
        Cable(
            "bytes lost: 1 in 50",
            Faults {
                drop: 0.02,
                ..Faults::NONE
            },
        )
    }),
    case(Mild, 3.0, LEVEL, || {
        Cable(
            "bits flipped: 1 byte in 1000",
            Faults {
                flip: 1e-3,
                ..Faults::NONE
            },
        )
    }),
    case(Severe, 3.0, LEVEL, || {
        Cable(
            "bits flipped: 1 byte in 50",
            Faults {
                flip: 0.02,
                ..Faults::NONE
            },
        )
    }),
    case(Severe, 3.0, LEVEL, || {
        Cable(
            "bytes doubled: 1 in 50",
            Faults {
                duplicate: 0.02,
                ..Faults::NONE
            },
        )
    }),
    case(Severe, 3.0, LEVEL, || {
        Cable(
            "answers cut off: 1 in 2",
            Faults {
                truncate: 0.5,
                ..Faults::NONE
            },
        )
    }),
    case(Severe, 3.0, LEVEL, || {
        Cable(
            "sent bytes lost: 1 in 50",
            Faults {
                drop_sent: 0.02,
                ..Faults::NONE
            },
        )
    }),
    case(Severe, 2.0, LEVEL, || {
        Cable(
            "nothing received",
            Faults {
                silence: 0..u64::MAX,
                ..Faults::NONE
            },
        )
    }),
    case(Severe, 1.5, LEVEL, || {
        Pause("estimator paused 1 s", Paused::Estimator, 1000)
    }),
    case(Mild, 1.0, LEVEL, || {
        Pause("controller paused 50 ms", Paused::Controller, 50)
    }),
    case(Severe, 1.0, LEVEL, || {
        Pause("controller paused 300 ms", Paused::Controller, 300)
    }),
    case(Mild, 1.0, LEVEL, || {
        Pause("computer paused 300 ms", Paused::Computer, 300)
    }),
    case(Mild, 1.0, LEVEL, || {
        Pause("virtual worm paused 50 ms", Paused::Worm, 50)
    }),
    case(Severe, 1.5, LEVEL, || {
        Pause("virtual worm paused 500 ms", Paused::Worm, 500)
    }),
];

impl Cause {
    pub fn name(&self) -> &'static str {
        match self {
            Worm(spec) => spec,
            Cable(name, _) | Pause(name, ..) => name,
        }
    }
}
