//! The discrepancy: by how much the model is wrong everywhere, whatever is missing from it.
//!
//! No model is quite right, and what it lacks repeats with the phase as an effect does. So the residual holds, beside
//! noise, a smooth unknown function, which a plant gives as columns. That of a machine that does the
//! same in every cycle is (Kennedy and O'Hagan 2001, <https://doi.org/10.1111/1467-9868.00294>):
//!
//! ```text
//! δᵢ = a [√ρ g(i − s, u, λ) + √(1 − ρ) h(s, i, u, λ)] + a (c + φ) ψ(λ)
//! ```
//! for channel i while channel s leads, at phase u of the step, c whole cycles after the start, under condition λ; for a worm, cell i
//! while cell s steps, at a slope. The part g depends on how far a channel is from the one that leads, so that a law which is wrong in
//! every pad of a worm alike lies in it; h is every channel's own. Both are sums of cos πmu, m = 0, 1, …, of standard deviation
//! (1 + m/2)⁻², with a covariance over the conditions of 0.7 + 0.3 x x′, x the standardised condition. A slow part of 0.3 a varies over
//! the run. The ramp ψ lets a worm's advance be wrong.
//!
//! # How it enters the likelihood
//! It is linear in normal coefficients, so it is marginalised exactly: with Φ the whitened columns at the scale a₀, and ΦΦᵀ = Q Λ Qᵀ,
//! the residual has covariance 1 + κ² Q Λ Qᵀ at a = κ a₀. [`Discrepancy::whiten`] applies the inverse root for κ = 1, and every fit,
//! score and held-out likelihood is taken of that. Other scales follow from the products with Q.

use super::bins::Bins;
use crate::least_squares::{cross, dot};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::f64::consts::PI;

/// ρ: the share of what all channels have in common by their role.
pub(in crate::explain) const SHARED: f64 = 0.8;
/// Most cosines in a step, and most columns that each channel's own part may have: fewer cosines for many channels.
const COSINES: usize = 8;
const OWN_COLUMNS: usize = 512;
/// Covariance over the conditions: constant, and proportional to the standardised one.
const OVER_CONDITIONS: [f64; 2] = [0.7, 0.3];
/// Scale of the slow part over a, its waves over the run with their weights, and its cosines in a step.
pub(in crate::explain) const SLOW: f64 = 0.3;
pub(in crate::explain) const WAVES: [f64; 2] = [0.85, 0.5];
const SLOW_COSINES: usize = 3;
/// Rows and directions that one thread takes at once.
const ROWS_AT_ONCE: usize = 8192;
const DIRECTIONS_AT_ONCE: usize = 24;
/// Strength of a direction at a₀, in variances of the noise, below which it is left out.
const NEGLIGIBLE: f64 = 0.02;

/// The discrepancy of a campaign.
#[derive(Debug, Clone)]
pub(in crate::explain) struct Discrepancy {
    /// Q: orthonormal directions, a column each.
    directions: DMatrix<f64>,
    /// Λ: the variance along each at a₀, in variances of the noise.
    strengths: Vec<f64>,
    /// a₀, m.
    pub scale_m: f64,
}

impl Discrepancy {
    /// The discrepancy whose standard deviation a₀ is `scale_m`, by its columns at that scale, whitened by the noise.
    pub fn new(columns: DMatrix<f64>, scale_m: f64) -> Self {
        let gram = cross(&columns, &columns);
        let eigen = gram.symmetric_eigen();
        let kept: Vec<usize> = (0..eigen.eigenvalues.len())
            .filter(|&at| eigen.eigenvalues[at] > NEGLIGIBLE)
            .collect();
        let turned = DMatrix::from_fn(eigen.eigenvectors.nrows(), kept.len(), |row, column| {
            eigen.eigenvectors[(row, kept[column])] / eigen.eigenvalues[kept[column]].sqrt()
        });
        Self {
            directions: columns * turned,
            strengths: kept.iter().map(|&at| eigen.eigenvalues[at]).collect(),
            scale_m,
        }
    }

    /// None at all, of so many rows.
    #[cfg(test)]
    pub fn none(rows: usize) -> Self {
        Self {
            directions: DMatrix::zeros(rows, 0),
            strengths: Vec::new(),
            scale_m: 0.0,
        }
    }

    /// Whitens residuals: covariance 1 + Q Λ Qᵀ becomes 1.
    pub fn whiten(&self, rows: &mut [f64]) {
        let mut along = self.products(rows);
        for (along, strength) in along.iter_mut().zip(&self.strengths) {
            *along *= (1.0 + strength).sqrt().recip() - 1.0;
        }
        let of_chunk = |(number, rows): (usize, &mut [f64])| {
            let from = number * ROWS_AT_ONCE;
            for (direction, along) in self.directions.column_iter().zip(&along) {
                let direction = &direction.as_slice()[from..from + rows.len()];
                for (row, direction) in rows.iter_mut().zip(direction) {
                    *row += along * direction;
                }
            }
        };
        rows.par_chunks_mut(ROWS_AT_ONCE).enumerate().for_each(of_chunk);
    }

