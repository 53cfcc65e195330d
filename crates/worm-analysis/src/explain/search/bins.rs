//! The bins of a run: by cycle, step, and phase within the step.
//!
//! Samples are many and correlated, and neither model nor discrepancy changes within a bin. So the likelihood is that of the mean
//! residual of each channel in each bin.

use std::ops::Range;

/// A bin.
#[derive(Debug, Clone)]
pub(in crate::explain) struct Bin {
    pub samples: Range<usize>,
    /// Place in the run, in bins from phase 0.
    pub number: i64,
    /// Mean phase of its samples, cycles.
    pub phase: f64,
    /// Whole cycles since the first sample of the run, at its own first sample.
    pub cycle: usize,
    /// The channel that leads: for a worm, the cell that steps.
    pub leading: usize,
    /// Phase within the step, 0 to 1.
    pub of_step: f64,
}

/// The bins of a run that count, in their order.
#[derive(Debug, Clone)]
pub(in crate::explain) struct Bins {
    pub bins: Vec<Bin>,
    pub per_step: usize,
    /// Phase at the first sample of the run, cycles.
    pub start_phase: f64,
    /// Cycles that the run began, the last sample's among them.
    pub cycles: usize,
    /// Steps of a cycle.
    pub steps: usize,
}

impl Bins {
    /// Bins of a cycle.
    pub fn per_cycle(&self) -> i64 {
        (self.per_step * self.steps) as i64
    }

    /// Place of a bin within the cycle.
    pub fn place(&self, bin: usize) -> usize {
        self.bins[bin].number.rem_euclid(self.per_cycle()) as usize
    }

    pub fn len(&self) -> usize {
        self.bins.len()
    }
}
