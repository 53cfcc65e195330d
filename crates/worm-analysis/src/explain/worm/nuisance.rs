//! What is not known exactly of a worm and its recordings, with priors.

use crate::explain::search::parameter::{Free, What};
use crate::least_squares::Quantity;
use worm_physics::Worm;
use worm_physics::effect::Effect;

/// A quantity of the worm or its recordings that is not known exactly and that no effect is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::explain) enum Nuisance {
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
    /// Logarithm of a factor on the friction of all tips in one run.
    FrictionIn(usize),
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
    /// Torque that the current shows beyond the known friction of the gears, N m.
    GearOffset,
    /// Share by which the torque that the current shows is wrong.
    TorqueGain,
    /// Friction of the gears for each torque on them, beyond the known one.
    GearLoad,
    /// Share of the body's damping that bears on the drive.
    PadDamping,
}

/// Nuisances of the whole campaign, and of each cell or run.
const OF_ALL: [Nuisance; 14] = [
    Nuisance::Friction,
    Nuisance::Stiffness,
    Nuisance::Stroke,
    Nuisance::Clock,
    Nuisance::ClockDrift,
    Nuisance::Damping,
    Nuisance::Presliding,
    Nuisance::Rounding,
    Nuisance::Viscosity,
    Nuisance::Breakaway,
    Nuisance::GearOffset,
    Nuisance::TorqueGain,
    Nuisance::GearLoad,
    Nuisance::PadDamping,
];
const OF_EACH: [fn(usize) -> Nuisance; 5] = [
    Nuisance::FrictionOf,
    Nuisance::StiffnessOf,
    Nuisance::StrokeOf,
    Nuisance::SlopeOf,
    Nuisance::FrictionIn,
];

/// Prior of a nuisance: standard deviation, distance of the limits from the centre, step of derivatives.
const FRICTION: (f64, f64, f64) = (0.15, 0.5, 2e-3);
/// Tight, because positions show forces over stiffness alone: with it free, pads as soft as one likes would take the place of any load.
const STIFFNESS: (f64, f64, f64) = (0.05, 0.1, 4e-3);
/// Friction and stiffness where the motor's current shows forces: data decide there, and a load is named only where they ask for one.
const BY_FORCES: (f64, f64, f64) = (0.25, 0.7, 3e-3);
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

impl Nuisance {
    /// The nuisances of a campaign of so many cells and runs, of which only positions are known.
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

    /// Those of a campaign in which forces are known, too: the same, with wider priors of friction and stiffness, and without those of the
    /// tracker where it saw nothing.
    pub fn all_by_forces(cells: usize, runs: usize, phase_recorded: bool, sees_positions: bool) -> Vec<Free> {
        let mut all = Self::all(cells, runs, phase_recorded);
        let of_tracker = [Self::Clock, Self::ClockDrift].map(Self::what);
        all.retain(|free| sees_positions || !of_tracker.contains(&free.what));
        for nuisance in [Self::Friction, Self::Stiffness] {
            let of_it = all.iter_mut().filter(|free| free.what == nuisance.what());
            of_it.for_each(|free| *free = nuisance.free(BY_FORCES));
        }
        all
    }

    /// The nuisance of a number: those of the whole campaign come first, then those of each cell and run in turn.
    pub fn of_number(number: usize) -> Self {
        match number.checked_sub(OF_ALL.len()) {
            None => OF_ALL[number],
            Some(rest) => OF_EACH[rest % OF_EACH.len()](rest / OF_EACH.len()),
        }
    }

    /// The nuisance that a free quantity is; none for a parameter of an effect.
    pub fn of(what: What) -> Option<Self> {
        match what {
            What::Nuisance(number) => Some(Self::of_number(number)),
            What::Effect { .. } | What::Law(_) => None,
        }
    }

    /// Its number as a free quantity.
    pub fn what(self) -> What {
        let of_each = |kind: usize, one: usize| OF_ALL.len() + OF_EACH.len() * one + kind;
        let number = match self {
            Self::Friction => 0,
            Self::Stiffness => 1,
            Self::Stroke => 2,
            Self::Clock => 3,
            Self::ClockDrift => 4,
            Self::Damping => 5,
            Self::Presliding => 6,
            Self::Rounding => 7,
            Self::Viscosity => 8,
            Self::Breakaway => 9,
            Self::GearOffset => 10,
            Self::TorqueGain => 11,
            Self::GearLoad => 12,
            Self::PadDamping => 13,
            Self::FrictionOf(cell) => of_each(0, cell),
            Self::StiffnessOf(cell) => of_each(1, cell),
            Self::StrokeOf(cell) => of_each(2, cell),
            Self::SlopeOf(run) => of_each(3, run),
            Self::FrictionIn(run) => of_each(4, run),
        };
        What::Nuisance(number)
    }

    /// Whether it concerns a run.
    pub fn concerns(self, run: usize) -> bool {
        !matches!(self, Self::SlopeOf(of) | Self::FrictionIn(of) if of != run)
    }

    /// Whether a model file, or the campaign's, can hold it, or it is a matter of one run; what it cannot hold is the same in every simulation.
    pub fn is_of_model_file(self) -> bool {
        !matches!(
            self,
            Self::ClockDrift
                | Self::Damping
                | Self::Presliding
                | Self::Rounding
                | Self::Viscosity
                | Self::Breakaway
                | Self::GearOffset
                | Self::TorqueGain
                | Self::GearLoad
                | Self::PadDamping
        )
    }

    pub(super) fn free(self, (sigma, reach, step): (f64, f64, f64)) -> Free {
        self.free_within((0.0, sigma, -reach, reach, step))
    }

    /// About 0, with a reach and a step in standard deviations.
    pub(super) fn free_by_sigma(self, sigma: f64, reach: f64, step: f64) -> Free {
        self.free((sigma, reach * sigma, step * sigma))
    }

    pub(super) fn free_within(self, (centre, sigma, min, max, step): (f64, f64, f64, f64, f64)) -> Free {
        Free {
            what: self.what(),
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
            Self::FrictionIn(of) if of == run => worm.scale_friction(None, value.exp()),
            Self::SlopeOf(_)
            | Self::FrictionIn(_)
            | Self::Clock
            | Self::ClockDrift
            | Self::Damping
            | Self::Presliding
            | Self::Rounding
            | Self::Viscosity
            | Self::Breakaway
            | Self::GearOffset
            | Self::TorqueGain
            | Self::GearLoad
            | Self::PadDamping => {}
        }
    }

    /// The severity of an effect with what this nuisance, at some value, has of the same law; none where their laws are others.
    pub fn added_to(self, effect: &Effect, severity: f64, value: f64) -> Option<f64> {
        match (self, effect.name) {
            (Self::Viscosity, "viscous-drag") => Some(severity + value),
            (Self::Breakaway, "breakaway-friction") => Some(severity * (1.0 + value)),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_nuisance_has_a_number_of_its_own() {
        for free in Nuisance::all(8, 6, true) {
            let nuisance = Nuisance::of(free.what).expect("it is one");
            assert_eq!(nuisance.what(), free.what);
        }
        for nuisance in [
            Nuisance::FrictionOf(5),
            Nuisance::SlopeOf(2),
            Nuisance::FrictionIn(3),
            Nuisance::GearLoad,
        ] {
            assert_eq!(Nuisance::of(nuisance.what()), Some(nuisance));
        }
    }
}
