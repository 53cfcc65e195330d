//! The recordings of a plant as a problem of least squares, and hypotheses fitted to it.
//!
//! The rows are the mean residuals of each bin (see [`super::bins`]), whitened by the noise and by the discrepancy, so that the square
//! sum of a fit is minus twice its log likelihood with both marginalised.
//!
//! Every evaluation predicts the whole campaign, so the derivatives are computed by differences once and then updated; they are
//! computed again when they no longer lead downhill (see [`crate::least_squares`]).

use super::discrepancy::Discrepancy;
use super::fit::Fit;
use super::hypothesis::Hypothesis;
use super::parameter::{Onset, What};
use super::plant::Plant;
use crate::least_squares::{
    self, Derivatives, LeastSquares, Method, Quantity, damped_step, dot, gradient, prior_chi_squared,
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

/// The recordings of a plant, as a problem of least squares.
pub(in crate::explain) struct FitProblem<'p, P> {
    pub plant: &'p P,
    /// None before the noise is known, for that comes first.
    pub discrepancy: Option<Discrepancy>,
    /// By how much chi-squared of the recalibrated model grows where what repeats is predicted once, instead of all of it.
    pub repeating_excess: f64,
}

/// A problem's residuals under one hypothesis.
struct UnderHypothesis<'h, 'p, P> {
    problem: &'h FitProblem<'p, P>,
    hypothesis: &'h Hypothesis,
    quantities: Vec<Quantity>,
}

impl<P: Plant> LeastSquares for UnderHypothesis<'_, '_, P> {
    fn quantities(&self) -> &[Quantity] {
        &self.quantities
    }

    fn residuals(&self, at: &[f64]) -> Vec<f64> {
        self.problem.residuals(self.hypothesis, at)
    }

    fn derivatives(&self, at: &[f64], _residual: &[f64], quantities: &[usize]) -> Vec<Vec<f64>> {
        self.problem.derivatives(self.hypothesis, at, quantities)
    }
}

impl<'p, P: Plant> FitProblem<'p, P> {
    /// With the noise of the plant alone.
    pub fn with_noise_alone(plant: &'p P) -> Self {
        Self {
            plant,
            discrepancy: None,
            repeating_excess: 0.0,
        }
    }

