//! The torque in each bin, measured and predicted.
//!
//! A bin's torque is the work in it over the way that the cam turns, and so is the model's, whatever happens within the bin.

use super::observed::Observed;
use super::predicted::Predicted;
use crate::explain::search::bins::Bins;
use std::f64::consts::TAU;
use std::ops::Range;

/// The samples at the ends of a bin: its first, and the first of the next.
pub(super) fn ends(observed: &Observed<'_>, samples: &Range<usize>) -> Range<usize> {
    samples.start..samples.end.min(observed.samples() - 1)
}

/// Mean torque in each bin, N m: measured, and as a model has it shown by the current. `NaN` where it was not seen; nothing of a run without
/// a current.
pub(in crate::explain) fn in_bins(observed: &Observed<'_>, bins: &Bins, predicted: &Predicted) -> Vec<[f64; 2]> {
    let Some(torque) = &observed.torque else {
        return Vec::new();
    };
    let pairs_n_m: Vec<[f64; 2]> = bins
        .bins
        .iter()
        .map(|bin| {
            let samples = ends(observed, &bin.samples);
            let turned_rad = TAU * (observed.phase[samples.end] - observed.phase[samples.start]);
            let model_j = predicted.work_j[samples.end] - predicted.work_j[samples.start];
            if turned_rad > 0.0 {
                let measured_n_m = torque.work_j(samples) / turned_rad;
                [measured_n_m, model_j / turned_rad]
            } else {
                [f64::NAN; 2]
            }
        })
        .collect();
    let with_lead = |bin: usize| {
        let [measured_n_m, model_n_m] = pairs_n_m[bin];
        let lead_n_m = predicted.gears.lead_s / observed.cycle_s * rise_n_m(bins, &pairs_n_m, bin);
        [measured_n_m, predicted.gears.shown_n_m(model_n_m + lead_n_m)]
    };
    (0..bins.len()).map(with_lead).collect()
}

/// By how much the model's torque rises at a bin within its step, N m in each cycle of phase.
fn rise_n_m(bins: &Bins, pairs_n_m: &[[f64; 2]], bin: usize) -> f64 {
    let step_of = |bin: usize| bins.bins[bin].number.div_euclid(bins.per_step as i64);
    let is_same_step = |other: &usize| *other < bins.len() && step_of(*other) == step_of(bin);
    let before = bin.checked_sub(1).filter(is_same_step).unwrap_or(bin);
    let after = Some(bin + 1).filter(is_same_step).unwrap_or(bin);
    let rise_n_m = pairs_n_m[after][1] - pairs_n_m[before][1];
    let phase = bins.bins[after].phase - bins.bins[before].phase;
    if phase > 0.0 && rise_n_m.is_finite() {
        rise_n_m / phase
    } else {
        0.0
    }
}

/// What a prediction leaves of the torque in each bin, N m; as [`in_bins`].
pub(in crate::explain) fn residual_n_m(observed: &Observed<'_>, bins: &Bins, predicted: &Predicted) -> Vec<f64> {
    let pairs = in_bins(observed, bins, predicted);
    pairs.iter().map(|[measured, model]| measured - model).collect()
}
