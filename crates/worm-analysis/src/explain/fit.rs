//! A campaign as a problem of least squares, and hypotheses fitted to it.
//!
//! Every evaluation simulates the whole campaign, so the derivatives are computed by differences once and then updated; they are
//! computed again when they no longer lead downhill (see [`crate::least_squares`]).

use super::hypothesis::Hypothesis;
use super::noise::RunNoise;
use super::parameter::{Nuisance, What};
use super::predict::Scene;
use super::residual::Residual;
use crate::least_squares::{
    self, Derivatives, Estimate, LeastSquares, Method, Quantity, damped_step, dot, gradient, normal_matrix,
    prior_chi_squared, standard_errors,
};
use nalgebra::DMatrix;
use rayon::prelude::*;

/// Fall of chi-squared below which a fit has converged, absolute and as a fraction.
const CONVERGED: (f64, f64) = (0.05, 2e-5);
/// A fit to the end.
const TO_THE_END: Method = Method {
    derivatives: Derivatives::Updated,
    max_steps: 40,
    converged: CONVERGED,
};
/// A few steps, enough to see what a fit is worth.
const ROUGH: Method = Method {
    derivatives: Derivatives::UpdatedOnly,
    max_steps: 7,
    converged: CONVERGED,
};
/// Damping of a single step without part of the data, and how often it is halved until it leads downhill.
const SLIGHT_DAMPING: f64 = 1e-6;
const HALVINGS: i32 = 3;
/// Residual of a run that the worm could not have made.
const IMPOSSIBLE: f64 = 1e3;

/// The campaign with its noise.
pub(super) struct FitProblem<'s, 'a> {
    pub scene: &'s Scene<'a>,
    pub noise: Vec<RunNoise>,
    /// By how much chi-squared of the recalibrated model grows where a cycle of a periodic crawl is simulated once and repeated,
    /// instead of simulating every cycle.
    pub repeating_excess: f64,
}

/// A fitted hypothesis.
#[derive(Debug, Clone)]
pub(super) struct Fit {
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

    /// Standard errors of all quantities; infinite where nothing is known.
    pub fn sigmas(&self) -> Vec<f64> {
        standard_errors(self.normal(None))
    }
}

/// A campaign's residuals under one hypothesis.
struct UnderHypothesis<'p, 's, 'a> {
    problem: &'p FitProblem<'s, 'a>,
    hypothesis: &'p Hypothesis,
    quantities: Vec<Quantity>,
}

impl LeastSquares for UnderHypothesis<'_, '_, '_> {
    fn quantities(&self) -> &[Quantity] {
        &self.quantities
    }

    fn residuals(&self, at: &[f64]) -> Vec<f64> {
        self.problem.residuals(self.hypothesis, at)
    }

    fn derivatives(&self, at: &[f64], residual: &[f64], quantities: &[usize]) -> Vec<Vec<f64>> {
        self.problem.derivatives(self.hypothesis, at, residual, quantities)
    }
}

impl<'s, 'a> FitProblem<'s, 'a> {
    fn under<'p>(&'p self, hypothesis: &'p Hypothesis) -> UnderHypothesis<'p, 's, 'a> {
        UnderHypothesis {
            problem: self,
            hypothesis,
            quantities: hypothesis.quantities(),
        }
    }

    /// Rows of each run, in the vector of all residuals.
    fn rows(&self, run: usize) -> std::ops::Range<usize> {
        let length = |run: usize| {
            let observed = &self.scene.observed[run];
            (observed.samples() - observed.counts_from) * (1 + observed.cells())
        };
        let from: usize = (0..run).map(length).sum();
        from..from + length(run)
    }

    /// Residuals of a run under a hypothesis.
    fn run_residuals(&self, run: usize, hypothesis: &Hypothesis, at: &[f64]) -> Vec<f64> {
        let observed = &self.scene.observed[run];
        let rows = self.rows(run).len();
        let mut out = Vec::with_capacity(rows);
        match self.scene.predict(run, hypothesis, at) {
            Some(predicted) => self.noise[run].whiten(observed, &Residual::new(observed, &predicted), &mut out),
            None => out.resize(rows, IMPOSSIBLE),
        }
        out
    }

    /// Residuals of all runs.
    pub fn residuals(&self, hypothesis: &Hypothesis, at: &[f64]) -> Vec<f64> {
        let runs = (0..self.scene.observed.len()).into_par_iter();
        let residuals: Vec<Vec<f64>> = runs.map(|run| self.run_residuals(run, hypothesis, at)).collect();
        residuals.concat()
    }

