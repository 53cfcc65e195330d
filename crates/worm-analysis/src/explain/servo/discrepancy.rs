//! By how much any model of a servo is wrong, whatever is missing from it.
//!
//! What a model of motor and gears lacks drives the arm astray for some tenths of a second, and in much the same way in runs with the same
//! goals. So the residual of run r at time t holds, at the scale a,
//!
//! ```text
//! δ = a [√ρ g(t, trajectory, gain) + √(1 − ρ) h(t, r)]
//! ```
//! g and h are sums of cosines in the time of the longest run up to 3 Hz, their weights falling as those of an Ornstein-Uhlenbeck process of
//! a short correlation time: what a model lacks shows at every frequency at which the arm moves. What is faster counts as noise.
//! What the runs of a trajectory have in common varies with the logarithm of the gain, as a worm's with its slope.

use super::observed::Observed;
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::f64::consts::PI;

/// ρ: the share that runs of one trajectory have in common.
const SHARED: f64 = 0.5;
/// Covariance over the gains: constant, and proportional to the standardised logarithm.
const OVER_GAINS: [f64; 2] = [0.7, 0.3];
/// Correlation time, s. Longer ones would give fast errors too much weight, and a fit would follow those instead of the arm.
const CORRELATED_S: f64 = 0.06;
/// Cosines for each second, and most columns in all.
const COSINES_PER_S: f64 = 6.0;
const MOST_COLUMNS: usize = 900;

/// Columns of the discrepancy of some runs. `conditions` are the logarithms of their gains; `rows_of` makes rows of a run, whitened by the
/// noise, of a position in each bin, rad.
pub(super) fn columns(
    observed: &[Observed<'_>],
    conditions: &[f64],
    scale_rad: f64,
    rows_of: impl Fn(usize, &[f64]) -> Vec<f64> + Sync,
) -> DMatrix<f64> {
    let runs = observed.len();
    let trajectories = observed.iter().map(|one| one.trajectory + 1).max().unwrap_or(0);
    let longest_s = observed
        .iter()
        .map(|one| one.recording.duration_s())
        .fold(0.0, f64::max);
    let over_gains = over_gains(conditions);
    let functions = over_gains.first().map_or(1, Vec::len);
    let most = MOST_COLUMNS / (runs + functions * trajectories).max(1);
    let cosines = ((COSINES_PER_S * longest_s) as usize).clamp(4, most.max(4));
    let weights = weights(cosines, longest_s);
    // Of a trajectory with a function of the gain, or of a run.
    let shared =
        (0..trajectories).flat_map(|trajectory| (0..functions).map(move |function| (Some((trajectory, function)), 0)));
    let kinds: Vec<(Option<(usize, usize)>, usize)> = shared.chain((0..runs).map(|run| (None, run))).collect();
    let all: Vec<Vec<f64>> = kinds
        .par_iter()
        .flat_map_iter(|&(of_trajectory, of_run)| {
            let (weights, over_gains, rows_of) = (&weights, &over_gains, &rows_of);
            (0..cosines).map(move |cosine| {
                let of = |run: usize| {
                    let factor = match of_trajectory {
                        Some((trajectory, function)) if observed[run].trajectory == trajectory => {
                            SHARED.sqrt() * over_gains[run][function]
                        }
                        None if of_run == run => (1.0 - SHARED).sqrt(),
                        _ => 0.0,
                    };
                    let bins = observed[run].bins.bins.iter();
                    let pattern: Vec<f64> = bins
                        .map(|bin| {
                            let wave = (PI * cosine as f64 * bin.phase / longest_s).cos();
                            factor * scale_rad * weights[cosine] * wave
                        })
                        .collect();
                    rows_of(run, &pattern)
                };
                (0..runs).flat_map(of).collect()
            })
        })
        .collect();
    let rows = all.first().map_or(0, Vec::len);
    DMatrix::from_iterator(rows, all.len(), all.into_iter().flatten())
}

/// Standard deviations of the cosines, for a variance of 1 in all.
fn weights(cosines: usize, longest_s: f64) -> Vec<f64> {
    let weight = |m: usize| {
        (1.0 + (PI * m as f64 / longest_s * CORRELATED_S).powi(2))
            .sqrt()
            .recip()
    };
    let variance: f64 = (0..cosines)
        .map(|m| weight(m).powi(2) * if m == 0 { 1.0 } else { 0.5 })
        .sum();
    (0..cosines).map(|m| weight(m) / variance.sqrt()).collect()
}

/// Values of the functions of the gain, for its logarithm in each run; a constant alone where all runs are alike.
fn over_gains(values: &[f64]) -> Vec<Vec<f64>> {
    let runs = values.len();
    let mean = values.iter().sum::<f64>() / runs as f64;
    let spread = (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / runs as f64).sqrt();
    let of = |&value: &f64| match spread < 1e-3 {
        true => vec![1.0],
        false => vec![OVER_GAINS[0].sqrt(), OVER_GAINS[1].sqrt() * (value - mean) / spread],
    };
    values.iter().map(of).collect()
}
