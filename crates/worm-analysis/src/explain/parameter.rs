//! What the search may vary: nuisances within their priors, and the parameters of effects.
//!
//! Recalibration hides effects: with friction, stiffness and stroke free, much of an effect disappears into them. So these are free only
//! within what is not known of a worm that was built and measured with care, and what remains after fitting them is the gap. The
//! priors are normal about the nominal value, with limits; a value on its limit is reported.

use crate::least_squares::Quantity;
use worm_physics::Worm;
use worm_physics::effect::{Effect, Parameter};

/// A quantity that is not known exactly and that no effect is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Nuisance {
    /// Logarithm of a factor on the friction of all tips.
    Friction,
    /// Logarithm of a factor on the stiffness of all pads.
    Stiffness,
    /// Logarithm of a factor on the stroke.
    Stroke,
    /// Logarithm of a factor on one tip's friction.
    FrictionOf(usize),
    /// Logarithm of a factor on one pad's stiffness.
    StiffnessOf(usize),
    /// Logarithm of a factor on one cell's stroke.
    StrokeOf(usize),
    /// Error of one run's slope, degrees.
    SlopeOf(usize),
    /// Delay of the positions against the recorded phase, s.
    Clock,
    /// Growth of that delay: positions and phase have two clocks, s/s.
    ClockDrift,
    /// Logarithm of the damping ratio of the body on its tips.
    Damping,
    /// Stiffness of the pads over that of the bristles that their tips hold on by.
    Presliding,
    /// Fraction of a step in which a cell comes to speed.
    Rounding,
    /// Resistance of the contacts to each cell's velocity, N s/m.
    Viscosity,
    /// Friction at rest over that of a sliding tip, less 1.
    Breakaway,
}

/// A quantity that is free in a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Free {
    pub what: What,
    /// Its prior and its limits.
    pub quantity: Quantity,
}

/// What a free quantity is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum What {
    Nuisance(Nuisance),
    /// A parameter of the effect in this place of the hypothesis.
    Effect {
        place: usize,
        parameter: usize,
    },
}

impl Nuisance {
    /// The severity of an effect with what this nuisance, at some value, has of the same law; none where their laws are others.
    pub fn added_to(self, effect: &Effect, severity: f64, value: f64) -> Option<f64> {
        match (self, effect.name) {
            (Self::Viscosity, "viscous-drag") => Some(severity + value),
            (Self::Breakaway, "breakaway-friction") => Some(severity * (1.0 + value)),
            _ => None,
        }
    }
}

/// Prior of a nuisance: standard deviation, distance of the limits from the centre, step of derivatives.
const FRICTION: (f64, f64, f64) = (0.15, 0.5, 2e-3);
const STIFFNESS: (f64, f64, f64) = (0.05, 0.1, 4e-3);
const STROKE: (f64, f64, f64) = (0.01, 0.03, 5e-4);
const FRICTION_OF: (f64, f64, f64) = (0.025, 0.1, 4e-3);
const STIFFNESS_OF: (f64, f64, f64) = (0.02, 0.08, 4e-3);
const STROKE_OF: (f64, f64, f64) = (1e-3, 4e-3, 2e-4);
const SLOPE_OF_DEG: (f64, f64, f64) = (0.15, 0.6, 0.05);
const CLOCK_S: (f64, f64, f64) = (1e-3, 3e-3, 5e-4);
const CLOCK_DRIFT: (f64, f64, f64) = (2e-4, 1e-3, 2e-5);
/// Of the presliding: centre, standard deviation, least, most, step.
const PRESLIDING: (f64, f64, f64, f64, f64) = (0.02, 0.015, 1e-3, 0.08, 2e-3);
/// Of the cam's rounding, as of the presliding: no cam has sharp corners.
const ROUNDING: (f64, f64, f64, f64, f64) = (0.05, 0.05, 0.0, 0.3, 5e-3);
/// Of the viscosity, as of the presliding: no contact is quite dry. At the paper's speed 1 N s/m is 18 mN, of some 2 N of friction.
const VISCOSITY: (f64, f64, f64, f64, f64) = (0.0, 0.7, 0.0, 3.0, 0.1);
/// Of the excess of static friction, as of the presliding: no contact is without. Clean worms of both test beds look as if they had up
/// to 0.06.
const BREAKAWAY: (f64, f64, f64, f64, f64) = (0.0, 0.05, 0.0, 0.15, 0.01);
/// Logarithm of the damping ratio: centre, standard deviation, limits' distance, step.
const DAMPING: (f64, f64, f64, f64) = (-0.9, 1.0, 2.2, 0.1);

/// Standard deviation of the prior of an effect's severity, in notable changes: 3° of slope, 0.4 N of drag, 0.4 of one cell's
/// friction.
const SEVERE: f64 = 20.0;

impl Nuisance {
    /// The nuisances of a campaign.
    pub fn all(cells: usize, runs: usize, phase_recorded: bool) -> Vec<Free> {
        let mut all = vec![
            Self::Friction.free(FRICTION),
            Self::Stiffness.free(STIFFNESS),
            Self::Stroke.free(STROKE),
        ];
        for cell in 0..cells {
            all.push(Self::FrictionOf(cell).free(FRICTION_OF));
            all.push(Self::StiffnessOf(cell).free(STIFFNESS_OF));
            all.push(Self::StrokeOf(cell).free(STROKE_OF));
        }
        all.extend((0..runs).map(|run| Self::SlopeOf(run).free(SLOPE_OF_DEG)));
        if phase_recorded {
            all.push(Self::Clock.free(CLOCK_S));
            all.push(Self::ClockDrift.free(CLOCK_DRIFT));
            all.push(Self::Rounding.free_within(ROUNDING));
        }
        let (centre, sigma, reach, step) = DAMPING;
        all.push(Self::Damping.free_within((centre, sigma, centre - reach, centre + reach, step)));
        all.push(Self::Presliding.free_within(PRESLIDING));
        all.push(Self::Viscosity.free_within(VISCOSITY));
        all.push(Self::Breakaway.free_within(BREAKAWAY));
        all
    }

