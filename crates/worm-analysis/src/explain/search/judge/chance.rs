//! How large the evidence for the best of the library becomes where there is none of it.
//!
//! The data of a machine without an effect are drawn many times: nuisances, discrepancy (its scale by its posterior) and noise. The search
//! sees data by their scores alone, the products with the directions of all effects, and those are jointly normal with a covariance
//! that is known; so the scores are drawn and not the data. What the largest log odds, and the largest improvement, stay below in all
//! but a given fraction of the draws is the threshold. It belongs to this campaign: more runs, noise or hypotheses change it.

use super::super::discrepancy::Discrepancy;
use super::evidence::USUAL;
use crate::least_squares::cross;
use nalgebra::DMatrix;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Draws of the data.
const DRAWS: usize = 4000;
/// Error of a product of directions, as a fraction of their squares.
const ROUNDING: f64 = 1e-5;
/// Draws that are multiplied at once.
const AT_ONCE: usize = 250;

/// The largest log odds and the largest improvement in each draw, sorted.
#[derive(Debug, Clone, Default)]
pub(in crate::explain) struct Chance {
    ln_odds: Vec<f64>,
    improvement: Vec<f64>,
}

impl Chance {
    /// Draws scores: `products` are those of the directions with each other, everything that is free projected out, `along` their
    /// products with those of the discrepancy; `scales` are the probabilities of the discrepancy's scales. `largest` gives the largest
    /// log odds and improvement for some scores.
    pub fn draw(
        discrepancy: &Discrepancy,
        products: &DMatrix<f64>,
        along: &DMatrix<f64>,
        scales: [f64; 4],
        seed: u64,
        largest: impl Fn(&[f64]) -> (f64, f64),
    ) -> Self {
        let count = products.nrows();
        if count == 0 {
            return Self::default();
        }
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut all = Self::default();
        for ((kappa, _), scale) in USUAL.into_iter().zip(scales) {
            let draws = (scale * DRAWS as f64).round() as usize;
            if draws == 0 {
                continue;
            }
            // Whitened at a₀, a discrepancy of another scale has another variance along its directions.
            let mut scaled = along.clone();
            for (mut row, factor) in scaled.row_iter_mut().zip(discrepancy.factors(kappa)) {
                row *= factor.recip() - 1.0;
            }
            let mut covariance = products + cross(along, &scaled);
            for entry in 0..count {
                covariance[(entry, entry)] += 1e-9 + ROUNDING * products[(entry, entry)];
            }
            let Some(factor) = covariance.cholesky() else {
                continue;
            };
            let lower = factor.unpack();
            for from in (0..draws).step_by(AT_ONCE) {
                let some = AT_ONCE.min(draws - from);
                let normal = DMatrix::from_fn(count, some, |_, _| StandardNormal.sample(&mut rng));
                for scores in (&lower * normal).column_iter() {
                    let (ln_odds, improvement) = largest(scores.as_slice());
                    all.ln_odds.push(ln_odds);
                    all.improvement.push(improvement);
                }
            }
        }
        all.ln_odds.sort_by(f64::total_cmp);
        all.improvement.sort_by(f64::total_cmp);
        all
    }

    /// What the largest log odds stay below, but for a fraction of the draws.
    pub fn ln_odds(&self, fraction: f64) -> f64 {
        quantile(&self.ln_odds, fraction)
    }

    /// What the largest improvement stays below, but for a fraction of the draws.
    pub fn improvement(&self, fraction: f64) -> f64 {
        quantile(&self.improvement, fraction)
    }
}

/// Minus infinity of nothing: nothing was tried.
fn quantile(sorted: &[f64], fraction: f64) -> f64 {
    let at = ((1.0 - fraction) * (sorted.len().max(1) - 1) as f64).round() as usize;
    sorted.get(at).copied().unwrap_or(f64::NEG_INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(products: DMatrix<f64>, seed: u64) -> Chance {
        let along = DMatrix::zeros(0, products.nrows());
        let squares: Vec<f64> = (0..products.nrows()).map(|at| products[(at, at)]).collect();
        let largest = |scores: &[f64]| {
            let each = scores
                .iter()
                .zip(&squares)
                .map(|(score, square)| score.max(0.0).powi(2) / square);
            let max = each.fold(0.0, f64::max);
            (max, max)
        };
        Chance::draw(
            &Discrepancy::none(0),
            &products,
            &along,
            [0.0, 1.0, 0.0, 0.0],
            seed,
            largest,
        )
    }

    /// A standard normal quantity exceeds 2.326 one time in a hundred; the largest of a hundred independent ones exceeds 3.718.
    #[test]
    fn more_hypotheses_need_more_evidence() {
        let one = drawn(DMatrix::from_element(1, 1, 4.0), 1).improvement(0.01);
        let hundred = drawn(DMatrix::identity(100, 100), 1).improvement(0.01);
        assert!((one / 2.326_f64.powi(2) - 1.0).abs() < 0.15, "{one}");
        assert!((hundred / 3.718_f64.powi(2) - 1.0).abs() < 0.15, "{hundred}");
    }

    #[test]
    fn directions_that_are_alike_count_once() {
        let alike = DMatrix::from_element(50, 50, 1.0);
        let (one, fifty) = (drawn(DMatrix::identity(1, 1), 2), drawn(alike, 2));
        assert!((fifty.ln_odds(0.01) / one.ln_odds(0.01) - 1.0).abs() < 0.2);
    }

    #[test]
    fn the_same_seed_draws_the_same() {
        let draw = |seed: u64| drawn(DMatrix::identity(3, 3), seed).ln_odds(0.05);
        assert_eq!(draw(3), draw(3));
        assert_ne!(draw(3), draw(4));
        assert_eq!(drawn(DMatrix::zeros(0, 0), 1).ln_odds(0.01), f64::NEG_INFINITY);
    }
}
