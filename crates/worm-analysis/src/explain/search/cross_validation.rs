//! How well a hypothesis predicts data that it was not fitted to.
//!
//! The data are partitioned in two ways: a worm's by runs, and by blocks of neighbouring cycles of all runs; a servo's by trajectories, and
//! by gains. Each part is left out in turn;
//! the hypothesis is refitted to the rest by Gauss-Newton steps, and its residuals on the part left out are simulated exactly. The
//! score is the mean over both partitions.
//!
//! # The score
//! Data left out have conditions of their own that the rest does not determine, such as the error of their slope. So the score is
//! twice the negative logarithm of the probability density that the fit predicts for them, its uncertainty included. With residuals
//! r there, derivatives J, and C the covariance that the rest leaves,
//!
//! ```text
//! rᵀ (1 + J C Jᵀ)⁻¹ r + log det (1 + J C Jᵀ) = |r|² − gᵀ N⁻¹ g + log (det N / det C⁻¹),   N = C⁻¹ + Jᵀ J,   g = Jᵀ r
//! ```
//! A vague effect predicts everything with a low density and so pays for its freedom. The priors' part of chi-squared of the whole
//! fit is added: of two hypotheses that predict the same, the one with less extreme values is more likely.

use super::fit::{Fit, FitWithout};
use super::folds::{Fold, Folds};
use super::held_out::HeldOut;
use super::parameter::What;
use super::plant::Plant;
use super::problem::FitProblem;
use crate::least_squares::{dot, prior_chi_squared, standard_errors, submatrix};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Standard errors from its neutral value at which a severity is determined.
const DETERMINED: f64 = 2.0;

/// For each residual, whether it stays in without a fold.
fn stays_without<P: Plant>(problem: &FitProblem<'_, P>, fold: &Fold) -> Vec<bool> {
    let stays = |(run, bin): (usize, usize)| !fold.left_out[run][problem.plant.bins(run).bins[bin].cycle];
    problem.bin_of_rows().into_iter().map(stays).collect()
}

/// Scores a fitted hypothesis, which has its derivatives, on every fold.
pub(in crate::explain) fn hold_out<P: Plant>(problem: &FitProblem<'_, P>, fit: &Fit, folds: &Folds) -> HeldOut {
    let refit = |fold: &Fold| {
        let stays = stays_without(problem, fold);
        let mut without = fit.clone();
        for _ in 0..problem.plant.steps_without() {
            without = problem.step_without(without, &stays);
        }
        let chi_squared = score(&without, &stays);
        let is_determined = determines(fit, &without, &stays);
        without.jacobian = Vec::new();
        ((chi_squared, is_determined), (without, fold.left_out.clone()))
    };
    let (scores, fits): (Vec<(f64, bool)>, Vec<FitWithout>) = folds.each.par_iter().map(refit).unzip();
    let (chi_squared, determined): (Vec<f64>, Vec<bool>) = scores.into_iter().unzip();
    HeldOut {
        chi_squared: chi_squared.iter().sum::<f64>() / folds.partitions
            + prior_chi_squared(&fit.hypothesis.quantities(), &fit.at),
        fits,
        determined,
    }
}

/// Whether the rows that stay determine the severities that a fit to all of them found.
fn determines(all: &Fit, without: &Fit, stays: &[bool]) -> bool {
    let sigmas = standard_errors(without.normal(Some(stays)));
    let mut free = all.hypothesis.free.iter().enumerate();
    free.all(|(at, free)| match free.what {
        What::Effect { parameter: 0, .. } => (all.at[at] - free.quantity.centre).abs() >= DETERMINED * sigmas[at],
        _ => true,
    })
}

/// Twice the negative logarithm of the probability, up to a constant that no hypothesis changes, of the data that do not stay.
fn score(without: &Fit, stays: &[bool]) -> f64 {
    let left_out: Vec<bool> = stays.iter().map(|stays| !stays).collect();
    let residual = &without.residual;
    let chi_squared = dot(residual, residual, Some(&left_out));
    // What lies at a limit is known as well as it can be.
    let open: Vec<usize> = (0..without.at.len())
        .filter(|&quantity| !without.at_limit(quantity))
        .collect();
    let (known, whole) = (without.normal(Some(stays)), without.normal(None));
    let factor = |normal: &DMatrix<f64>| {
        let mut matrix = submatrix(normal, &open);
        for row in 0..open.len() {
            matrix[(row, row)] *= 1.0 + 1e-9;
        }
        matrix.cholesky()
    };
    let (Some(known), Some(whole)) = (factor(&known), factor(&whole)) else {
        return chi_squared;
    };
    let drawn = DVector::from_iterator(
        open.len(),
        open.iter()
            .map(|&quantity| dot(&without.jacobian[quantity], residual, Some(&left_out))),
    );
    chi_squared - drawn.dot(&whole.solve(&drawn)) + whole.ln_determinant() - known.ln_determinant()
}
