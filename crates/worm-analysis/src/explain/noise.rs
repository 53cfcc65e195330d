//! The noise floor: how well the worm repeats its own cycles.
//!
//! What remains of a run once its mean cycle (and an even trend of it over the cycles) is taken out is noise by any model's
//! measure: camera noise, in part correlated from sample to sample, and a random walk of the body, since every step is a little
//! different from the last. Both are measured here, after a *free form* (one value for each phase bin) took out whatever any
//! model could explain, so a missing effect does not count as noise. Correlation is allowed for by the variance of sums over a step:
//! where sums vary more than independent samples would, all weights are smaller by that.

use super::observed::Observed;
use super::residual::Residual;
use crate::identify::drift::Drift;

/// Phase bins of a step in the free form.
pub(super) const BINS_PER_STEP: usize = 12;
/// Cycles from which the free form has a trend.
const TREND_CYCLES: usize = 5;
/// Drifts that are tried, as standard deviations after one cycle, m: from `.0` on, each `.1` times the one before.
const DRIFTS: (f64, f64, usize) = (1e-6, 1.5, 20);

/// The noise of one run.
#[derive(Debug, Clone)]
pub(super) struct RunNoise {
    pub drift: Drift,
    /// Variance of one position, m².
    position_m2: f64,
    /// The same for the settled crawl alone.
    settled: Drift,
    /// What a whitened surprise of the body is multiplied with for correlation.
    pub body_scale: f64,
    /// One over the standard deviation of a cell's relative position, correlation counted, 1/m.
    pub relative_scale: f64,
    /// Quantities in the free form.
    pub free_quantities: f64,
}

