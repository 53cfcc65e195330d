//! Whether a worm that should be lifted touches something.

use super::{FrictionAt, LiftedTurns};
use crate::self_sensing::gear::GearModel;
use std::f64::consts::TAU;
use std::fmt::{self, Display};
use worm_physics::Worm;

/// Rise of the torque in a step from which tips hold something, as a share of what the configured tips would let it rise by: a worm in its
/// canal shows some 0.9, one whose tips hold two fifths of that hides below 0.2, as a ripple of 2.5 mN m with each step would.
const TOUCHING_SHARE: f64 = 0.2;
/// Rise that a ripple of the gears may look like, as a multiple of its standard deviation: one that returns with each step, at its worst.
const RIPPLE_SIGMAS: f64 = 4.0;
/// Standard errors by which forward and backward must differ …
const APART_SIGMAS: f64 = 4.0;
/// … and the share of the friction: gears have a better direction, too.
const APART_SHARE: f64 = 0.1;

/// Why a worm cannot have been lifted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Touching {
    /// The torque rises in the step of each cell, as where a tip holds on to something.
    InSteps {
        /// By how much, N m.
        rise_n_m: f64,
        /// What gears may show, N m.
        allowed_n_m: f64,
    },
    /// One direction is heavier than the other, as where something pulls at the worm.
    OneWay {
        /// Friction forward less that backward, N m.
        difference_n_m: f64,
        /// Its standard error, N m.
        sigma_n_m: f64,
    },
}

impl Display for Touching {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::InSteps { rise_n_m, allowed_n_m } => write!(
                f,
                "the torque rises by {:.1} mN m in the step of each cell, and gears alone show at most {:.1}",
                1e3 * rise_n_m,
                1e3 * allowed_n_m
            ),
            Self::OneWay {
                difference_n_m,
                sigma_n_m,
            } => write!(
                f,
                "forward takes {:+.2} ± {:.2} mN m more than backward",
                1e3 * difference_n_m,
                1e3 * sigma_n_m
            ),
        }
    }
}

/// What shows that a worm was not lifted in these turns; none where nothing does. `worm` and `gear` are as configured.
pub fn touches(turns: &[LiftedTurns], worm: &Worm, gear: &GearModel) -> Option<Touching> {
    let count = turns.len() as f64;
    let rise_n_m = turns.iter().map(|turns| turns.step_rise_n_m).sum::<f64>() / count;
    let contacts = worm.contacts();
    let tips_n = contacts
        .iter()
        .map(|contact| contact.stiffness_n_per_m * (contact.forward_bound_m + contact.backward_bound_m))
        .sum::<f64>()
        / contacts.len() as f64;
    let lever_m = worm.cells() as f64 * worm.stroke_m() / TAU;
    let allowed_n_m = (TOUCHING_SHARE * tips_n * lever_m).max(RIPPLE_SIGMAS * gear.ripple_sigma_n_m);
    if rise_n_m > allowed_n_m {
        return Some(Touching::InSteps { rise_n_m, allowed_n_m });
    }
    let points: Vec<FrictionAt> = turns.iter().map(|turns| turns.friction).collect();
    let friction_n_m = points.iter().map(|point| point.friction_n_m.abs()).sum::<f64>() / count;
    let (difference_n_m, sigma_n_m) = direction_difference(&points)?;
    (difference_n_m.abs() > (APART_SIGMAS * sigma_n_m).max(APART_SHARE * friction_n_m)).then_some(Touching::OneWay {
        difference_n_m,
        sigma_n_m,
    })
}

/// Mean friction forward less that backward, and its standard error, N m; none where one of them was not measured.
pub fn direction_difference(points: &[FrictionAt]) -> Option<(f64, f64)> {
    let mean = |sign: f64| {
        let of_sign = || points.iter().filter(move |at| at.velocity_rad_per_s * sign > 0.0);
        let count = of_sign().count() as f64;
        let variance: f64 = of_sign().map(|at| at.sigma_n_m.powi(2)).sum();
        (count > 0.0).then(|| {
            (
                of_sign().map(|at| at.friction_n_m).sum::<f64>() / count,
                variance.sqrt() / count,
            )
        })
    };
    let ((forward_n_m, forward_sigma), (backward_n_m, backward_sigma)) = (mean(1.0)?, mean(-1.0)?);
    Some((forward_n_m - backward_n_m, forward_sigma.hypot(backward_sigma)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use worm_physics::Contact;

    /// The worm of the paper: its tips let the torque rise by 25 mN m in a step.
    fn worm() -> Worm {
        Worm::uniform(4, Contact::symmetric(980.0, 1.75e-3), 0.333, 11.5e-3).expect("the figures of the paper")
    }

    fn turns(velocity_rad_per_s: f64, friction_n_m: f64, step_rise_n_m: f64) -> LiftedTurns {
        LiftedTurns {
            friction: FrictionAt {
                velocity_rad_per_s,
                friction_n_m,
                sigma_n_m: 3e-4,
            },
            step_rise_n_m,
        }
    }

    #[test]
    fn tips_that_hold_and_a_pull_are_seen_and_gears_of_any_kind_are_not() {
        let gear = GearModel {
            ripple_sigma_n_m: 1e-3,
            ..GearModel::plain(0.372, 3.3, 2e-3)
        };
        let wavy = GearModel {
            ripple_sigma_n_m: 2e-3,
            ..gear
        };
        let table = [
            ("lifted", gear, [0.012, 0.012], 0.0, ""),
            ("a ripple with each step", gear, [0.012, 0.012], 2e-3, ""),
            ("one that falls", gear, [0.012, 0.012], -9e-3, ""),
            ("gears that are known to be wavy", wavy, [0.012, 0.012], 7e-3, ""),
            ("worn gears", gear, [0.05, 0.05], 0.0, ""),
            ("gears with a better direction", gear, [0.0305, 0.0295], 0.0, ""),
            (
                "in the canal",
                gear,
                [0.018, 0.016],
                17e-3,
                "rises by 17.0 mN m in the step",
            ),
            (
                "in the canal with half of the friction",
                gear,
                [0.014, 0.014],
                6e-3,
                "rises by 6.0 mN m",
            ),
            (
                "hung up by its tail",
                gear,
                [0.014, 0.011],
                0.0,
                "forward takes +3.00 ± 0.30 mN m more",
            ),
            (
                "hung up by its head",
                gear,
                [0.011, 0.014],
                0.0,
                "forward takes -3.00 ± 0.30 mN m more",
            ),
        ];
        for (what, gear, [forward_n_m, backward_n_m], rise_n_m, expected) in table {
            let turns = [0.6, 2.5].map(|velocity| {
                [
                    turns(velocity, forward_n_m, rise_n_m),
                    turns(-velocity, backward_n_m, rise_n_m),
                ]
            });
            let said = touches(&turns.concat(), &worm(), &gear).map(|touching| touching.to_string());
            let is_as_expected = said.as_ref().map_or(expected.is_empty(), |said| {
                !expected.is_empty() && said.contains(expected)
            });
            assert!(is_as_expected, "{what}: {said:?}");
        }
    }
}
