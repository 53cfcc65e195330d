//! The prediction for one run.

use super::gears::GearErrors;
use super::observed::Observed;

/// Positions of one run, and the work of its drive, as a hypothesis predicts them.
#[derive(Debug, Clone)]
pub(in crate::explain) struct Predicted {
    /// `[sample][cell]`, flat, m.
    pub position_m: Vec<f64>,
    /// Net work of the drive up to each sample, from any beginning, J.
    pub work_j: Vec<f64>,
    /// What the gears make of it.
    pub gears: GearErrors,
}

impl Predicted {
    /// Mean advance in a cycle, m: over as many whole settled cycles as there are.
    pub fn advance_m(&self, observed: &Observed<'_>) -> f64 {
        let cells = observed.cells();
        let mean_m = |sample: usize| {
            let at_m = &self.position_m[sample * cells..(sample + 1) * cells];
            at_m.iter().sum::<f64>() / cells as f64
        };
        let phase = &observed.phase;
        let last = observed.samples() - 1;
        let cycles = observed.whole_cycles().max(1) as f64;
        let from = phase.partition_point(|&here| here < phase[last] - cycles).min(last - 1);
        (mean_m(last) - mean_m(from)) / (phase[last] - phase[from])
    }
}
