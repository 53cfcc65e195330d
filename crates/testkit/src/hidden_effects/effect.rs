//! The 22 effects of the library, by name, and the range from which the strength of each is drawn.
//!
//! Severities are log-uniform between two ends, from what cannot be seen to what cannot be overlooked; a [`SeverityRange`] narrows
//! that to a part of the logarithm.

use super::MAX_CELLS;
use super::deviations::{Deviations, Patch};
use super::truth::TrueEffect;
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;

/// A part of the range of severities, as fractions of its logarithm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeverityRange {
    pub from: f64,
    pub to: f64,
}

impl SeverityRange {
    pub const WHOLE: Self = Self { from: 0.0, to: 1.0 };
    pub const UPPER_HALF: Self = Self { from: 0.5, to: 1.0 };

    /// The `part`-th of `parts` equal parts.
    pub fn part(part: usize, parts: usize) -> Self {
        let fraction = |part: usize| part as f64 / parts as f64;
        Self {
            from: fraction(part),
            to: fraction(part + 1),
        }
    }

    fn severity(self, min: f64, max: f64, rng: &mut Xoshiro256PlusPlus) -> f64 {
        let fraction = self.from + (self.to - self.from) * rng.random::<f64>();
        min * (max / min).powf(fraction)
    }

    /// A factor as far from 1, either way, as the ranges below and above say.
    fn factor(self, below: [f64; 2], above: [f64; 2], rng: &mut Xoshiro256PlusPlus) -> f64 {
        if rng.random::<bool>() {
            1.0 - self.severity(below[0], below[1], rng)
        } else {
            1.0 + self.severity(above[0], above[1], rng)
        }
    }
}

macro_rules! effects {
    ($($variant:ident = $name:literal,)*) => {
        /// An effect of the library.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Effect {
            $($variant,)*
        }

        impl Effect {
            /// All of them.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// Its name in the library.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }
        }
    };
}

effects! {
    UnequalClamping = "unequal-clamping",
    UnequalStiffness = "unequal-stiffness",
    DirectionalFriction = "directional-friction",
    BreakawayFriction = "breakaway-friction",
    PadHardening = "pad-hardening",
    PadCreep = "pad-creep",
    PadHysteresis = "pad-hysteresis",
    ViscousDrag = "viscous-drag",
    ConstantDrag = "constant-drag",
    Payload = "payload",
    SlopeError = "slope-error",
    TetherDrag = "tether-drag",
    LostStroke = "lost-stroke",
    ActuatorCompliance = "actuator-compliance",
    Backlash = "backlash",
    StepOverlap = "step-overlap",
    SlickPatch = "slick-patch",
    Wear = "wear",
    MotorDroop = "motor-droop",
    SensorScale = "sensor-scale",
    SensorLatency = "sensor-latency",
    SlopeClamping = "slope-clamping",
}