    /// How the residuals change with some quantities, by differences towards the inside of their limits.
    fn derivatives(
        &self,
        hypothesis: &Hypothesis,
        at: &[f64],
        residual: &[f64],
        quantities: &[usize],
    ) -> Vec<Vec<f64>> {
        let runs = self.scene.observed.len();
        let of_run = |quantity: usize, run: usize| {
            let free = &hypothesis.free[quantity];
            let rows = self.rows(run);
            if matches!(free.what, What::Nuisance(Nuisance::SlopeOf(of)) if of != run) {
                return vec![0.0; rows.len()];
            }
            let step = free.quantity.inward_step(at[quantity]);
            let mut probe = at.to_vec();
            probe[quantity] += step;
            let mut column = self.run_residuals(run, hypothesis, &probe);
            for (value, here) in column.iter_mut().zip(&residual[rows]) {
                *value = (*value - here) / step;
            }
            column
        };
        let columns = quantities.par_iter().map(|&quantity| {
            let runs: Vec<Vec<f64>> = (0..runs).into_par_iter().map(|run| of_run(quantity, run)).collect();
            runs.concat()
        });
        columns.collect()
    }

    /// By how much chi-squared of a fit grows where a cycle of a periodic crawl is simulated once and repeated, compared to the same
    /// hypothesis fitted with every cycle simulated.
    pub fn repeating_excess(&self, fit: &Fit) -> f64 {
        let throughout = Hypothesis {
            throughout: true,
            ..fit.hypothesis.clone()
        };
        fit.chi_squared - self.fit(&throughout, fit.at.clone(), Some(fit)).chi_squared
    }

    /// How much of a fall of chi-squared from one fit to another is due to the one repeating a cycle and the other simulating all.
    pub fn excess_of_repeating(&self, from: &Fit, to: &Fit) -> f64 {
        let repeats = |fit: &Fit| self.scene.physics(0, &fit.hypothesis, &fit.at).0.is_periodic();
        match (repeats(from), repeats(to)) {
            (true, false) => self.repeating_excess,
            (false, true) => -self.repeating_excess,
            _ => 0.0,
        }
    }

    /// A hypothesis at some values, without derivatives.
    pub fn evaluate(&self, hypothesis: &Hypothesis, at: Vec<f64>) -> Fit {
        Fit::new(hypothesis, least_squares::evaluate(&self.under(hypothesis), at))
    }

    /// Computes the derivatives of all quantities.
    pub fn compute_jacobian(&self, fit: &mut Fit) {
        let all: Vec<usize> = (0..fit.at.len()).collect();
        fit.jacobian = self.derivatives(&fit.hypothesis, &fit.at, &fit.residual, &all);
    }

    /// A hypothesis at some values, with derivatives.
    pub fn with_derivatives(&self, hypothesis: &Hypothesis, at: Vec<f64>) -> Fit {
        let mut fit = self.evaluate(hypothesis, at);
        self.compute_jacobian(&mut fit);
        fit
    }

    /// Fits from some values. Columns of `known`, a fit nearby, serve as first derivatives of the quantities that both have.
    pub fn fit(&self, hypothesis: &Hypothesis, at: Vec<f64>, known: Option<&Fit>) -> Fit {
        self.fit_by(&TO_THE_END, hypothesis, at, known)
    }

    /// A few steps of a fit with the derivatives that are there: enough to see what it is worth.
    pub fn fit_roughly(&self, hypothesis: &Hypothesis, at: Vec<f64>, known: &Fit) -> Fit {
        self.fit_by(&ROUGH, hypothesis, at, Some(known))
    }

    fn fit_by(&self, method: &Method, hypothesis: &Hypothesis, at: Vec<f64>, known: Option<&Fit>) -> Fit {
        let known = known.map(|known| known.jacobian.clone());
        let estimate = least_squares::minimise(&self.under(hypothesis), at, known, method);
        Fit::new(hypothesis, estimate)
    }

    /// One Gauss-Newton step on the residuals that stay, with the derivatives that are there; halved until it leads downhill, and none
    /// if it never does.
    pub fn step_without(&self, fit: Fit, stays: &[bool]) -> Fit {
        let quantities = fit.hypothesis.quantities();
        let chi_squared =
            |fit: &Fit| dot(&fit.residual, &fit.residual, Some(stays)) + prior_chi_squared(&quantities, &fit.at);
        let normal = fit.normal(Some(stays));
        let gradient = gradient(&quantities, &fit.at, &fit.residual, &fit.jacobian, Some(stays));
        let whole = damped_step(&quantities, &fit.at, &normal, &gradient, SLIGHT_DAMPING);
        let here = chi_squared(&fit);
        for halved in 0..HALVINGS {
            let fraction = 0.5_f64.powi(halved);
            let with_step = fit.at.iter().zip(&whole);
            let at = with_step.map(|(from, to)| from + fraction * (to - from)).collect();
            let trial = self.evaluate(&fit.hypothesis, at);
            if chi_squared(&trial) < here {
                return Fit {
                    jacobian: fit.jacobian,
                    converged: fit.converged,
                    ..trial
                };
            }
        }
        fit
    }
}
