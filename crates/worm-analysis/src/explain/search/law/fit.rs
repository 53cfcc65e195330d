//! Fitting a law to the end, together with everything that is free besides.

use super::super::discrepancy::Discrepancy;
use super::super::fit::Fit;
use super::super::folds::Folds;
use super::super::held_out::HeldOut;
use super::super::judgement::held_out;
use super::super::parameter::What;
use super::super::plant::Plant;
use super::super::problem::FitProblem;
use super::fitted_law::FittedLaw;
use super::shape::LawShape;
use crate::least_squares::{standard_errors, submatrix};
use std::sync::Arc;

/// Step of the derivatives by a coefficient.
pub(super) const STEP: f64 = 0.1;
/// Parts of the coefficients to first order from which a law is fitted, where they are nearer to the data than the whole.
const PARTS: [f64; 3] = [0.5, 0.2, 0.05];
/// Standard errors to either end of a 90 % interval.
const NINETY: f64 = 1.645;

/// What every law is fitted with and held against.
pub(in crate::explain) struct LawSearch<'s, 'p, P> {
    pub problem: &'s FitProblem<'p, P>,
    pub discrepancy: &'s Discrepancy,
    /// Without a law, with derivatives; and on data held out.
    pub recalibrated: &'s Fit,
    pub without: &'s HeldOut,
    pub folds: &'s Folds,
}

impl FittedLaw {
    /// The fit of what is free besides, with derivatives, the law as it is at the points of some grid.
    pub fn besides<P: Plant>(&self, problem: &FitProblem<'_, P>, on_grid: LawShape) -> Fit {
        let mut hypothesis = self.fit.hypothesis.clone();
        hypothesis.free.retain(|free| !matches!(free.what, What::Law(_)));
        hypothesis.law = Some(Arc::new(on_grid));
        let count = hypothesis.free.len();
        let mut fit = problem.evaluate(&hypothesis, self.fit.at[..count].to_vec());
        fit.jacobian = self.fit.jacobian[..count].to_vec();
        fit
    }
}

/// Where a fit of a law starts.
pub(super) struct Start<'f> {
    /// What is free without the law, with derivatives.
    pub from: &'f Fit,
    pub shape: LawShape,
    /// Coefficients to first order.
    pub at: Vec<f64>,
    /// Derivatives of the residuals by them.
    pub known: Vec<Vec<f64>>,
    /// The columns at the points of the offered grid: `[coefficient][point]`.
    pub on_grid: Vec<Vec<f64>>,
    /// Variance of the values that no column has.
    pub left: Vec<f64>,
    pub seen: Vec<f64>,
}

/// Fits a law from a start.
pub(super) fn fit_shape<P: Plant>(search: &LawSearch<'_, '_, P>, start: Start<'_>) -> FittedLaw {
    let (problem, recalibrated) = (search.problem, search.recalibrated);
    let shape = Arc::new(start.shape);
    let hypothesis = recalibrated.hypothesis.with_law(Arc::clone(&shape), STEP);
    // A strong law is not linear: the whole of what first order promises may be further from the data than none of it.
    let part_of_it = |part: f64| {
        let coefficients: Vec<f64> = start.at.iter().map(|coefficient| part * coefficient).collect();
        problem.evaluate(&hypothesis, [&start.from.at[..], &coefficients].concat())
    };
    let mut nearest = part_of_it(1.0);
    for part in PARTS {
        let one = part_of_it(part);
        if one.chi_squared < nearest.chi_squared {
            nearest = one;
        }
    }
    let mut known = start.from.clone();
    known.jacobian.extend(start.known);
    let mut fit = problem.fit_from(&hypothesis, nearest.at, Some(&known));
    problem.compute_jacobian(&mut fit);
    let held_out = held_out(problem, &fit, search.folds);
    let gain = search.without.chi_squared - held_out.chi_squared - problem.excess_of_repeating(recalibrated, &fit);
    let (value, band) = with_band(&fit, &shape, &start.left);
    let coefficients = fit.hypothesis.law_coefficients(&fit.at);
    let mut beyond = vec![0.0; start.on_grid.first().map_or(0, Vec::len)];
    for (column, by) in start.on_grid.iter().zip(coefficients) {
        beyond
            .iter_mut()
            .zip(column)
            .for_each(|(beyond, at)| *beyond += by * at);
    }
    FittedLaw {
        fit,
        held_out,
        gain,
        shape,
        value,
        beyond,
        band,
        seen: start.seen,
    }
}

/// The values of a fitted law and their 90 % band.
fn with_band(fit: &Fit, shape: &LawShape, left: &[f64]) -> (Vec<f64>, Vec<[f64; 2]>) {
    let open: Vec<usize> = (0..fit.at.len()).filter(|&at| !fit.at_limit(at)).collect();
    let normal = submatrix(&fit.normal(None), &open);
    let covariance = normal.clone().cholesky().map(|factor| factor.inverse());
    let of_law: Vec<(usize, usize)> = open
        .iter()
        .enumerate()
        .filter_map(|(place, &at)| match fit.hypothesis.free[at].what {
            What::Law(number) => Some((place, number)),
            _ => None,
        })
        .collect();
    let value = shape.value(fit.hypothesis.law_coefficients(&fit.at).as_slice());
    let sigmas = standard_errors(normal);
    let band = value.iter().enumerate().map(|(point, value)| {
        let mut variance = left.get(point).copied().unwrap_or(0.0);
        for &(row, one) in &of_law {
            for &(column, other) in &of_law {
                let covariance = match &covariance {
                    Some(covariance) => covariance[(row, column)],
                    None if row == column => sigmas[row].powi(2),
                    None => 0.0,
                };
                variance += shape.columns[one][point] * covariance * shape.columns[other][point];
            }
        }
        let half = NINETY * variance.max(0.0).sqrt();
        [value - half, value + half]
    });
    let band = band.collect();
    (value, band)
}
