//! Whether an effect changes what anybody asks: the advance, the energy, or where the cells are within a cycle.
//!
//! The run is simulated with the effect and without it, all else alike. An effect counts where its change of the advance or of the
//! energy of a cycle is beyond a fraction of them, or its change of the positions beyond the noise of one of them. The last limit is for
//! effects such as a latency that moves neither. How sure that is follows from the standard error of the severity, in proportion.

use super::fit::{Fit, FitProblem};
use super::gap::energy_per_cycle_j;
use super::normal_probability::normal_probability;
use super::parameter::What;

/// What an effect changes, each over its limit: above 1 it matters.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Impact {
    pub advance: f64,
    pub energy: f64,
    pub position: f64,
}

/// The impact of the effect in some place of a fitted hypothesis; `limit` is the relative change of advance and energy that matters.
pub(super) fn impact(problem: &FitProblem<'_, '_>, fit: &Fit, place: usize, limit: f64) -> Impact {
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
    let runs = problem.scene.observed.iter().enumerate();
    let (fit, without) = (
        &problem.evaluate(&hypothesis, fit.at.clone()),
        problem.evaluate(&hypothesis, without_at),
    );
    let mut impact = Impact::default();
    let acts_in = |run: usize| onset.is_none_or(|onset| onset.acts_at_start(run) || onset.acts_at_end(run));
    for (run, observed) in runs.filter(|(run, _)| acts_in(*run)) {
        let predict = |fit: &Fit| problem.scene.predict(run, &fit.hypothesis, &fit.at);
        let (Some(on), Some(off)) = (predict(fit), predict(&without)) else {
            continue;
        };
        let (on_m, off_m) = (on.advance_m(observed), off.advance_m(observed));
        let stroke_m = problem.scene.nominal[run].worm.stroke_m();
        let of_advance = (on_m - off_m).abs() / off_m.abs().max(0.25 * stroke_m) / limit;
        impact.advance = impact.advance.max(of_advance);
        let energies_j = (
            energy_per_cycle_j(problem, run, fit),
            energy_per_cycle_j(problem, run, &without),
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

impl Impact {
    /// Probability that it is beyond a limit, by the severity's change from neutral and its standard error.
    pub fn matters(&self, change: f64, sigma: f64) -> f64 {
        let largest = self.advance.max(self.energy).max(self.position);
        if largest <= 1.0 || !sigma.is_finite() {
            return 0.0;
        }
        let limit = change.abs() / largest;
        normal_probability((change.abs() - limit) / sigma)
    }
}
