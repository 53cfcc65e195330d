//! The mean cycle of the torque for the page: by the current, and as models have the current show it.

use super::recorded_worm::RecordedWorm;
use super::torque_noise::TorqueNoise;
use super::torque_residual::in_bins;
use crate::explain::answer::TorqueSeries;
use crate::explain::search::bins::Bins;
use crate::explain::search::fit::Fit;

/// One series for each run whose current counts and that the recalibrated model can make; the named model's is empty where there is none.
pub(in crate::explain) fn torque_cycles(
    worm: &RecordedWorm<'_>,
    recalibrated: &Fit,
    named: Option<&Fit>,
) -> Vec<TorqueSeries> {
    let of_run = |run: usize| {
        let (observed, bins) = (&worm.scene.observed[run], &worm.bins[run]);
        let cycles = |fit: &Fit| {
            let predicted = worm.scene.predict(run, &fit.hypothesis, &fit.at)?;
            let pairs_n_m = in_bins(observed, bins, &predicted);
            (!pairs_n_m.is_empty())
                .then(|| [0, 1].map(|of| mean_cycle(bins, &worm.torque_noise[run], |bin| pairs_n_m[bin][of])))
        };
        let [measured, modelled] = cycles(recalibrated)?;
        let named = named.and_then(cycles).map_or_else(Vec::new, |[_, named]| named);
        let seen: Vec<usize> = (0..measured.len())
            .filter(|&place| measured[place].is_finite())
            .collect();
        let at_seen = |values: &[f64]| seen.iter().filter_map(|&place| values.get(place).copied()).collect();
        Some(TorqueSeries {
            slope_deg: observed.run.slope_deg,
            phase: seen
                .iter()
                .map(|&place| (place as f64 + 0.5) / measured.len() as f64)
                .collect(),
            measured_n_m: at_seen(&measured),
            recalibrated_n_m: at_seen(&modelled),
            named_n_m: at_seen(&named),
        })
    };
    (0..worm.scene.observed.len()).filter_map(of_run).collect()
}

/// Mean at each place of the cycle of the bins that are evidence; `NaN` where none is.
fn mean_cycle(bins: &Bins, noise: &TorqueNoise, torque_n_m: impl Fn(usize) -> f64) -> Vec<f64> {
    let mut sums = vec![[0.0; 2]; bins.per_cycle() as usize];
    for bin in (0..bins.len()).filter(|&bin| noise.counts(bin)) {
        let torque_n_m = torque_n_m(bin);
        if torque_n_m.is_finite() {
            let [sum, count] = &mut sums[bins.place(bin)];
            (*sum, *count) = (*sum + torque_n_m, *count + 1.0);
        }
    }
    sums.into_iter().map(|[sum, count]| sum / count).collect()
}
