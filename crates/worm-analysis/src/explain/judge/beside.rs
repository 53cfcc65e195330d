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
use super::ln_sum::ln_sum;
use crate::least_squares::cross;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

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

/// Blocks of columns, each of as many, of which one may be there.
#[derive(Debug, Clone)]
pub(super) struct Blocks {
    count: usize,
    /// Whitened.
    columns: DMatrix<f64>,
    /// Products of the columns of each block with each other.
    gram: Vec<DMatrix<f64>>,
}

impl Blocks {
    /// So many blocks of columns that are whitened by the noise.
    pub fn new(columns: Vec<Vec<f64>>, count: usize, discrepancy: &Discrepancy) -> Self {
        let rows = columns.first().map_or(0, Vec::len);
        let mut columns = DMatrix::from_iterator(rows, columns.len(), columns.into_iter().flatten());
        discrepancy.whiten_columns(&mut columns);
        let each = columns.ncols().checked_div(count).unwrap_or(0);
        let gram = (0..count)
            .map(|number| {
                let mine = columns.columns(number * each, each).into_owned();
                cross(&mine, &mine)
            })
            .collect();
        Self { count, columns, gram }
    }

    /// The logarithm of the Bayes factor of each block beside a fit.
    pub fn ln_bayes(&self, fitted: &Fitted<'_>) -> Vec<f64> {
        if self.count == 0 {
            return Vec::new();
        }
        let along = cross(&self.columns, fitted.jacobian);
        let solved = fitted.normal.solve(&along.transpose());
        let residual = DVector::from_column_slice(fitted.residual);
        let product = self.columns.tr_mul(&residual) - solved.tr_mul(fitted.gradient);
        let each = self.columns.ncols() / self.count;
        let of_block = |(number, gram): (usize, &DMatrix<f64>)| {
            let from = number * each;
            let projected = gram - along.rows(from, each) * solved.columns(from, each);
            let product = product.rows(from, each);
            let at_scale = |kappa: f64| {
                let scaled = &projected * (kappa * kappa) + DMatrix::identity(each, each);
                let Some(factor) = scaled.cholesky() else {
                    return f64::NEG_INFINITY;
                };
                let gain = kappa * kappa * product.dot(&factor.solve(&product.into_owned()));
                0.5 * gain - 0.5 * factor.ln_determinant()
            };
            ln_sum(SCALES.map(at_scale)) - (SCALES.len() as f64).ln()
        };
        self.gram.iter().enumerate().map(of_block).collect()
    }
}

/// What is asked beside the nominal worm, with nothing free.
#[cfg(test)]
pub(super) fn beside_the_nominal_worm<T>(
    problem: &super::super::fit::FitProblem<'_, '_>,
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
