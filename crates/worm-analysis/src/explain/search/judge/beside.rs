//! What the residual of a fit may hold beside it, known up to normal coefficients, and the evidence for that.
//!
//! With D the whitened columns, r the residuals, and everything that is free in the fit projected out,
//!
//! ```text
//! ln B = −½ ln det(1 + κ² G) + ½ vᵀ (κ⁻² + G)⁻¹ v,   G = Dᵀ K D,   v = Dᵀ K r
//! ```
//! is the logarithm of the Bayes factor against the fit alone, where the coefficients have the standard deviation κ. The columns are as
//! large as the discrepancy at a₀, and B is the mean over some κ above 1.

use super::super::discrepancy::Discrepancy;
use super::ln_sum::ln_mean;
use crate::least_squares::cross;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;

/// Scales over a₀.
const SCALES: [f64; 5] = [2.0, 6.0, 18.0, 60.0, 200.0];

/// A fit beside which something may be.
pub(super) struct Fitted<'f> {
    pub residual: &'f [f64],
    /// Derivatives by everything that is free and not on a limit.
    pub jacobian: &'f DMatrix<f64>,
    /// The normal matrix of these, and the gradient of half of chi-squared.
    pub normal: &'f Cholesky<f64, Dyn>,
    pub gradient: &'f DVector<f64>,
}

/// Blocks of columns, of which one may be there.
#[derive(Debug, Clone)]
pub(super) struct Blocks {
    each: Vec<Block>,
}

/// Some columns.
#[derive(Debug, Clone)]
struct Block {
    /// Whitened. In single precision, for those of a long recording fill gigabytes.
    columns: DMatrix<f32>,
    /// Products of the columns with each other.
    gram: DMatrix<f64>,
}

impl Blocks {
    /// So many blocks, of each the columns, whitened by the noise.
    pub fn new(count: usize, columns: impl Fn(usize) -> Vec<Vec<f64>> + Sync, discrepancy: &Discrepancy) -> Self {
        let block = |number: usize| Block::new(columns(number), discrepancy);
        Self {
            each: (0..count).into_par_iter().map(block).collect(),
        }
    }

    /// Logarithm of the Bayes factor of each block.
    pub fn ln_bayes(&self, fitted: &Fitted<'_>) -> Vec<f64> {
        self.each.par_iter().map(|block| block.ln_bayes(fitted)).collect()
    }
}

impl Block {
    fn new(columns: Vec<Vec<f64>>, discrepancy: &Discrepancy) -> Self {
        let (rows, count) = (columns.first().map_or(0, Vec::len), columns.len());
        let mut columns = DMatrix::from_iterator(rows, count, columns.into_iter().flatten());
        discrepancy.whiten_columns(&mut columns);
        let columns = columns.map(|value| value as f32);
        let exact = columns.map(f64::from);
        Self {
            gram: cross(&exact, &exact),
            columns,
        }
    }

    fn ln_bayes(&self, fitted: &Fitted<'_>) -> f64 {
        let columns = self.columns.map(f64::from);
        let along = cross(&columns, fitted.jacobian);
        let solved = fitted.normal.solve(&along.transpose());
        let residual = DVector::from_column_slice(fitted.residual);
        let product = columns.tr_mul(&residual) - solved.tr_mul(fitted.gradient);
        let projected = &self.gram - along * solved;
        let at_scale = |kappa: f64| {
            let scaled = &projected * (kappa * kappa) + DMatrix::identity(product.len(), product.len());
            let Some(factor) = scaled.cholesky() else {
                return f64::NEG_INFINITY;
            };
            let gain = kappa * kappa * product.dot(&factor.solve(&product));
            0.5 * gain - 0.5 * factor.ln_determinant()
        };
        ln_mean(&SCALES.map(at_scale)).unwrap_or(f64::NEG_INFINITY)
    }
}

#[cfg(test)]
pub(super) fn beside_the_nominal_worm<T>(
    problem: &super::super::problem::FitProblem<'_, impl super::super::plant::Plant>,
    ask: impl Fn(&Fitted<'_>) -> T,
) -> T {
    let residual = problem.residuals(&super::super::hypothesis::Hypothesis::default(), &[]);
    ask(&Fitted {
        residual: &residual,
        jacobian: &DMatrix::zeros(residual.len(), 0),
        normal: &DMatrix::zeros(0, 0).cholesky().expect("nothing is free"),
        gradient: &DVector::zeros(0),
    })
}