impl RunNoise {
    /// The noise of a run by what some hypothesis leaves of it.
    pub fn measure(observed: &Observed<'_>, residual: &Residual) -> Self {
        let free = free_form(observed, residual);
        let cells = observed.cells();
        let from = observed.settled_from();
        let cycles = observed.whole_cycles() as f64;
        let terms = if observed.whole_cycles() >= TREND_CYCLES {
            2.0
        } else {
            1.0
        };
        let lost = cycles / (cycles - terms).max(1.0); // variance that the free form took with it
        let (mut squares, mut equations) = (0.0, 0.0);
        for sample in from..observed.samples() {
            let row = &free.relative_m[sample * cells..(sample + 1) * cells];
            let seen = row.iter().filter(|relative_m| relative_m.is_finite()).count() as f64;
            if seen > 1.0 {
                squares += row.iter().filter(|m| m.is_finite()).map(|m| m * m).sum::<f64>();
                equations += seen - 1.0;
            }
        }
        let position_m2 = (lost * squares / f64::max(equations, 1.0)).max(1e-14);
        let variance_m2 = |counts_from: usize| -> Vec<f64> {
            let of = |sample: usize| {
                let stepping = observed.stepping(sample);
                let seen = (0..cells)
                    .filter(|&cell| observed.position_m[cell][sample].is_finite())
                    .filter(|&cell| observed.phase_recorded || cell != stepping)
                    .count();
                if seen == 0 || sample < counts_from {
                    f64::INFINITY
                } else {
                    position_m2 / seen as f64
                }
            };
            (0..observed.samples()).map(of).collect()
        };
        let shrunk_m2: Vec<f64> = variance_m2(from).iter().map(|m2| m2 / lost).collect();
        let likeliest_m = (0..DRIFTS.2)
            .map(|at| DRIFTS.0 * DRIFTS.1.powi(at as i32))
            .map(|per_cycle_m| {
                let drift = Drift::new(&observed.phase, &shrunk_m2, per_cycle_m * per_cycle_m);
                (drift.chi_squared(free.body_m.iter().copied()), per_cycle_m)
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map_or(DRIFTS.0, |best| best.1);
        let drift_m2 = lost * likeliest_m * likeliest_m;
        let settled = Drift::new(&observed.phase, &variance_m2(from), drift_m2);
        let samples_per_step = (observed.samples() as f64
            / ((observed.phase[observed.samples() - 1] - observed.phase[0]) * cells as f64))
            .round()
            .max(2.0) as usize;
        let mut whitened_residuals = Vec::with_capacity(observed.samples());
        settled.whiten(free.body_m.iter().copied(), |whitened_residual| {
            whitened_residuals.push(whitened_residual)
        });
        let body_scale = 1.0
            / (lost * sum_variance(&whitened_residuals[from..], samples_per_step))
                .max(1.0)
                .sqrt();
        let along: f64 = (0..cells)
            .map(|cell| {
                let series: Vec<f64> = (from..observed.samples())
                    .map(|sample| free.relative_m[sample * cells + cell])
                    .filter(|relative_m| relative_m.is_finite())
                    .map(|relative_m| relative_m / (position_m2 / lost).sqrt())
                    .collect();
                sum_variance(&series, samples_per_step)
            })
            .sum::<f64>()
            / cells as f64;
        Self {
            drift: Drift::new(&observed.phase, &variance_m2(observed.counts_from), drift_m2),
            position_m2,
            settled,
            body_scale,
            relative_scale: 1.0 / (position_m2 * along.max(1.0)).sqrt(),
            // Each counts as much as its share of the misfit: the weights are smaller where noise is correlated.
            free_quantities: terms
                * (BINS_PER_STEP * cells) as f64
                * (body_scale.powi(2) + (cells as f64 - 1.0) / along.max(1.0)),
        }
    }

    /// The noise of another run of the same worm before the same camera, which keeps one sample in `thinned` and sees every cell.
    pub fn of_another(&self, observed: &Observed<'_>, thinned: f64) -> Self {
        let variance_m2: Vec<f64> = (0..observed.samples())
            .map(|sample| {
                let seen = observed.cells() as f64 - if observed.phase_recorded { 0.0 } else { 1.0 };
                if sample < observed.counts_from {
                    f64::INFINITY
                } else {
                    self.position_m2 / thinned / seen
                }
            })
            .collect();
        let drift = Drift::new(&observed.phase, &variance_m2, self.drift.per_cycle_m2());
        Self {
            settled: drift.clone(),
            drift,
            position_m2: self.position_m2 / thinned,
            body_scale: self.body_scale,
            relative_scale: self.relative_scale * thinned.sqrt(),
            free_quantities: 0.0,
        }
    }

    /// How much of the misfit of a residual a free form would take away beyond chance.
    pub fn explainable(&self, observed: &Observed<'_>, residual: &Residual) -> f64 {
        let from = observed.settled_from() * observed.cells();
        let chi_squared = |residual: &Residual| {
            let mut squares = 0.0;
            self.settled
                .whiten(residual.body_m.iter().copied(), |whitened_residual| {
                    squares += whitened_residual * whitened_residual
                });
            let relative = residual.relative_m[from..]
                .iter()
                .filter(|relative_m| relative_m.is_finite());
            let relative_squares: f64 = relative.map(|relative_m| relative_m * relative_m).sum();
            squares * self.body_scale.powi(2) + relative_squares * self.relative_scale.powi(2)
        };
        chi_squared(residual) - chi_squared(&free_form(observed, residual)) - self.free_quantities
    }

    /// Appends the whitened residuals of a run, each of variance 1 where the hypothesis holds: for every sample that counts the
    /// body's, then for every sample each cell's.
    pub fn whiten(&self, observed: &Observed<'_>, residual: &Residual, out: &mut Vec<f64>) {
        let from = observed.counts_from;
        let mut at = 0;
        self.drift.whiten(residual.body_m.iter().copied(), |whitened_residual| {
            if at >= from {
                out.push(whitened_residual * self.body_scale);
            }
            at += 1;
        });
        let cells = observed.cells();
        out.extend(residual.relative_m[from * cells..].iter().map(|relative_m| {
            if relative_m.is_nan() {
                0.0
            } else {
                relative_m * self.relative_scale
            }
        }));
    }

    /// Standard deviation that the body's random walk gathers in a cycle, m.
    pub fn drift_per_cycle_m(&self) -> f64 {
        self.drift.per_cycle_m2().sqrt()
    }
}

/// Variance of sums over `length` values, over that of as many independent values of variance 1.
fn sum_variance(series: &[f64], length: usize) -> f64 {
    let sums = series.chunks_exact(length).map(|chunk| chunk.iter().sum::<f64>());
    let (mut squares, mut count) = (0.0, 0.0);
    for sum in sums {
        squares += sum * sum;
        count += 1.0;
    }
    if count > 0.0 {
        squares / (count * length as f64)
    } else {
        1.0
    }
}

/// Which phase bin a sample is in, counted through from phase 0.
pub(super) fn bin_of(observed: &Observed<'_>, sample: usize, bins_per_step: usize) -> i64 {
    (observed.phase[sample] * (observed.cells() * bins_per_step) as f64).floor() as i64
}

/// What is left when each phase bin may have a way of its own, with an even trend over the cycles.
fn free_form(observed: &Observed<'_>, residual: &Residual) -> Residual {
    let cells = observed.cells();
    let mut free = Residual {
        body_m: flatten(observed, residual.body_m.clone(), true),
        relative_m: residual.relative_m.clone(),
    };
    for cell in 0..cells {
        let series: Vec<f64> = residual.relative_m.iter().skip(cell).step_by(cells).copied().collect();
        for (sample, value) in flatten(observed, series, false).into_iter().enumerate() {
            free.relative_m[sample * cells + cell] = value;
        }
    }
    free
}

/// Takes the mean cycle and its trend out of a series: of its increments from bin to bin where it runs on, else of its values.
fn flatten(observed: &Observed<'_>, series: Vec<f64>, runs_on: bool) -> Vec<f64> {
    let per_cycle = (observed.cells() * BINS_PER_STEP) as i64;
    let from = observed.settled_from();
    let first_bin = bin_of(observed, from, BINS_PER_STEP);
    let bins = (bin_of(observed, observed.samples() - 1, BINS_PER_STEP) - first_bin + 1).max(1) as usize;
    let (mut sum, mut count, mut phase) = (vec![0.0; bins], vec![0.0; bins], vec![0.0; bins]);
    for (sample, value) in series.iter().enumerate().skip(from) {
        if value.is_finite() {
            let bin = (bin_of(observed, sample, BINS_PER_STEP) - first_bin) as usize;
            sum[bin] += value;
            phase[bin] += observed.phase[sample];
            count[bin] += 1.0;
        }
    }
    let mean: Vec<f64> = sum.iter().zip(&count).map(|(sum, count)| sum / count).collect();
    let value: Vec<f64> = if runs_on {
        (0..bins)
            .map(|bin| if bin == 0 { 0.0 } else { mean[bin] - mean[bin - 1] })
            .collect()
    } else {
        mean.clone()
    };
    // A straight line over the cycles for each bin of the cycle.
    let mut shape = vec![0.0; bins];
    for place in 0..per_cycle {
        let mine: Vec<usize> = (0..bins)
            .filter(|&bin| (first_bin + bin as i64).rem_euclid(per_cycle) == place)
            .filter(|&bin| value[bin].is_finite() && !(runs_on && bin == 0))
            .collect();
        if mine.is_empty() {
            continue;
        }
        let n = mine.len() as f64;
        let middle = mine.iter().map(|&bin| bin as f64).sum::<f64>() / n;
        let level = mine.iter().map(|&bin| value[bin]).sum::<f64>() / n;
        let spread: f64 = mine.iter().map(|&bin| (bin as f64 - middle).powi(2)).sum();
        let slope = if mine.len() >= TREND_CYCLES {
            mine.iter().map(|&bin| (bin as f64 - middle) * value[bin]).sum::<f64>() / spread
        } else {
            0.0
        };
        for bin in (0..bins).filter(|&bin| (first_bin + bin as i64).rem_euclid(per_cycle) == place) {
            shape[bin] = level + slope * (bin as f64 - middle);
        }
    }
    if runs_on {
        for bin in 1..bins {
            shape[bin] += shape[bin - 1];
        }
    }
    // Between the middles of bins in straight lines.
    let middles: Vec<f64> = (0..bins)
        .map(|bin| {
            if count[bin] > 0.0 {
                phase[bin] / count[bin]
            } else {
                (first_bin as f64 + bin as f64 + 0.5) / per_cycle as f64
            }
        })
        .collect();
    let mut flat = series;
    for (sample, value) in flat.iter_mut().enumerate().skip(from) {
        let bin = (bin_of(observed, sample, BINS_PER_STEP) - first_bin) as usize;
        let here = observed.phase[sample];
        let other = if here < middles[bin] {
            bin.saturating_sub(1)
        } else {
            (bin + 1).min(bins - 1)
        };
        let fraction = if other == bin || middles[other] == middles[bin] {
            0.0
        } else {
            (here - middles[bin]) / (middles[other] - middles[bin])
        };
        let between = if runs_on {
            shape[bin] + fraction * (shape[other] - shape[bin])
        } else {
            shape[bin]
        };
        *value -= between;
    }
    flat[..from].fill(0.0);
    flat
}
