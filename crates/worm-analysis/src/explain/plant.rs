//! What the judgement needs to know of the machine whose model it judges.
//!
//! Nothing in [`super::discrepancy`] and [`super::judge`] knows of worms: a plant has runs, bodies whose positions are compared with a
//! model's in bins of the gait, and conditions that differ from run to run.

use super::bins::Bins;

/// A machine that was recorded, with its gap to a model.
pub(super) trait Plant: Sync {
    /// Number of runs.
    fn runs(&self) -> usize;
    /// Bodies whose positions are compared.
    fn cells(&self) -> usize;
    /// The condition that differs from run to run: for a worm, the sine of the slope.
    fn condition(&self, run: usize) -> f64;
    /// The bins of the gap in a run.
    fn bins(&self, run: usize) -> &Bins;
    /// The whitened rows of displacements of every body in every bin of a run, m: `[bin][body]`, flat.
    fn rows_of(&self, run: usize, pattern_m: &[f64]) -> Vec<f64>;
}
