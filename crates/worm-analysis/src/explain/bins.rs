//! The bins of a run: by cycle, step, and phase within the step.
//!
//! Samples are many and correlated, and neither model nor discrepancy changes within a twelfth of a step. So the likelihood is that of
//! the mean residual of each cell in each bin.

use super::observed::Observed;
use std::ops::Range;

/// Most bins of a step, and fewest samples of a bin on average.
const BINS_PER_STEP: usize = 12;
const SAMPLES_PER_BIN: f64 = 3.0;
/// Most bins of a run: long recordings of many cells get wider ones.
const MAX_BINS: f64 = 1440.0;

/// A bin.
#[derive(Debug, Clone)]
pub(super) struct Bin {
    pub samples: Range<usize>,
    /// Place in the run, in bins from phase 0.
    pub number: i64,
    /// Mean gait phase of its samples, cycles.
    pub phase: f64,
    /// The cell that steps.
    pub stepping: usize,
    /// Phase within the step, 0 to 1.
    pub of_step: f64,
}

/// The bins of a run that count, in their order.
#[derive(Debug, Clone)]
pub(super) struct Bins {
    pub bins: Vec<Bin>,
    pub per_step: usize,
    /// Gait phase at the first sample of the run, cycles.
    pub start_phase: f64,
    cells: usize,
}

impl Bins {
    /// The bins of all samples that count.
    pub fn new(observed: &Observed<'_>) -> Self {
        let cells = observed.cells();
        let from = observed.counts_from.min(observed.samples() - 1);
        let steps = (observed.phase[observed.samples() - 1] - observed.phase[from]) * cells as f64;
        let samples_per_step = (observed.samples() - from) as f64 / steps;
        let per_step = (samples_per_step / SAMPLES_PER_BIN)
            .min(MAX_BINS / steps)
            .clamp(1.0, BINS_PER_STEP as f64) as usize;
        let in_bins = |sample: usize| (observed.phase[sample] * (cells * per_step) as f64).floor() as i64;
        let mut bins: Vec<Bin> = Vec::new();
        let mut first = from;
        for sample in from..observed.samples() {
            let is_last = sample + 1 == observed.samples();
            if !is_last && in_bins(sample + 1) == in_bins(first) {
                continue;
            }
            let samples = first..sample + 1;
            let phase = observed.phase[samples.clone()].iter().sum::<f64>() / samples.len() as f64;
            bins.push(Bin {
                number: in_bins(first),
                stepping: observed.stepping(first),
                of_step: (phase * cells as f64).rem_euclid(1.0),
                phase,
                samples,
            });
            first = sample + 1;
        }
        Self {
            bins,
            per_step,
            start_phase: observed.phase[0],
            cells,
        }
    }

    /// Bins of a gait cycle.
    pub fn per_cycle(&self) -> i64 {
        (self.per_step * self.cells) as i64
    }

    /// Place of a bin within the cycle.
    pub fn place(&self, bin: usize) -> usize {
        self.bins[bin].number.rem_euclid(self.per_cycle()) as usize
    }

    pub fn len(&self) -> usize {
        self.bins.len()
    }
}
