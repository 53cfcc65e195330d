//! A fitted hypothesis.

use super::hypothesis::Hypothesis;
use crate::least_squares::{Estimate, normal_matrix, standard_errors, submatrix};
use nalgebra::{DMatrix, DVector};

/// A fitted hypothesis.
#[derive(Debug, Clone)]
pub(in crate::explain) struct Fit {
    pub hypothesis: Hypothesis,
    pub at: Vec<f64>,
    /// Residuals of all runs, one after the other.
    pub residual: Vec<f64>,
    /// Their derivatives, a column for each free quantity; empty where they were not computed.
    pub jacobian: Vec<Vec<f64>>,
    /// Square sum of the residuals and of what the priors add.
    pub chi_squared: f64,
    pub converged: bool,
}

/// A fit, and what was left out for it: for each run and whole cycle since its first sample, whether it was.
pub(in crate::explain) type FitWithout = (Fit, Vec<Vec<bool>>);

impl Fit {
    pub fn new(hypothesis: &Hypothesis, estimate: Estimate) -> Self {
        let Estimate {
            at,
            residual,
            jacobian,
            chi_squared,
            converged,
        } = estimate;
        Self {
            hypothesis: hypothesis.clone(),
            at,
            residual,
            jacobian,
            chi_squared,
            converged,
        }
    }

    /// Normal matrix of residuals and priors over the rows that count; all of them for none.
    pub fn normal(&self, counts: Option<&[bool]>) -> DMatrix<f64> {
        normal_matrix(&self.hypothesis.quantities(), &self.jacobian, counts)
    }

    /// Whether a quantity lies on one of its limits.
    pub fn at_limit(&self, quantity: usize) -> bool {
        let free = &self.hypothesis.free[quantity];
        free.quantity.is_at_limit(self.at[quantity])
    }

    /// Whether a quantity would go beyond its prior: it lies on a limit, and that is not where its prior is largest.
    pub fn would_go_beyond(&self, quantity: usize) -> bool {
        let prior = &self.hypothesis.free[quantity].quantity;
        self.at_limit(quantity)
            && !(prior.is_at_limit(prior.centre) && (self.at[quantity] - prior.centre).abs() < prior.step)
    }

    /// Standard errors of all quantities; infinite where nothing is known. What lies at a limit adds nothing to the errors of others.
    pub fn sigmas(&self) -> Vec<f64> {
        let normal = self.normal(None);
        let mut sigmas = standard_errors(normal.clone());
        let open: Vec<usize> = (0..self.at.len())
            .filter(|&quantity| !self.at_limit(quantity))
            .collect();
        for (&quantity, sigma) in open.iter().zip(standard_errors(submatrix(&normal, &open))) {
            sigmas[quantity] = sigma;
        }
        sigmas
    }

    /// Standard deviation of something linear in all quantities, by its derivatives.
    pub fn sigma_of(&self, derivatives: &[f64]) -> f64 {
        let open: Vec<usize> = (0..self.at.len())
            .filter(|&quantity| !self.at_limit(quantity))
            .collect();
        let derivatives = DVector::from_iterator(open.len(), open.iter().map(|&quantity| derivatives[quantity]));
        let factor = submatrix(&self.normal(None), &open).cholesky();
        factor.map_or(f64::INFINITY, |factor| {
            derivatives.dot(&factor.solve(&derivatives)).max(0.0).sqrt()
        })
    }
}
