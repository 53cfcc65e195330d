//! The bins of a worm's recording.

use super::observed::Observed;
use crate::explain::search::bins::{Bin, Bins};

/// Most bins of a step, and fewest samples of a bin on average: neither model nor discrepancy changes within a twelfth of a step.
const BINS_PER_STEP: usize = 12;
const SAMPLES_PER_BIN: f64 = 3.0;
/// Most bins of a run: long recordings of many cells get wider ones.
const MAX_BINS: f64 = 1440.0;

/// The bins of all samples that count.
pub(in crate::explain) fn bins(observed: &Observed<'_>) -> Bins {
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
            leading: observed.stepping(first),
            cycle: cycle_of(observed, first),
            of_step: (phase * cells as f64).rem_euclid(1.0),
            phase,
            samples,
        });
        first = sample + 1;
    }
    Bins {
        bins,
        per_step,
        start_phase: observed.phase[0],
        cycles: cycle_of(observed, observed.samples() - 1) + 1,
        steps: cells,
    }
}

/// Which cycle since the first sample a sample is in.
fn cycle_of(observed: &Observed<'_>, sample: usize) -> usize {
    (observed.phase[sample] - observed.phase[0]).max(0.0).floor() as usize
}
