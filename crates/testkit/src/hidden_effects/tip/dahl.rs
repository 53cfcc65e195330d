//! Dahl's friction with an exponent other than 1: dF/dx = σ (1 − F/g)ⁱ, F the force, x the tip's way and g the limit.
//!
//! Below 1 the limit is reached on a finite way, with a sharp knee, as in brittle contacts; above 1 the knee is round and
//! the limit approached slowly, as in ductile ones. There is neither damping nor a viscous part.

use super::bristle::{TipLoad, TipStep, yield_at};

/// Newton's steps at most; two are usual.
const MAX_STEPS: usize = 12;
/// A correction smaller than this share of the way is the last: what it leaves is of the order of its square.
const CLOSE: f64 = 1e-4;

/// The exponent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Knee {
    /// ½
    Sharp,
    /// 3⁄2
    Round,
}

/// Figures of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dahl {
    pub knee: Knee,
}

impl Dahl {
    pub fn solve(&self, load: &TipLoad) -> TipStep {
        let reach_m = load.limit_n / load.bristle_n_per_m;
        let remaining = 1.0 - load.bristle_m / reach_m;
        if remaining <= 0.0 {
            // A limit that has fallen below the force leaves Dahl's root undefined: it is followed as with exponent 1.
            return yield_at(load, 1.0 / reach_m, 0.0, 0.0);
        }
        let root = remaining.sqrt();
        // What lacks to the limit after a way, as a share of it, and that to the power of the exponent.
        let after = |displacement_m: f64| {
            let half = 0.5 * displacement_m / reach_m;
            match self.knee {
                Knee::Sharp => {
                    let root = (root - half).max(0.0);
                    (root * root, root)
                }
                Knee::Round => {
                    let root = 1.0 / (1.0 / root + half);
                    (root * root, root * root * root)
                }
            }
        };
        // The force is concave over the way, so Newton's steps from 0 come from below and do not overshoot.
        let mut displacement_m = 0.0;
        for _ in 0..MAX_STEPS {
            let (remaining, slope) = after(displacement_m);
            let held_n = load.limit_n * (1.0 - remaining) + load.slack_n_per_m * displacement_m;
            let further_m = (load.pull_n - held_n) / (load.slack_n_per_m + load.bristle_n_per_m * slope);
            displacement_m += further_m.max(0.0);
            if further_m <= CLOSE * displacement_m {
                break;
            }
        }
        TipStep {
            displacement_m,
            bristle_m: reach_m * (1.0 - after(displacement_m).0),
        }
    }
}
