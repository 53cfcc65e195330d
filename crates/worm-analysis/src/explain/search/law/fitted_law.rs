//! A law fitted to the end, with what it does on data held out and its band.

use super::super::cross_validation::HeldOut;
use super::super::fit::Fit;
use super::super::judgement::held_out;
use super::super::parameter::What;
use super::super::plant::Plant;
use super::super::problem::FitProblem;
use super::find::LawSearch;
use super::shape::LawShape;
use crate::least_squares::{standard_errors, submatrix};
use std::sync::Arc;

/// Step of the derivatives by a coefficient.
pub(super) const STEP: f64 = 0.1;
/// Standard errors to either end of a 90 % interval.
const NINETY: f64 = 1.645;

/// A law that was fitted.
#[derive(Debug, Clone)]
pub(in crate::explain) struct FittedLaw {
    /// With derivatives.
    pub fit: Fit,
    pub held_out: HeldOut,
    /// Fall of the score on data held out.
    pub gain: f64,
    pub shape: Arc<LawShape>,
    pub value: Vec<f64>,
    /// Values beyond neutral at the points of the offered grid.
    pub beyond: Vec<f64>,
    /// 90 % band at every point.
    pub band: Vec<[f64; 2]>,
    /// Where the data are on the first axis.
    pub seen: Vec<f64>,
}

impl FittedLaw {
    /// Adds the same to the law everywhere.
    pub fn shift(&mut self, by: f64) {
        let mut shape = (*self.shape).clone();
        shape.centre.iter_mut().for_each(|centre| *centre += by);
        self.shape = Arc::new(shape);
        self.fit.hypothesis.law = Some(Arc::clone(&self.shape));
        self.value.iter_mut().for_each(|value| *value += by);
        self.beyond.iter_mut().for_each(|beyond| *beyond += by);
        self.band.iter_mut().flatten().for_each(|end| *end += by);
    }

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
    let from = [&start.from.at[..], &start.at].concat();
    let mut known = start.from.clone();
    known.jacobian.extend(start.known);
    let mut fit = problem.fit_from(&hypothesis, from, Some(&known));
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
