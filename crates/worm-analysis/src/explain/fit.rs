//! A campaign as a problem of least squares, and hypotheses fitted to it.
//!
//! The rows are the mean residuals of each bin (see [`super::bins`]), whitened by the noise and by the discrepancy, so that the square
//! sum of a fit is minus twice its log likelihood with both marginalised.
//!
//! Every evaluation simulates the whole campaign, so the derivatives are computed by differences once and then updated; they are
//! computed again when they no longer lead downhill (see [`crate::least_squares`]).

use super::bins::Bins;
use super::discrepancy::Discrepancy;
use super::hypothesis::Hypothesis;
use super::noise::RunNoise;
use super::observed::Observed;
use super::parameter::{Nuisance, Onset, What};
use super::plant::Plant;
use super::predict::Scene;
use super::predicted::Predicted;
use super::residual::Residual;
use crate::least_squares::{
    self, Derivatives, Estimate, LeastSquares, Method, Quantity, damped_step, dot, gradient, normal_matrix,
    prior_chi_squared, standard_errors, submatrix,
};
use nalgebra::{DMatrix, DVector};
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
    /// Of each run.
    pub bins: Vec<Bins>,
    /// Of each run.
    pub noise: Vec<RunNoise>,
    /// None before it is known, for the noise comes first.
    pub discrepancy: Option<Discrepancy>,
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

    fn derivatives(&self, at: &[f64], _residual: &[f64], quantities: &[usize]) -> Vec<Vec<f64>> {
        self.problem.derivatives(self.hypothesis, at, quantities)
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
        let length = |run: usize| self.bins[run].len() * (1 + self.scene.observed[run].cells());
        let from: usize = (0..run).map(length).sum();
        from..from + length(run)
    }

    /// The bin that each row is in, as run and number in the run.
    pub fn bin_of_rows(&self) -> Vec<(usize, usize)> {
        let mut rows = Vec::new();
        for (run, bins) in self.bins.iter().enumerate() {
            rows.extend((0..bins.len()).map(|bin| (run, bin)));
            for bin in 0..bins.len() {
                rows.extend(std::iter::repeat_n((run, bin), self.scene.observed[run].cells()));
            }
        }
        rows
    }

    /// Residuals of a run under a hypothesis, whitened by the noise alone.
    fn run_residuals(&self, run: usize, hypothesis: &Hypothesis, at: &[f64]) -> Vec<f64> {
        self.of_prediction(run, self.scene.predict(run, hypothesis, at).as_ref())
    }

    fn of_prediction(&self, run: usize, predicted: Option<&Predicted>) -> Vec<f64> {
        let rows = self.rows(run).len();
        let mut out = Vec::with_capacity(rows);
        match predicted {
            Some(predicted) => {
                let residual = Residual::binned(&self.scene.observed[run], &self.bins[run], predicted);
                self.noise[run].whiten(&residual, &mut out);
            }
            None => out.resize(rows, IMPOSSIBLE),
        }
        out
    }

    /// Residuals of all runs, whitened by the noise alone, and the advance that a cycle of each is predicted to make, m; `NaN` where the
    /// worm could not have made it.
    pub fn residuals_and_advances(&self, hypothesis: &Hypothesis, at: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let of_run = |run: usize| {
            let predicted = self.scene.predict(run, hypothesis, at);
            let advance_m = predicted
                .as_ref()
                .map_or(f64::NAN, |predicted| predicted.advance_m(&self.scene.observed[run]));
            (self.of_prediction(run, predicted.as_ref()), advance_m)
        };
        let runs = (0..self.scene.observed.len()).into_par_iter();
        let (rows, advances_m): (Vec<Vec<f64>>, Vec<f64>) = runs.map(of_run).unzip();
        (rows.concat(), advances_m)
    }

    /// The advance that a cycle of each run is predicted to make, m.
    pub fn advances_m(&self, hypothesis: &Hypothesis, at: &[f64]) -> Vec<f64> {
        let advance_m = |run: usize| {
            let predicted = self.scene.predict(run, hypothesis, at);
            predicted.map_or(f64::NAN, |predicted| predicted.advance_m(&self.scene.observed[run]))
        };
        (0..self.scene.observed.len()).into_par_iter().map(advance_m).collect()
    }

    /// Standard deviations of the advances that a fit with derivatives predicts, m.
    pub fn advance_sigmas_m(&self, fit: &Fit) -> Vec<f64> {
        let here_m = self.advances_m(&fit.hypothesis, &fit.at);
        let changes: Vec<Vec<f64>> = (0..fit.at.len())
            .map(|quantity| {
                let step = fit.hypothesis.free[quantity].quantity.inward_step(fit.at[quantity]);
                let mut probe = fit.at.clone();
                probe[quantity] += step;
                let there_m = self.advances_m(&fit.hypothesis, &probe);
                here_m
                    .iter()
                    .zip(&there_m)
                    .map(|(here, there)| (there - here) / step)
                    .collect()
            })
            .collect();
        let of_run = |run: usize| fit.sigma_of(&changes.iter().map(|change| change[run]).collect::<Vec<f64>>());
        (0..here_m.len()).map(of_run).collect()
    }

    /// The largest relative change from some advances to others: relative to the advance, or to a quarter of the stroke where the
    /// worm hardly advances.
    pub fn impact(&self, from_m: &[f64], to_m: &[f64]) -> f64 {
        let change = |((run, from_m), to_m): ((usize, &f64), &f64)| {
            let stroke_m = self.scene.nominal[run].worm.stroke_m();
            (to_m - from_m).abs() / from_m.abs().max(0.25 * stroke_m)
        };
        from_m.iter().enumerate().zip(to_m).map(change).fold(0.0, f64::max)
    }

    /// Residuals of all runs, whitened by the noise alone.
    pub fn without_discrepancy(&self, hypothesis: &Hypothesis, at: &[f64]) -> Vec<f64> {
        let runs = (0..self.scene.observed.len()).into_par_iter();
        let residuals: Vec<Vec<f64>> = runs.map(|run| self.run_residuals(run, hypothesis, at)).collect();
        residuals.concat()
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
    fn derivatives(&self, hypothesis: &Hypothesis, at: &[f64], quantities: &[usize]) -> Vec<Vec<f64>> {
        if quantities.is_empty() {
            return Vec::new();
        }
        let here = self.without_discrepancy(hypothesis, at);
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
            for (value, here) in column.iter_mut().zip(&here[rows]) {
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

    /// A change of the residuals, whitened by the noise alone, that begins or ends at some time: 0 where it does not act, and the
    /// relative positions about their means again.
    pub fn within_onset(&self, change: &[f64], onset: &Onset) -> Vec<f64> {
        let mut acting = vec![0.0; change.len()];
        for (run, bins) in self.bins.iter().enumerate() {
            let from = bins.start_phase + onset.cycle;
            let first = bins.bins.partition_point(|bin| bin.phase < from);
            let rows = self.rows(run);
            let (count, cells) = (bins.len(), self.scene.observed[run].cells());
            let acts = match (onset.acts_at_start(run), onset.acts_at_end(run)) {
                (false, false) => continue,
                (true, true) => 0..count,
                (true, false) => 0..first,
                (false, true) => first..count,
            };
            let of_body = rows.start + acts.start..rows.start + acts.end;
            acting[of_body.clone()].copy_from_slice(&change[of_body]);
            let relative = rows.start + count..rows.end;
            let of_cells = relative.start + acts.start * cells..relative.start + acts.end * cells;
            acting[of_cells.clone()].copy_from_slice(&change[of_cells]);
            for cell in 0..cells {
                let mut of_cell: Vec<&mut f64> =
                    acting[relative.clone()].iter_mut().skip(cell).step_by(cells).collect();
                let mean = of_cell.iter().map(|row| **row).sum::<f64>() / count as f64;
                of_cell.iter_mut().for_each(|row| **row -= mean);
            }
        }
        acting
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
        let repeats = |fit: &Fit| self.scene.repeats(0, &fit.hypothesis, &fit.at);
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

impl Plant for FitProblem<'_, '_> {
    fn runs(&self) -> usize {
        self.scene.observed.len()
    }

    fn cells(&self) -> usize {
        self.scene.observed.first().map_or(0, Observed::cells)
    }

    fn condition(&self, run: usize) -> f64 {
        self.scene.observed[run].run.slope_deg.to_radians().sin()
    }

    fn bins(&self, run: usize) -> &Bins {
        &self.bins[run]
    }

    fn rows_of(&self, run: usize, pattern_m: &[f64]) -> Vec<f64> {
        let mut rows = Vec::with_capacity(self.rows(run).len());
        let residual = Residual::of_pattern(&self.scene.observed[run], &self.bins[run], pattern_m);
        self.noise[run].whiten(&residual, &mut rows);
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{Campaign, hypothesis, problem, record, scene};
    use super::*;

    #[test]
    fn the_number_of_threads_changes_nothing() {
        let campaign = Campaign::default();
        let recordings = record(&campaign, None, 1);
        let scene = scene(&recordings, &campaign);
        let problem = problem(&scene, &hypothesis(None));
        let nuisances = Nuisance::all(4, 2, true);
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