    /// Whitens columns of rows, all at once.
    pub fn whiten_columns(&self, columns: &mut DMatrix<f64>) {
        let mut along = cross(&self.directions, columns);
        for (mut row, strength) in along.row_iter_mut().zip(&self.strengths) {
            row *= (1.0 + strength).sqrt().recip() - 1.0;
        }
        columns.gemm(1.0, &self.directions, &along, 1.0);
    }

    /// Products of rows with every direction.
    pub fn products(&self, rows: &[f64]) -> DVector<f64> {
        let count = self.directions.ncols();
        let along = |number: usize| dot(self.directions.column(number).as_slice(), rows, None);
        let products = (0..count).into_par_iter().with_min_len(DIRECTIONS_AT_ONCE).map(along);
        DVector::from_vec(products.collect())
    }

    /// How much of the square of rows, whitened by the noise alone, is along the directions beyond what noise puts there; 0 or more.
    pub fn beyond_noise(&self, rows: &[f64]) -> f64 {
        let products = self.products(rows);
        (products.norm_squared() - products.len() as f64).max(0.0)
    }

    /// Products of columns of rows with every direction.
    pub fn products_of(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        cross(&self.directions, columns)
    }

    /// For each direction, what whitening at κ a₀ does to the square of a component that was whitened at a₀.
    pub fn factors(&self, kappa: f64) -> Vec<f64> {
        let strengths = self.strengths.iter();
        strengths
            .map(|strength| (1.0 + strength) / (1.0 + kappa * kappa * strength))
            .collect()
    }

    /// Logarithm of the determinant of the covariance at κ a₀.
    pub fn ln_det(&self, kappa: f64) -> f64 {
        self.strengths
            .iter()
            .map(|strength| (kappa * kappa * strength).ln_1p())
            .sum()
    }
}

/// A function of run, bin and channel.
enum Column {
    /// Channels at this distance from the leading one: cosine, function of the condition.
    Role(usize, usize, usize),
    /// One channel while one leads: cosine, function of the condition.
    Own(usize, usize, usize, usize),
    /// As a role, times a wave over the run.
    Slow(usize, usize, usize, usize),
    /// All channels together, growing with every cycle.
    Ramp(usize),
}

/// Columns of a machine that does the same in every cycle. `bins` and `conditions` are those of every run; `rows_of` makes rows of a run,
/// whitened by the noise, of a pattern `[bin][channel]`, flat.
pub(in crate::explain) fn repeating_columns(
    channels: usize,
    bins: &[&Bins],
    conditions: &[f64],
    scale_m: f64,
    rows_of: impl Fn(usize, &[f64]) -> Vec<f64> + Sync,
) -> DMatrix<f64> {
    let over_conditions = over_conditions(conditions);
    let functions = over_conditions.first().map_or(0, Vec::len);
    let cosines = (OWN_COLUMNS / (channels * channels * functions.max(1))).clamp(1, COSINES);
    let weights = weights(cosines);
    let mut kinds = Vec::new();
    for function in 0..functions {
        for cosine in 0..cosines {
            for role in 0..channels {
                kinds.push(Column::Role(role, cosine, function));
            }
            for leading in 0..channels {
                kinds.extend((0..channels).map(|channel| Column::Own(leading, channel, cosine, function)));
            }
        }
        for cosine in 0..cosines.min(SLOW_COSINES) {
            for wave in 0..WAVES.len() {
                kinds.extend((0..channels).map(|role| Column::Slow(role, cosine, function, wave)));
            }
        }
        kinds.push(Column::Ramp(function));
    }
    let rows: Vec<Vec<f64>> = kinds
        .par_iter()
        .map(|kind| {
            let runs = bins.iter().enumerate();
            runs.flat_map(|(run, bins)| {
                let (first, last) = (
                    bins.bins.first().map_or(0.0, |bin| bin.phase),
                    bins.bins.last().map_or(1.0, |bin| bin.phase),
                );
                let mut pattern = vec![0.0; bins.len() * channels];
                for (bin, pattern) in bins.bins.iter().zip(pattern.chunks_exact_mut(channels)) {
                    let cosine = |m: usize| weights[m] * (PI * m as f64 * bin.of_step).cos();
                    let role_of = |role: usize| (bin.leading + role) % channels;
                    match *kind {
                        Column::Role(role, m, function) => {
                            pattern[role_of(role)] = SHARED.sqrt() * cosine(m) * over_conditions[run][function];
                        }
                        Column::Own(leading, channel, m, function) if bin.leading == leading => {
                            pattern[channel] = (1.0 - SHARED).sqrt() * cosine(m) * over_conditions[run][function];
                        }
                        Column::Own(..) => {}
                        Column::Slow(role, m, function, wave) => {
                            let of_run = (bin.phase - first) / (last - first).max(1.0);
                            let wave_here = WAVES[wave] * (PI * (wave + 1) as f64 * of_run).cos();
                            pattern[role_of(role)] = SLOW * cosine(m) * wave_here * over_conditions[run][function];
                        }
                        Column::Ramp(function) => pattern.fill((bin.phase - first) * over_conditions[run][function]),
                    }
                }
                pattern.iter_mut().for_each(|m| *m *= scale_m);
                rows_of(run, &pattern)
            })
            .collect()
        })
        .collect();
    let count = rows.first().map_or(0, Vec::len);
    DMatrix::from_iterator(count, rows.len(), rows.into_iter().flatten())
}

