//! How probable the data are under a law that is a Gaussian process, to first order.
//!
//! With D the derivatives of the residuals by the values at all points, everything that is free projected out, s = −Dᵀr and G = DᵀD, and
//! values L c with normal coefficients c, the evidence against no law is
//!
//! ```text
//! ln B = −½ ln det(1 + LᵀGL) + ½ sᵀL (1 + LᵀGL)⁻¹ Lᵀs
//! ```
//!
//! Far from no law the derivatives are others: about values v that were found, s is −Dᵀr + G v, and the law is found anew.
//!
//! The directions in which LᵀGL is large are those that the data determine: they are the columns with which the law is fitted.

use super::super::directions::Projector;
use super::super::discrepancy::Discrepancy;
use super::super::fit::Fit;
use super::super::hypothesis::Hypothesis;
use super::super::plant::Plant;
use super::super::problem::FitProblem;
use super::kernel::Prior;
use super::offer::Offer;
use super::shape::LawShape;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use std::sync::Arc;

/// Information, in units of that of the prior, from which a direction is fitted; and most of them.
const DETERMINED: f64 = 0.3;
const MOST: usize = 10;
/// Steps of the derivatives by the value at a point, as a fraction of the second scale of what is offered.
const STEP: f64 = 0.2;

/// What the data say of the values at the points of a grid, to first order.
pub(super) struct Scores {
    /// s.
    pub scores: DVector<f64>,
    /// G.
    pub products: DMatrix<f64>,
    /// Derivatives of the residuals by the value at each point.
    pub derivatives: Vec<Vec<f64>>,
}

/// A law in the directions that the data determine.
pub(super) struct Determined {
    /// `[direction][point of the prior's grid]`.
    pub columns: Vec<Vec<f64>>,
    /// The same at the points of the offered grid.
    pub on_grid: Vec<Vec<f64>>,
    /// Coefficients to first order.
    pub at: Vec<f64>,
    /// Variance of the value at each point that no column has.
    pub left: Vec<f64>,
}

impl Scores {
    /// About a fit of the plant, which has its derivatives, where the law has some values beyond its neutral one at the points of the
    /// offered grid; none where the derivatives are singular. The scores are those of the whole values.
    pub fn about<P: Plant>(
        problem: &FitProblem<'_, P>,
        discrepancy: &Discrepancy,
        fit: &Fit,
        offer: &Offer,
        beyond: &[f64],
    ) -> Option<Self> {
        let step = STEP * offer.sigmas[1];
        let shape = offer.shape.clone().about(beyond).with_each_point();
        let hypothesis = fit.hypothesis.with_law(Arc::new(shape), step);
        let points = beyond.len();
        let mut at = fit.at.clone();
        at.extend(vec![0.0; points]);
        let of_law: Vec<usize> = (fit.at.len()..at.len()).collect();
        let derivatives = problem.derivatives(&hypothesis, &at, &of_law);
        let projector = Projector::new(discrepancy, fit)?;
        let mut directions = projector.none();
        projector.append(derivatives.clone(), &mut directions);
        let products = directions.products();
        Some(Self {
            scores: DVector::from_vec(directions.scores) + &products * DVector::from_column_slice(beyond),
            products,
            derivatives,
        })
    }

    /// Logarithm of the Bayes factor of a law against none.
    pub fn ln_bayes(&self, root: &DMatrix<f64>) -> f64 {
        self.posterior(root).map_or(f64::NEG_INFINITY, |(factor, along)| {
            0.5 * along.dot(&factor.solve(&along)) - 0.5 * factor.ln_determinant()
        })
    }

    /// The most probable coefficients of some columns, to first order; 0 where they are singular.
    pub fn most_probable(&self, root: &DMatrix<f64>) -> Vec<f64> {
        let found = self.posterior(root).map(|(factor, along)| factor.solve(&along));
        found.map_or_else(|| vec![0.0; root.ncols()], |found| found.as_slice().to_vec())
    }

    /// 1 + LᵀGL and Lᵀs; none where the former is singular.
    fn posterior(&self, root: &DMatrix<f64>) -> Option<(Cholesky<f64, Dyn>, DVector<f64>)> {
        let inner = DMatrix::identity(root.ncols(), root.ncols()) + root.transpose() * &self.products * root;
        Some((inner.cholesky()?, root.transpose() * &self.scores))
    }

    /// The directions that the data determine, strongest first.
    pub fn determined(&self, prior: &Prior) -> Determined {
        let root = &prior.on_grid;
        let eigen = (root.transpose() * &self.products * root).symmetric_eigen();
        let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        order.retain(|&at| eigen.eigenvalues[at] > DETERMINED);
        order.truncate(MOST);
        let along = root.transpose() * &self.scores;
        let turned = |matrix: &DMatrix<f64>, at: usize| (matrix * eigen.eigenvectors.column(at)).as_slice().to_vec();
        let columns: Vec<Vec<f64>> = order.iter().map(|&at| turned(&prior.root, at)).collect();
        let whole = (0..prior.root.nrows()).map(|point| prior.root.row(point).norm_squared());
        let left = whole.enumerate().map(|(point, whole)| {
            let kept: f64 = columns.iter().map(|column| column[point] * column[point]).sum();
            (whole - kept).max(0.0)
        });
        Determined {
            left: left.collect(),
            at: order
                .iter()
                .map(|&at| eigen.eigenvectors.column(at).dot(&along) / (1.0 + eigen.eigenvalues[at]))
                .collect(),
            on_grid: order.iter().map(|&at| turned(root, at)).collect(),
            columns,
        }
    }

    /// Derivatives of the residuals by the coefficients of columns at the points of the grid.
    pub fn by_columns(&self, columns: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let rows = self.derivatives.first().map_or(0, Vec::len);
        let of = |column: &Vec<f64>| {
            let mut sum = vec![0.0; rows];
            for (derivative, by) in self.derivatives.iter().zip(column).filter(|(_, by)| **by != 0.0) {
                sum.iter_mut().zip(derivative).for_each(|(sum, one)| *sum += by * one);
            }
            sum
        };
        columns.iter().map(of).collect()
    }
}

impl Hypothesis {
    /// The same with a law whose coefficients have a normal prior of unit variance; `step` is that of their derivatives.
    pub(super) fn with_law(&self, shape: Arc<LawShape>, step: f64) -> Self {
        let mut hypothesis = self.clone();
        let coefficients = 0..shape.columns.len();
        hypothesis
            .free
            .extend(coefficients.map(|number| super::super::parameter::Free::of_law(number, step)));
        hypothesis.law = Some(shape);
        hypothesis
    }
}
