//! The mean cycle of each run for the page: measured, and by the models at the same samples.

use crate::explain::answer::CycleSeries;
use crate::explain::search::fit::Fit;
use crate::explain::worm::observed::Observed;
use crate::explain::worm::predicted::Predicted;
use crate::explain::worm::recorded_worm::RecordedWorm;
use crate::explain::worm::residual::Residual;

/// Bins of a cycle, about.
const BINS: usize = 72;

/// Each run's displacement of the body within a cycle: measured, and by the nominal, the recalibrated and the named model. A model that
/// cannot make a run has no series there; phases that no cycle shows are left out.
pub(in crate::explain) fn cycles(
    worm: &RecordedWorm<'_>,
    baseline: &Fit,
    recalibrated: &Fit,
    named: Option<&Fit>,
) -> Vec<CycleSeries> {
    let of_run = |run: usize| {
        let observed = &worm.scene.observed[run];
        let stroke_m = worm.scene.nominal[run].worm.stroke_m();
        let predict = |fit: &Fit| worm.scene.predict(run, &fit.hypothesis, &fit.at);
        let bins = bins(observed);
        let mut series = CycleSeries {
            slope_deg: observed.run.slope_deg,
            ..CycleSeries::default()
        };
        let Some(by_recalibrated) = predict(recalibrated) else {
            return series;
        };
        // A lost marker would shift the mean of the cells, so the measured series is a model plus its residual, which accounts for that.
        let left_m = Residual::new(observed, &by_recalibrated).body_m;
        let modelled_m = mean_of_cells_m(observed, &by_recalibrated);
        let measured_m: Vec<f64> = modelled_m.iter().zip(&left_m).map(|(m, left_m)| m + left_m).collect();
        let fold = |displacement_m: &[f64]| Folded::new(observed, displacement_m, stroke_m, bins);
        let fold_model = |fit: Option<&Fit>| {
            let predicted = fit.and_then(predict);
            predicted.map(|predicted| fold(&mean_of_cells_m(observed, &predicted)))
        };
        let measured = fold(&measured_m);
        let seen: Vec<usize> = (0..bins).filter(|&bin| measured.mean_m[bin].is_finite()).collect();
        let at_seen = |values: &[f64]| seen.iter().map(|&bin| values[bin]).collect::<Vec<f64>>();
        let model = |folded: Option<Folded>| folded.map_or_else(Vec::new, |folded| at_seen(&folded.mean_m));
        series.phase = seen.iter().map(|&bin| (bin as f64 + 0.5) / bins as f64).collect();
        series.measured_m = at_seen(&measured.mean_m);
        series.scatter_m = at_seen(&measured.scatter_m);
        series.recalibrated_m = at_seen(&fold(&modelled_m).mean_m);
        series.baseline_m = model(fold_model(Some(baseline)));
        series.named_m = model(fold_model(named));
        series
    };
    (0..worm.scene.observed.len()).map(of_run).collect()
}

/// Number of bins: as many for each step as there are samples for.
fn bins(observed: &Observed<'_>) -> usize {
    let cells = observed.cells();
    let steps = (observed.phase[observed.samples() - 1] - observed.phase[0]) * cells as f64;
    let samples_per_step = observed.samples() as f64 / steps;
    cells * (BINS / cells).min(samples_per_step as usize).max(1)
}

fn mean_of_cells_m(observed: &Observed<'_>, predicted: &Predicted) -> Vec<f64> {
    let cells = observed.cells();
    let samples = predicted.position_m.chunks_exact(cells);
    samples.map(|at_m| at_m.iter().sum::<f64>() / cells as f64).collect()
}

/// A displacement folded into one gait cycle.
struct Folded {
    /// Since the start of the cycle, less the stroke's share, m; `NaN` where no cycle saw the bin.
    mean_m: Vec<f64>,
    /// Standard deviation over the cycles, m; 0 where only one saw the bin.
    scatter_m: Vec<f64>,
}

impl Folded {
    fn new(observed: &Observed<'_>, displacement_m: &[f64], stroke_m: f64, bins: usize) -> Self {
        let last = observed.samples() - 1;
        let from = observed.settled_from().min(last);
        let in_bins = |sample: usize| observed.phase[sample] * bins as f64;
        let first = in_bins(from).floor() as i64;
        let count = (in_bins(last).floor() as i64 - first + 1).max(1) as usize;
        let (mut sum_m, mut seen) = (vec![0.0; count], vec![0.0; count]);
        for (sample, &displacement_m) in displacement_m.iter().enumerate().take(last + 1).skip(from) {
            let bin = usize::try_from(in_bins(sample).floor() as i64 - first)
                .unwrap_or(0)
                .min(count - 1);
            if displacement_m.is_finite() {
                sum_m[bin] += displacement_m - stroke_m * observed.phase[sample];
                seen[bin] += 1.0;
            }
        }
        let at_m: Vec<f64> = sum_m.iter().zip(&seen).map(|(sum_m, seen)| sum_m / seen).collect();
        let mut displacements_m: Vec<Vec<f64>> = vec![Vec::new(); bins];
        let mut start = (-first).rem_euclid(bins as i64) as usize;
        while start + bins <= count {
            // The cycle starts between two bins; the crawl's first has none before it.
            let edge_m = if start == 0 || !at_m[start - 1].is_finite() {
                at_m[start]
            } else {
                0.5 * (at_m[start - 1] + at_m[start])
            };
            for (bin, displacements_m) in displacements_m.iter_mut().enumerate() {
                let displacement_m = at_m[start + bin] - edge_m;
                if displacement_m.is_finite() {
                    displacements_m.push(displacement_m);
                }
            }
            start += bins;
        }
        let mean = |values: &Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
        Self {
            scatter_m: displacements_m
                .iter()
                .map(|values| {
                    let mean_m = mean(values);
                    let squares: f64 = values.iter().map(|value| (value - mean_m).powi(2)).sum();
                    (squares / (values.len() as f64 - 1.0).max(1.0)).sqrt()
                })
                .collect(),
            mean_m: displacements_m.iter().map(mean).collect(),
        }
    }
}