/// Standard deviations of the cosines, for a variance of 1 in all: the mean square of cos πmu is a half but for m = 0.
pub(in crate::explain) fn weights(cosines: usize) -> Vec<f64> {
    let weight = |m: usize| (1.0 + 0.5 * m as f64).powi(-2);
    let variance: f64 = (0..cosines)
        .map(|m| weight(m).powi(2) * if m == 0 { 1.0 } else { 0.5 })
        .sum();
    (0..cosines).map(|m| weight(m) / variance.sqrt()).collect()
}

/// Values of the functions of the condition, for the condition of each run; a constant alone where all runs are alike.
pub(in crate::explain) fn over_conditions(values: &[f64]) -> Vec<Vec<f64>> {
    let runs = values.len() as f64;
    let mean = values.iter().sum::<f64>() / runs;
    let spread = (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / runs).sqrt();
    let of = |&value: &f64| {
        if spread < 1e-3 {
            return vec![1.0];
        }
        vec![
            OVER_CONDITIONS[0].sqrt(),
            OVER_CONDITIONS[1].sqrt() * (value - mean) / spread,
        ]
    };
    values.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explain::fixture::{Campaign, hypothesis, record, worm};
    use crate::explain::search::plant::Recorded;
    use crate::least_squares::dot;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// Rows of a discrepancy of the scale, drawn, under noise of variance 1.
    fn drawn(discrepancy: &Discrepancy, rows: usize, seed: u64) -> Vec<f64> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut drawn: Vec<f64> = (0..rows).map(|_| normal()).collect();
        for (direction, strength) in discrepancy.directions.column_iter().zip(&discrepancy.strengths) {
            let along = strength.sqrt() * normal();
            drawn
                .iter_mut()
                .zip(direction.iter())
                .for_each(|(row, one)| *row += along * one);
        }
        drawn
    }

    #[test]
    fn whitened_rows_have_the_variance_of_noise_along_every_direction() {
        let campaign = Campaign {
            slopes_deg: vec![20.0],
            ..Campaign::default()
        };
        let recordings = record(&campaign, None, 1);
        let worm = worm(&recordings, &campaign, &hypothesis(None));
        let discrepancy = Discrepancy::new(worm.discrepancy_columns(1e-5), 1e-5);
        let rows = discrepancy.directions.nrows();
        assert!(
            discrepancy.strengths.iter().any(|strength| *strength > 10.0),
            "it can be seen"
        );
        let (mut before, mut after) = (0.0, 0.0);
        let draws = 10;
        for seed in 0..draws {
            let mut data = drawn(&discrepancy, rows, seed);
            before += discrepancy.products(&data).norm_squared();
            discrepancy.whiten(&mut data);
            after += discrepancy.products(&data).norm_squared();
        }
        let directions = discrepancy.strengths.len() as f64 * draws as f64;
        assert!(before > 1.5 * directions, "{before} of {directions}");
        assert!((after / directions - 1.0).abs() < 0.1, "{after} of {directions}");
        let mut far = vec![0.0; rows];
        far[0] = 1.0;
        let along = discrepancy.products(&far);
        let mut whitened = far.clone();
        discrepancy.whiten(&mut whitened);
        let expected = 1.0
            - along
                .iter()
                .zip(&discrepancy.strengths)
                .map(|(along, strength)| along * along * strength / (1.0 + strength))
                .sum::<f64>();
        assert!((dot(&whitened, &whitened, None) - expected).abs() < 1e-9);
        assert!(
            discrepancy
                .factors(1.0)
                .iter()
                .all(|factor| (factor - 1.0).abs() < 1e-12)
        );
        assert!(discrepancy.ln_det(2.0) > discrepancy.ln_det(1.0));
    }
}