    fn under<'h>(&'h self, hypothesis: &'h Hypothesis) -> UnderHypothesis<'h, 'p, P> {
        UnderHypothesis {
            problem: self,
            hypothesis,
            quantities: hypothesis.quantities(),
        }
    }

    /// Rows of each run, in the vector of all residuals.
    fn rows(&self) -> Vec<std::ops::Range<usize>> {
        let mut from = 0;
        let of_run = |run: usize| {
            let rows = from..from + self.plant.bin_of_rows(run).len();
            from = rows.end;
            rows
        };
        (0..self.plant.runs()).map(of_run).collect()
    }

    /// The bin that each row is in, as run and number in the run.
    pub fn bin_of_rows(&self) -> Vec<(usize, usize)> {
        let of_run = |run: usize| self.plant.bin_of_rows(run).into_iter().map(move |bin| (run, bin));
        (0..self.plant.runs()).flat_map(of_run).collect()
    }

    /// Residuals of all runs, whitened by the noise alone, and the outcome that is predicted for each; `NaN` where the machine could not
    /// have made it.
    pub fn residuals_and_outcomes(&self, hypothesis: &Hypothesis, at: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let predict = |run: usize| {
            let predicted = self.plant.predict(run, hypothesis, at);
            (predicted.residuals, predicted.outcome)
        };
        let runs = (0..self.plant.runs()).into_par_iter();
        let (rows, outcomes): (Vec<Vec<f64>>, Vec<f64>) = runs.map(predict).unzip();
        (rows.concat(), outcomes)
    }

    /// Residuals of all runs, whitened by the noise alone.
    pub fn without_discrepancy(&self, hypothesis: &Hypothesis, at: &[f64]) -> Vec<f64> {
        self.residuals_and_outcomes(hypothesis, at).0
    }

    /// Standard deviations of the outcomes that a fit with derivatives predicts.
    pub fn outcome_sigmas(&self, fit: &Fit) -> Vec<f64> {
        let outcomes = |at: &[f64]| self.residuals_and_outcomes(&fit.hypothesis, at).1;
        let here = outcomes(&fit.at);
        let changes: Vec<Vec<f64>> = (0..fit.at.len())
            .map(|quantity| {
                let step = fit.hypothesis.free[quantity].quantity.inward_step(fit.at[quantity]);
                let mut probe = fit.at.clone();
                probe[quantity] += step;
                let there = outcomes(&probe);
                here.iter()
                    .zip(&there)
                    .map(|(here, there)| (there - here) / step)
                    .collect()
            })
            .collect();
        let of_run = |run: usize| fit.sigma_of(&changes.iter().map(|change| change[run]).collect::<Vec<f64>>());
        (0..here.len()).map(of_run).collect()
    }

    /// The largest relative change from some outcomes to others.
    pub fn largest_change(&self, from: &[f64], to: &[f64]) -> f64 {
        let change = |((run, from), to): ((usize, &f64), &f64)| {
            (to - from).abs() / from.abs().max(self.plant.least_outcome(run))
        };
        from.iter().enumerate().zip(to).map(change).fold(0.0, f64::max)
    }

    /// Whitens rows by the discrepancy, where it is known.
    pub fn whiten(&self, rows: &mut [f64]) {
        if let Some(discrepancy) = &self.discrepancy {
            discrepancy.whiten(rows);
        }
    }

    /// Residuals of all runs.
    pub fn residuals(&self, hypothesis: &Hypothesis, at: &[f64]) -> Vec<f64> {
        let mut residual = self.without_discrepancy(hypothesis, at);
        self.whiten(&mut residual);
        residual
    }

    /// How the residuals change with some quantities, by differences towards the inside of their limits.
    pub fn derivatives(&self, hypothesis: &Hypothesis, at: &[f64], quantities: &[usize]) -> Vec<Vec<f64>> {
        if quantities.is_empty() {
            return Vec::new();
        }
        let here = self.without_discrepancy(hypothesis, at);
        let (runs, rows) = (self.plant.runs(), self.rows());
        let of_run = |quantity: usize, run: usize| {
            let free = &hypothesis.free[quantity];
            let here = &here[rows[run].clone()];
            if matches!(free.what, What::Nuisance(nuisance) if !self.plant.concerns(nuisance, run)) {
                return vec![0.0; here.len()];
            }
            let step = free.quantity.inward_step(at[quantity]);
            let mut probe = at.to_vec();
            probe[quantity] += step;
            let mut column = self.plant.predict(run, hypothesis, &probe).residuals;
            if hypothesis.has_law_for_a_while(&probe) {
                // It is simulated with other increments for that while, which the same to the other side has as well.
                probe[quantity] = at[quantity] - step;
                let other = self.plant.predict(run, hypothesis, &probe).residuals;
                for (value, other) in column.iter_mut().zip(other) {
                    *value = (*value - other) / (2.0 * step);
                }
                return column;
            }
            for (value, here) in column.iter_mut().zip(here) {
                *value = (*value - here) / step;
            }
            column
        };
        let columns: Vec<Vec<f64>> = quantities
            .par_iter()
            .map(|&quantity| {
                let runs: Vec<Vec<f64>> = (0..runs).into_par_iter().map(|run| of_run(quantity, run)).collect();
                runs.concat()
            })
            .collect();
        self.whiten_all(columns)
    }

    /// A change of the residuals, whitened by the noise alone, that begins or ends at some time: what is left of it where it acts.
    pub fn within_onset(&self, change: &[f64], onset: &Onset) -> Vec<f64> {
        let of_run = |(run, rows): (usize, std::ops::Range<usize>)| {
            let bins = self.plant.bins(run);
            let first_after = |cycle: f64| bins.bins.partition_point(|bin| bin.phase < bins.start_phase + cycle);
            let acts = match onset.is_in(run) {
                true => onset.begins.map_or(0, first_after)..onset.ends.map_or(bins.len(), first_after),
                false if onset.acts_in(run) => 0..bins.len(),
                false => return vec![0.0; rows.len()],
            };
            self.plant.within(run, &change[rows], acts)
        };
        self.rows().into_iter().enumerate().flat_map(of_run).collect()
    }

    /// Whitens columns of rows by the discrepancy, where it is known.
    pub fn whiten_all(&self, columns: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        let Some(discrepancy) = &self.discrepancy else {
            return columns;
        };
        let rows = columns.first().map_or(0, Vec::len);
        let mut whitened = DMatrix::from_iterator(rows, columns.len(), columns.into_iter().flatten());
        discrepancy.whiten_columns(&mut whitened);
        whitened
            .column_iter()
            .map(|column| column.as_slice().to_vec())
            .collect()
    }

    /// By how much chi-squared of a fit grows where what repeats is predicted once, compared to the same hypothesis fitted with all of
    /// it predicted.
    pub fn repeating_excess(&self, fit: &Fit) -> f64 {
        let throughout = Hypothesis {
            throughout: true,
            ..fit.hypothesis.clone()
        };
        fit.chi_squared - self.fit(&throughout, fit.at.clone(), Some(fit)).chi_squared
    }

    /// How much of a fall of chi-squared from one fit to another is due to the one predicting what repeats once, and the other all.
    pub fn excess_of_repeating(&self, from: &Fit, to: &Fit) -> f64 {
        let repeats = |fit: &Fit| self.plant.repeats(&fit.hypothesis, &fit.at);
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
        fit.jacobian = self.derivatives(&fit.hypothesis, &fit.at, &all);
    }

    /// A hypothesis at some values, with derivatives.
    pub fn with_derivatives(&self, hypothesis: &Hypothesis, at: Vec<f64>) -> Fit {
        let mut fit = self.evaluate(hypothesis, at);
        self.compute_jacobian(&mut fit);
        fit
    }

    /// Fits from some values, and from where a plant with many minima would start besides. Columns of `known`, a fit nearby, serve as
    /// first derivatives of the quantities that both have.
    pub fn fit(&self, hypothesis: &Hypothesis, at: Vec<f64>, known: Option<&Fit>) -> Fit {
        let mut best = self.fit_from(hypothesis, at, known);
        for start in self.plant.other_starts(hypothesis, &best.at) {
            let fit = self.fit_from(hypothesis, start, None);
            if fit.chi_squared < best.chi_squared {
                best = fit;
            }
        }
        best
    }

    /// The same from these values alone.
    pub fn fit_from(&self, hypothesis: &Hypothesis, at: Vec<f64>, known: Option<&Fit>) -> Fit {
        self.fit_by(&TO_THE_END, hypothesis, at, known)
    }

    /// A few steps of a fit with the derivatives that are there, or those at the start: enough to see what it is worth.
    pub fn fit_roughly(&self, hypothesis: &Hypothesis, at: Vec<f64>, known: Option<&Fit>) -> Fit {
        self.fit_by(&ROUGH, hypothesis, at, known)
    }

    fn fit_by(&self, method: &Method, hypothesis: &Hypothesis, at: Vec<f64>, known: Option<&Fit>) -> Fit {
        let known = known.map(|known| known.jacobian.clone());
        let estimate = least_squares::minimise(&self.under(hypothesis), at, known, method);
        Fit::new(hypothesis, estimate)
    }

    /// One Gauss-Newton step of the first quantities, of which derivatives and their normal matrix are known from nearby, where it leads
    /// downhill.
    pub fn step_of_first(&self, fit: Fit, jacobian: &[Vec<f64>], normal: &DMatrix<f64>) -> Fit {
        let (first, rest) = fit.at.split_at(jacobian.len());
        let quantities = &fit.hypothesis.quantities()[..first.len()];
        let gradient = gradient(quantities, first, &fit.residual, jacobian, None);
        let mut at = damped_step(quantities, first, normal, &gradient, SLIGHT_DAMPING);
        at.extend_from_slice(rest);
        let stepped = self.evaluate(&fit.hypothesis, at);
        if stepped.chi_squared < fit.chi_squared {
            stepped
        } else {
            fit
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explain::fixture::{Campaign, hypothesis, record, worm};

    #[test]
    fn the_number_of_threads_changes_nothing() {
        let campaign = Campaign::default();
        let recordings = record(&campaign, None, 1);
        let worm = worm(&recordings, &campaign, &hypothesis(None));
        let problem = FitProblem::with_noise_alone(&worm);
        let nuisances = worm.nuisances();
        let free = Hypothesis::new(&nuisances[..3], &[]);
        let fit_with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let pool = pool.expect("a pool of threads");
            pool.install(|| problem.fit(&free, free.neutral(), None))
        };
        let (one, three) = (fit_with(1), fit_with(3));
        assert_eq!((one.at, one.chi_squared), (three.at, three.chi_squared));
        assert_eq!(one.residual, three.residual);
        assert_eq!(one.jacobian, three.jacobian);
    }
}