    /// Whether a model file, or the campaign's, can hold it; what it cannot hold is the same in every simulation.
    pub fn is_of_model_file(self) -> bool {
        !matches!(
            self,
            Self::ClockDrift | Self::Damping | Self::Presliding | Self::Rounding | Self::Viscosity | Self::Breakaway
        )
    }

    fn free(self, (sigma, reach, step): (f64, f64, f64)) -> Free {
        self.free_within((0.0, sigma, -reach, reach, step))
    }

    fn free_within(self, (centre, sigma, min, max, step): (f64, f64, f64, f64, f64)) -> Free {
        Free {
            what: What::Nuisance(self),
            quantity: Quantity {
                centre,
                sigma,
                min,
                max,
                step,
            },
        }
    }

    /// Applies its value to the worm of a run, where it concerns the worm.
    pub fn apply(self, value: f64, run: usize, worm: &mut Worm) {
        match self {
            Self::Friction => worm.scale_friction(None, value.exp()),
            Self::Stiffness => worm.scale_stiffness(None, value.exp()),
            Self::Stroke => worm.scale_stroke(None, value.exp()),
            Self::FrictionOf(cell) => worm.scale_friction(Some(cell), value.exp()),
            Self::StiffnessOf(cell) => worm.scale_stiffness(Some(cell), value.exp()),
            Self::StrokeOf(cell) => worm.scale_stroke(Some(cell), value.exp()),
            Self::SlopeOf(of) if of == run => worm.tilt_rad(value.to_radians()),
            Self::SlopeOf(_)
            | Self::Clock
            | Self::ClockDrift
            | Self::Damping
            | Self::Presliding
            | Self::Rounding
            | Self::Viscosity
            | Self::Breakaway => {}
        }
    }
}

impl Free {
    /// A parameter of an effect. Shape parameters have no prior but their range. The severity has a weak one about neutral, so that it
    /// returns there when the data that show it are left out.
    pub fn of_effect(place: usize, number: usize, parameter: &Parameter) -> Self {
        Self {
            what: What::Effect {
                place,
                parameter: number,
            },
            quantity: Quantity {
                centre: parameter.neutral,
                sigma: if number == 0 {
                    SEVERE * parameter.notable
                } else {
                    f64::INFINITY
                },
                min: parameter.min,
                max: parameter.max,
                step: 0.2 * parameter.notable,
            },
        }
    }
}

/// When an effect begins or ends that does not act throughout.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Onset {
    /// Cycles since the first sample of the run.
    pub cycle: f64,
    /// The run in which it happens, once: the runs before and after are as at its start and its end. In every run for none.
    pub run: Option<usize>,
    /// It acts up to then, instead of from then on.
    pub ends: bool,
}

impl Onset {
    /// Whether the effect begins or ends in a run.
    pub fn is_in(&self, run: usize) -> bool {
        self.run.is_none_or(|of| of == run)
    }

    /// Whether the effect acts at the start of a run.
    pub fn acts_at_start(&self, run: usize) -> bool {
        self.run.is_some_and(|of| of < run) != self.ends
    }

    /// Whether the effect acts at the end of a run.
    pub fn acts_at_end(&self, run: usize) -> bool {
        self.run.is_none_or(|of| of <= run) != self.ends
    }
}

/// An effect assumed to act, on one cell or on all that it concerns.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hypothesised {
    pub effect: &'static Effect,
    pub cell: Option<usize>,
    /// When it begins or ends; it acts throughout for none.
    pub onset: Option<Onset>,
}

impl Hypothesised {
    /// An effect that acts throughout.
    pub fn throughout(effect: &'static Effect, cell: Option<usize>) -> Self {
        Self {
            effect,
            cell,
            onset: None,
        }
    }

    /// Whether it is the same effect of the same cell, whenever it begins.
    pub fn is_same_effect(&self, other: &Self) -> bool {
        self.effect.name == other.effect.name && self.cell == other.cell
    }
}

impl PartialEq for Hypothesised {
    fn eq(&self, other: &Self) -> bool {
        self.is_same_effect(other) && self.onset == other.onset
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_happens_in_one_run_lasts_and_what_happens_in_each_does_not() {
        let (yes, no) = (true, false);
        for (run, ends, at_start, at_end) in [
            (Some(1), no, [no, no, yes], [no, yes, yes]),
            (Some(1), yes, [yes, yes, no], [yes, no, no]),
            (None, no, [no, no, no], [yes, yes, yes]),
            (None, yes, [yes, yes, yes], [no, no, no]),
        ] {
            let onset = Onset { cycle: 4.0, run, ends };
            let found = [0, 1, 2].map(|run| (onset.acts_at_start(run), onset.acts_at_end(run)));
            assert_eq!(found.map(|(start, _)| start), at_start, "{onset:?}");
            assert_eq!(found.map(|(_, end)| end), at_end, "{onset:?}");
        }
    }
}