impl Effect {
    /// The effect of a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|effect| effect.name() == name)
    }

    /// Its class; effects of different classes do not look alike.
    pub fn class(self) -> &'static str {
        match self {
            Self::UnequalClamping | Self::UnequalStiffness => "one pad",
            Self::PadHardening | Self::PadCreep | Self::PadHysteresis => "pad law",
            Self::BreakawayFriction => "friction law",
            Self::DirectionalFriction
            | Self::ViscousDrag
            | Self::ConstantDrag
            | Self::Payload
            | Self::SlopeError
            | Self::TetherDrag
            | Self::SlopeClamping => "load",
            Self::Wear | Self::SlickPatch => "friction that changes",
            Self::LostStroke | Self::ActuatorCompliance | Self::SensorScale => "stroke",
            Self::Backlash | Self::StepOverlap | Self::MotorDroop | Self::SensorLatency => "timing",
        }
    }

    /// Whether it can be seen only if the cam's phase is recorded.
    pub fn needs_phase(self) -> bool {
        matches!(self, Self::SensorLatency | Self::MotorDroop | Self::Backlash)
    }

    /// Draws its strength and its cell, and puts it into the worm.
    pub fn hide(
        self,
        range: SeverityRange,
        cells: usize,
        deviations: &mut Deviations,
        rng: &mut Xoshiro256PlusPlus,
    ) -> TrueEffect {
        let cell = rng.random_range(0..cells);
        let mut of_cell = None;
        let parameters = match self {
            Self::UnequalClamping => {
                of_cell = Some(cell);
                let factor = range.factor([0.1, 0.6], [0.1, 0.6], rng);
                deviations.friction_factor[cell] = factor;
                vec![("friction_factor", factor)]
            }
            Self::UnequalStiffness => {
                of_cell = Some(cell);
                let factor = range.factor([0.1, 0.6], [0.1, 0.6], rng);
                deviations.stiffness_factor[cell] = factor;
                vec![("stiffness_factor", factor)]
            }
            Self::DirectionalFriction => {
                deviations.backward_over_forward = range.factor([0.05, 0.5], [0.05, 0.6], rng);
                vec![("backward_over_forward", deviations.backward_over_forward)]
            }
            Self::BreakawayFriction => {
                deviations.static_over_kinetic = 1.0 + range.severity(0.05, 0.8, rng);
                vec![("static_over_kinetic", deviations.static_over_kinetic)]
            }
            Self::PadHardening => {
                deviations.hardening = range.severity(0.03, 1.5, rng);
                vec![("hardening", deviations.hardening)]
            }
            Self::PadCreep => {
                deviations.creep_share = range.severity(0.05, 1.5, rng);
                deviations.creep_s = SeverityRange::WHOLE.severity(0.1, 3.0, rng);
                vec![
                    ("creep_share", deviations.creep_share),
                    ("time_constant_s", deviations.creep_s),
                ]
            }
            Self::PadHysteresis => {
                deviations.yielding_share = range.severity(0.05, 0.8, rng);
                vec![("yielding_share", deviations.yielding_share)]
            }
            Self::ViscousDrag => {
                deviations.drag_n_s_per_m = range.severity(0.5, 30.0, rng);
                vec![("drag_n_s_per_m", deviations.drag_n_s_per_m)]
            }
            Self::ConstantDrag => {
                deviations.force_n = range.severity(0.02, 0.8, rng);
                vec![("force_n", deviations.force_n)]
            }
            Self::Payload => {
                deviations.mass_kg = range.severity(0.005, 0.15, rng);
                vec![("mass_kg", deviations.mass_kg)]
            }
            Self::SlopeError => {
                let angle_deg = range.severity(0.2, 4.0, rng);
                deviations.angle_deg = if rng.random::<bool>() { angle_deg } else { -angle_deg };
                vec![("angle_deg", deviations.angle_deg)]
            }
            Self::TetherDrag => {
                // The force at the end of the level run, over the distance that a worm crawls there.
                deviations.tether_n_per_m = range.severity(0.05, 1.0, rng) / LEVEL_DISTANCE_M;
                vec![("force_per_distance_n_per_m", deviations.tether_n_per_m)]
            }
            Self::LostStroke if rng.random::<bool>() => {
                of_cell = Some(cell);
                let fraction = range.severity(0.01, 0.12, rng);
                deviations.stroke_factor[cell] = 1.0 - fraction;
                vec![("lost_share", fraction)]
            }
            Self::LostStroke => vec![("lost_share", shorten_every_stroke(range, deviations, rng))],
            Self::ActuatorCompliance => {
                deviations.compliance_m_per_n = range.severity(1e-5, 3e-4, rng);
                vec![("compliance_m_per_n", deviations.compliance_m_per_n)]
            }
            Self::Backlash => {
                deviations.play_m = range.severity(0.05e-3, 1e-3, rng);
                vec![("play_m", deviations.play_m)]
            }
            Self::StepOverlap => {
                deviations.overlap = range.severity(0.02, 0.3, rng);
                vec![("overlap", deviations.overlap)]
            }
            Self::SlickPatch => {
                let patch = Patch {
                    // On the level the four cells together pass over all from 120 mm behind the first to 70 mm ahead.
                    from_m: rng.random_range(-0.11..0.05),
                    length_m: rng.random_range(0.015..0.060),
                    friction_factor: 1.0 - range.severity(0.1, 0.7, rng),
                };
                deviations.patch = Some(patch);
                vec![
                    ("from_m", patch.from_m),
                    ("length_m", patch.length_m),
                    ("friction_factor", patch.friction_factor),
                ]
            }
            Self::Wear => {
                deviations.loss_per_cycle = range.severity(0.001, 0.03, rng);
                vec![("loss_per_cycle", deviations.loss_per_cycle)]
            }
            Self::MotorDroop => {
                deviations.slowdown_per_n = range.severity(0.01, 0.3, rng);
                vec![("slowdown_per_n", deviations.slowdown_per_n)]
            }
            Self::SensorScale => {
                deviations.scale = range.factor([0.04, 0.12], [0.04, 0.12], rng);
                vec![("scale", deviations.scale)]
            }
            Self::SensorLatency => {
                deviations.latency_s = range.severity(0.004, 0.060, rng);
                vec![("latency_s", deviations.latency_s)]
            }
            Self::SlopeClamping => {
                deviations.slope_sensitivity = range.severity(0.05, 1.2, rng);
                vec![("sensitivity", deviations.slope_sensitivity)]
            }
        };
        TrueEffect::new(self.name(), of_cell, &parameters)
    }
}

/// Distance that a worm crawls on the level in twelve cycles, m.
const LEVEL_DISTANCE_M: f64 = 0.080;

/// Shortens the stroke of every cell; returns the fraction that is lost.
pub fn shorten_every_stroke(range: SeverityRange, deviations: &mut Deviations, rng: &mut Xoshiro256PlusPlus) -> f64 {
    let fraction = range.severity(0.04, 0.15, rng);
    deviations.stroke_factor = [1.0 - fraction; MAX_CELLS];
    fraction
}

/// Makes every pad softer and weaker by the same factor, which positions cannot distinguish from a payload.
pub fn soften(deviations: &mut Deviations, rng: &mut Xoshiro256PlusPlus) -> TrueEffect {
    let factor = rng.random_range(0.68..0.82);
    deviations.stiffness_factor = [factor; MAX_CELLS];
    // The largest deformation, friction force over stiffness, stays.
    deviations.friction_factor = [factor; MAX_CELLS];
    TrueEffect::new("softer-pads", None, &[("stiffness_factor", factor)])
}
