//! The whole cycles of the settled crawl of a run.

use super::observed::Observed;
use std::ops::Range;

/// Fraction of a cycle that the last one may lack and still count as whole.
const SHORT: f64 = 0.05;
/// Fraction of a cycle by which the first settled sample may miss the start of the cycle.
const LATE: f64 = 0.1;
/// A whole gait cycle that counts.
#[derive(Debug, Clone)]
pub(in crate::explain) struct Cycle {
    /// Number of the cycle since the first sample, from 0.
    pub index: usize,
    pub samples: Range<usize>,
}

/// The whole cycles of the settled crawl, counted from the first sample.
pub(in crate::explain) fn settled_cycles(observed: &Observed<'_>) -> Vec<Cycle> {
    let phase = &observed.phase;
    let since_first = |sample: usize| phase[sample] - phase[0];
    let last = observed.samples() - 1;
    let from = (since_first(observed.settled_from().min(last)) - LATE).ceil().max(0.0) as usize;
    let until = (since_first(last) + SHORT).floor().max(0.0) as usize;
    let begin = |index: usize| phase.partition_point(|&here| here - phase[0] < index as f64);
    (from..until)
        .map(|index| Cycle {
            index,
            samples: begin(index)..begin(index + 1),
        })
        .collect()
}

/// A series at the starts of these cycles and at the end of the last, linear between samples.
pub(in crate::explain) fn at_boundaries(observed: &Observed<'_>, cycles: &[Cycle], series: &[f64]) -> Vec<f64> {
    let phase = &observed.phase;
    let indices = cycles.iter().map(|cycle| cycle.index);
    let boundaries = indices.chain(cycles.last().map(|cycle| cycle.index + 1));
    boundaries
        .map(|index| {
            let boundary = phase[0] + index as f64;
            let high = phase.partition_point(|&here| here < boundary).clamp(1, phase.len() - 1);
            let width = phase[high] - phase[high - 1];
            let fraction = if width > 0.0 {
                (boundary - phase[high - 1]) / width
            } else {
                1.0
            };
            series[high - 1] + fraction * (series[high] - series[high - 1])
        })
        .collect()
}
