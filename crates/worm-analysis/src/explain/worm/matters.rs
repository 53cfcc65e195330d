//! Whether an effect changes what anybody asks: the advance, the energy, or where the cells are within a cycle.
//!
//! The run is simulated with the effect and without it, all else alike. An effect counts where its change of the advance or of the
//! energy of a cycle is beyond a fraction of them, or its change of the positions beyond the noise of one of them. The last limit is for
//! effects such as a latency that moves neither. How sure that is follows from the standard error of the severity, in proportion.

use super::energy::energy_per_cycle_j;
use super::recorded_worm::RecordedWorm;
use crate::explain::search::fit::Fit;
use crate::explain::search::impact::Impact;
use crate::explain::search::parameter::What;

/// The impact of the effect in some place of a fitted hypothesis; `limit` is the relative change of advance and energy that matters.
pub(in crate::explain) fn impact(worm: &RecordedWorm<'_>, fit: &Fit, place: usize, limit: f64) -> Impact {
    let free = fit.hypothesis.free.iter().zip(&fit.at);
    let at = free.map(|(free, &at)| match free.what {
        What::Effect {
            place: here,
            parameter: 0,
        } if here == place => free.quantity.centre,
        _ => at,
    });
    // What begins in mid-run counts by the cycles after that.
    let hypothesis = fit.hypothesis.without_onsets();
    let without_at: Vec<f64> = at.collect();
    let onset = fit.hypothesis.hypothesised[place].onset;
    let runs = worm.scene.observed.iter().enumerate();
    let mut impact = Impact::default();
    let acts_in = |run: usize| onset.is_none_or(|onset| onset.acts_in(run));
    for (run, observed) in runs.filter(|(run, _)| acts_in(*run)) {
        let predict = |at: &[f64]| worm.scene.predict(run, &hypothesis, at);
        let (Some(on), Some(off)) = (predict(&fit.at), predict(&without_at)) else {
            continue;
        };
        let (on_m, off_m) = (on.advance_m(observed), off.advance_m(observed));
        let of_advance = (on_m - off_m).abs() / off_m.abs().max(worm.least_advance_m(run)) / limit;
        impact.outcome = impact.outcome.max(of_advance);
        let energies_j = (
            energy_per_cycle_j(&worm.scene, run, (&hypothesis, &fit.at)),
            energy_per_cycle_j(&worm.scene, run, (&hypothesis, &without_at)),
        );
        if let (Some(on_j), Some(off_j)) = energies_j {
            impact.energy = impact.energy.max((on_j / off_j - 1.0).abs() / limit);
        }
        let (cells, from) = (observed.cells(), observed.settled_from());
        let apart_m = |sample: usize, cell: usize| {
            let beyond_m = (on_m - off_m) * (observed.phase[sample] - observed.phase[from]);
            on.position_m[sample * cells + cell] - off.position_m[sample * cells + cell] - beyond_m
        };
        let samples = (observed.samples() - from) as f64;
        let variance_m2 = |cell: usize| {
            let apart = || (from..observed.samples()).map(move |sample| apart_m(sample, cell));
            let mean_m = apart().sum::<f64>() / samples;
            apart().map(|m| (m - mean_m).powi(2)).sum::<f64>() / samples
        };
        let rms_m = ((0..cells).map(variance_m2).sum::<f64>() / cells as f64).sqrt();
        impact.position = impact.position.max(rms_m / observed.noise_m);
    }
    impact
}
