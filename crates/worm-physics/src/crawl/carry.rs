//! The worm on a measured path: the tips follow their laws, the body follows the measurement.

use super::{Crawl, SHORTEST_S};
use crate::mechanics::Mechanics;

/// Most iterations for the cells' displacements against a compliant drive.
const MAX_TRIALS: usize = 30;
/// Tolerance of the body's displacement, m.
const FOUND_M: f64 = 1e-10;

impl Crawl {
    /// Moves the worm to a phase at a uniform rate over `duration_s`, and the mean of its cells to `mean_m`, whether or not forces
    /// balance. The ledger then has the losses in the contacts and the work against the weight on that path; its actuator work has no
    /// meaning.
    pub fn carry_to(&mut self, mechanics: &Mechanics, phase: f64, duration_s: f64, mean_m: f64) {
        let (from, from_m) = (self.phase, self.mean_position_m());
        let parts = self.parts(phase, duration_s);
        for part in 1..=parts as usize {
            let fraction = part as f64 / parts;
            let here_m = from_m + fraction * (mean_m - from_m);
            self.carry(mechanics, from + fraction * (phase - from), duration_s / parts, here_m);
        }
    }

    fn carry(&mut self, mechanics: &Mechanics, phase: f64, step_s: f64, mean_m: f64) {
        let shift_m = mean_m - self.mean_position_m();
        let increment = self.prepare(mechanics, phase, step_s.max(SHORTEST_S));
        let mut translation_m = 0.0;
        for _ in 0..MAX_TRIALS {
            self.try_out(mechanics, &increment, translation_m);
            let tried_m: f64 = self.cell[..self.cells].iter().map(|cell| cell.trial.shift_m).sum();
            let missing_m = shift_m - tried_m / self.cells as f64;
            if missing_m.abs() < FOUND_M {
                break;
            }
            translation_m += missing_m;
        }
        self.take(mechanics, &increment, translation_m, phase);
    }
}
