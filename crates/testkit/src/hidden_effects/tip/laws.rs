//! Forms of the laws that an effect may have beside the library's own, so that a search cannot rest on the formula.
//!
//! Each has the library's parameter with the library's meaning: the growth of a pad's secant stiffness at 1.75 mm, the share of
//! the stiffness that relaxes, the share of the friction lost in a cycle.

use crate::random::log_uniform;
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Deformation at which hardening is stated, m.
const HARDENING_M: f64 = 1.75e-3;
/// Exponent of the exponential law at that deformation.
const STEEPNESS: f64 = 2.0;
/// Cycles that a stepwise wear waits between two losses.
const CYCLES_A_STEP: f64 = 3.0;

/// How a pad grows stiffer.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Hardening {
    /// With the square of the deformation, as in the library.
    #[default]
    Cubic,
    /// With its fourth power.
    Quintic,
    /// Exponentially.
    Exponential,
    /// From half of the stated deformation on, in proportion.
    Knee,
}

impl Hardening {
    /// Growth of the secant stiffness at a deformation over that at the stated one, and its logarithmic slope.
    pub fn growth(self, deformation_m: f64) -> (f64, f64) {
        let x = (deformation_m / HARDENING_M).abs();
        match self {
            Self::Cubic => (x * x, 2.0),
            Self::Quintic => (x.powi(4), 4.0),
            Self::Exponential => {
                let curve = |x: f64| (STEEPNESS * x).exp() - 1.0 - STEEPNESS * x;
                (curve(x) / curve(1.0), 2.0 + STEEPNESS * x)
            }
            Self::Knee => {
                let beyond = (2.0 * x - 1.0).max(0.0);
                (beyond, if beyond > 0.0 { 2.0 * x / beyond.max(0.1) } else { 0.0 })
            }
        }
    }
}

/// How friction is lost from cycle to cycle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Wear {
    /// The same share of what is left in each cycle, as in the library.
    #[default]
    Geometric,
    /// The same amount every three cycles, at once.
    Stepwise,
    /// Fast at first, towards a floor of half the friction lost in so many cycles.
    Saturating { cycles: f64 },
}

impl Wear {
    /// Friction left after so many cycles, over that at the start.
    pub fn left(self, loss_per_cycle: f64, cycles: f64) -> f64 {
        let cycles = cycles.max(0.0);
        match self {
            Self::Geometric => (1.0 - loss_per_cycle).powf(cycles),
            Self::Stepwise => {
                let steps = (cycles / CYCLES_A_STEP + 0.5).floor();
                (1.0 - loss_per_cycle * CYCLES_A_STEP * steps).max(0.2)
            }
            Self::Saturating { cycles: scale } => {
                1.0 - (loss_per_cycle * scale * (1.0 - (-cycles / scale).exp())).min(0.8)
            }
        }
    }
}

/// The forms of one worm; the default are the library's.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Laws {
    pub hardening: Hardening,
    pub wear: Wear,
    /// Ratio of the time constants of two Maxwell branches of the same stiffness; 0: one branch.
    pub creep_ratio: f64,
    /// Length over which a slick patch begins and ends, m; 0: at once.
    pub patch_edge_m: f64,
}

impl Laws {
    /// Forms drawn at random, now and then the library's.
    pub fn draw(rng: &mut Xoshiro256PlusPlus) -> Self {
        Self {
            hardening: match rng.random_range(0..4) {
                0 => Hardening::Cubic,
                1 => Hardening::Quintic,
                2 => Hardening::Exponential,
                _ => Hardening::Knee,
            },
            wear: match rng.random_range(0..3) {
                0 => Wear::Geometric,
                1 => Wear::Stepwise,
                _ => Wear::Saturating {
                    cycles: rng.random_range(6.0..20.0),
                },
            },
            creep_ratio: if rng.random::<bool>() {
                0.0
            } else {
                log_uniform(2.0, 6.0, rng)
            },
            patch_edge_m: log_uniform(0.5e-3, 6e-3, rng),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_has_the_librarys_severity() {
        for law in [
            Hardening::Cubic,
            Hardening::Quintic,
            Hardening::Exponential,
            Hardening::Knee,
        ] {
            assert_eq!(law.growth(0.0).0, 0.0, "{law:?}");
            assert!((law.growth(-HARDENING_M).0 - 1.0).abs() < 1e-12, "{law:?}");
            for x in [0.3, 0.7, 1.0, 1.3] {
                let small = 1e-6;
                let growth = |x: f64| law.growth(x * HARDENING_M).0;
                let slope = x * (growth(x + small) - growth(x)) / small;
                assert!(
                    slope <= law.growth(x * HARDENING_M).1 * growth(x) + 1e-3,
                    "{law:?} at {x}"
                );
            }
        }
        let saturating = Wear::Saturating { cycles: 10.0 };
        for law in [Wear::Geometric, Wear::Stepwise, saturating] {
            assert_eq!(law.left(0.01, 0.0), 1.0, "{law:?}");
            let lost = 1.0 - law.left(0.01, 6.0);
            assert!((0.04..0.065).contains(&lost), "{law:?} loses {lost} in six cycles");
        }
    }
}
