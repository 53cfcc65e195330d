//! Least squares within limits: Levenberg and Marquardt's method on the residuals and the priors together.
//!
//! Every evaluation is a simulation of the whole campaign, so the Jacobian is bought by differences once and then kept up with
//! Broyden's rank-one updates; it is bought anew when it no longer leads downhill. Quantities at a limit that pull outward are
//! held there. Everything is deterministic: which thread computes what does not change it.

use super::hypothesis::Hypothesis;
use super::noise::RunNoise;
use super::parameter::{Free, Nuisance, What};
use super::predict::Scene;
use super::residual::Residual;
use nalgebra::{DMatrix, DVector};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Steps after which a fit that still improves has not converged.
const MAX_STEPS: usize = 40;
/// Steps of a rough fit.
const ROUGH_STEPS: usize = 7;
/// Improvement of the misfit below which a fit has converged, absolute and as a share.
const CONVERGED: (f64, f64) = (0.05, 2e-5);
/// Damping at first, and how it changes after a step that failed or succeeded.
const DAMPING: (f64, f64, f64) = (1e-3, 6.0, 0.25);
/// Damping beyond which no step leads downhill.
const MAX_DAMPING: f64 = 1e6;

/// Residual of a run that the worm could not have made.
const IMPOSSIBLE: f64 = 1e3;
/// Rows of all columns of derivatives that fit the processor's cache together.
const ROWS_AT_ONCE: usize = 512;

/// The campaign with its noise: everything a misfit needs.
pub(super) struct FitProblem<'s, 'a> {
    pub scene: &'s Scene<'a>,
    pub noise: Vec<RunNoise>,
    /// What the recalibrated model's misfit grows by where a periodic crawl is run once and repeated, not run throughout.
    pub repeating_excess: f64,
}

/// A hypothesis fitted.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub hypothesis: Hypothesis,
    pub at: Vec<f64>,
    /// Residuals of all runs, one after the other.
    pub residual: Vec<f64>,
    /// Their derivatives, a column for each free quantity.
    pub jacobian: Vec<Vec<f64>>,
    /// Square sum of the residuals and of what the priors add.
    pub chi_squared: f64,
    pub converged: bool,
}

impl Fit {
    /// Normal matrix of residuals and priors over the rows that count.
    pub fn normal(&self, counts: Option<&[bool]>) -> DMatrix<f64> {
        let count = self.at.len();
        let mut normal = DMatrix::zeros(count, count);
        let rows = self.residual.len();
        for from in (0..rows).step_by(ROWS_AT_ONCE) {
            let part = from..rows.min(from + ROWS_AT_ONCE);
            let counts = counts.map(|counts| &counts[part.clone()]);
            for row in 0..count {
                for column in 0..=row {
                    normal[(row, column)] += dot(
                        &self.jacobian[row][part.clone()],
                        &self.jacobian[column][part.clone()],
                        counts,
                    );
                }
            }
        }
        for row in 0..count {
            for column in 0..row {
                normal[(column, row)] = normal[(row, column)];
            }
            normal[(row, row)] += self.hypothesis.free[row].sigma.powi(-2);
        }
        normal
    }

    /// Gradient of half the misfit over the rows that count.
    pub fn gradient(&self, counts: Option<&[bool]>) -> DVector<f64> {
        DVector::from_iterator(
            self.at.len(),
            (0..self.at.len()).map(|column| {
                let free = &self.hypothesis.free[column];
                dot(&self.jacobian[column], &self.residual, counts)
                    + (self.at[column] - free.centre) * free.sigma.powi(-2)
            }),
        )
    }

    /// Whether a quantity lies at one of its limits.
    pub fn at_limit(&self, quantity: usize) -> bool {
        let free = &self.hypothesis.free[quantity];
        let tolerance = 1e-9 * (free.max - free.min);
        self.at[quantity] <= free.min + tolerance || self.at[quantity] >= free.max - tolerance
    }

    /// Standard errors of all quantities; infinite where nothing is known.
    pub fn sigmas(&self) -> Vec<f64> {
        let count = self.at.len();
        let mut normal = self.normal(None);
        for quantity in 0..count {
            normal[(quantity, quantity)] += 1e-12 * (1.0 + normal[(quantity, quantity)]);
        }
        match normal.cholesky() {
            Some(factor) => {
                let inverse = factor.inverse();
                (0..count)
                    .map(|quantity| inverse[(quantity, quantity)].max(0.0).sqrt())
                    .collect()
            }
            None => vec![f64::INFINITY; count],
        }
    }
}

/// Scalar product over the rows that count.
pub(super) fn dot(a: &[f64], b: &[f64], counts: Option<&[bool]>) -> f64 {
    match counts {
        None => {
            // Eight sums side by side: the order is fixed, and the processor can do them at once.
            let mut sums = [0.0; 8];
            let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
            let rest: f64 = a8.remainder().iter().zip(b8.remainder()).map(|(a, b)| a * b).sum();
            for (a, b) in a8.zip(b8) {
                for lane in 0..8 {
                    sums[lane] += a[lane] * b[lane];
                }
            }
            sums.iter().sum::<f64>() + rest
        }
        Some(counts) => a
            .iter()
            .zip(b)
            .zip(counts)
            .filter(|(_, counts)| **counts)
            .map(|((a, b), _)| a * b)
            .sum(),
    }
}

impl FitProblem<'_, '_> {
    /// Rows of each run, in the vector of all residuals.
    pub fn rows(&self, run: usize) -> std::ops::Range<usize> {
        let length = |run: usize| {
            let observed = &self.scene.observed[run];
            (observed.samples() - observed.counts_from) * (1 + observed.cells())
        };
        let from: usize = (0..run).map(length).sum();
        from..from + length(run)
    }

    /// Residuals of a run under a hypothesis.
    pub fn run_residuals(&self, run: usize, hypothesis: &Hypothesis, at: &[f64]) -> Vec<f64> {
        let observed = &self.scene.observed[run];
        let mut out = Vec::with_capacity(self.rows(run).len());
        match self.scene.predict(run, hypothesis, at) {
            Some(predicted) => self.noise[run].whiten(observed, &Residual::new(observed, &predicted), &mut out),
            None => out.resize(self.rows(run).len(), IMPOSSIBLE),
        }
        out
    }

    /// Residuals of all runs.
    pub fn residuals(&self, hypothesis: &Hypothesis, at: &[f64]) -> Vec<f64> {
        let runs = self.scene.observed.len();
        in_parallel(runs, |run| self.run_residuals(run, hypothesis, at)).concat()
    }

    /// What the misfit of a fit grows by where a periodic crawl is run once and repeated: against the same hypothesis fitted with
    /// every cycle run.
    pub fn repeating_excess(&self, fit: &Fit) -> f64 {
        let throughout = Hypothesis {
            throughout: true,
            ..fit.hypothesis.clone()
        };
        fit.chi_squared - self.fit(&throughout, fit.at.clone(), Some(fit)).chi_squared
    }

    /// What of a fall of the misfit from one fit to another is owed to one being repeated and the other being run throughout.
    pub fn excess_of_repeating(&self, from: &Fit, to: &Fit) -> f64 {
        let repeats = |fit: &Fit| self.scene.physics(0, &fit.hypothesis, &fit.at).0.is_periodic();
        match (repeats(from), repeats(to)) {
            (true, false) => self.repeating_excess,
            (false, true) => -self.repeating_excess,
            _ => 0.0,
        }
    }

    /// Residuals of all runs, on this thread alone.
    pub fn residuals_here(&self, hypothesis: &Hypothesis, at: &[f64]) -> Vec<f64> {
        let runs = 0..self.scene.observed.len();
        runs.flat_map(|run| self.run_residuals(run, hypothesis, at)).collect()
    }

    /// A hypothesis at some values, without derivatives.
    pub fn evaluate(&self, hypothesis: &Hypothesis, at: Vec<f64>) -> Fit {
        let residual = self.residuals(hypothesis, &at);
        Fit {
            chi_squared: dot(&residual, &residual, None) + prior_chi_squared(hypothesis, &at),
            hypothesis: hypothesis.clone(),
            at,
            residual,
            jacobian: Vec::new(),
            converged: false,
        }
    }

    /// Buys the derivatives of some quantities by differences, towards the inside of their limits.
    pub fn compute_jacobian_columns(&self, fit: &mut Fit, quantities: &[usize]) {
        let runs = self.scene.observed.len();
        fit.jacobian.resize(fit.at.len(), Vec::new());
        let tasks: Vec<(usize, usize)> = quantities
            .iter()
            .flat_map(|&quantity| (0..runs).map(move |run| (quantity, run)))
            .collect();
        let pieces = in_parallel(tasks.len(), |task| {
            let (quantity, run) = tasks[task];
            let free = &fit.hypothesis.free[quantity];
            let rows = self.rows(run);
            if matches!(free.what, What::Nuisance(Nuisance::SlopeOf(of)) if of != run) {
                return vec![0.0; rows.len()];
            }
            let step = inward(free, fit.at[quantity]);
            let mut probe = fit.at.clone();
            probe[quantity] += step;
            let mut column = self.run_residuals(run, &fit.hypothesis, &probe);
            for (value, here) in column.iter_mut().zip(&fit.residual[rows]) {
                *value = (*value - here) / step;
            }
            column
        });
        for (at, pieces) in quantities.iter().zip(pieces.chunks(runs)) {
            fit.jacobian[*at] = pieces.concat();
        }
    }

    /// One Gauss-Newton step on the residuals that stay, with the derivatives that are there, on this thread alone; halved until
    /// it leads downhill, and none if it never does.
    pub fn step_without(&self, fit: Fit, stays: &[bool]) -> Fit {
        let chi_squared =
            |fit: &Fit| dot(&fit.residual, &fit.residual, Some(stays)) + prior_chi_squared(&fit.hypothesis, &fit.at);
        let (normal, gradient) = (fit.normal(Some(stays)), fit.gradient(Some(stays)));
        let whole = step(&fit, &normal, &gradient, 1e-6);
        let here = chi_squared(&fit);
        for halved in 0..3 {
            let fraction = 0.5_f64.powi(halved);
            let at: Vec<f64> = fit
                .at
                .iter()
                .zip(&whole)
                .map(|(from, to)| from + fraction * (to - from))
                .collect();
            let residual = self.residuals_here(&fit.hypothesis, &at);
            let trial = Fit {
                chi_squared: dot(&residual, &residual, None) + prior_chi_squared(&fit.hypothesis, &at),
                hypothesis: fit.hypothesis.clone(),
                at,
                residual,
                jacobian: Vec::new(),
                converged: fit.converged,
            };
            if chi_squared(&trial) < here {
                return Fit {
                    jacobian: fit.jacobian,
                    ..trial
                };
            }
        }
        fit
    }

    /// Buys the derivatives of all quantities.
    pub fn buy_all_derivatives(&self, fit: &mut Fit) {
        let all: Vec<usize> = (0..fit.at.len()).collect();
        self.compute_jacobian_columns(fit, &all);
    }

    /// A hypothesis at some values, with derivatives.
    pub fn with_derivatives(&self, hypothesis: &Hypothesis, at: Vec<f64>) -> Fit {
        let mut fit = self.evaluate(hypothesis, at);
        self.buy_all_derivatives(&mut fit);
        fit
    }

    /// Fits from some values. Columns of `known`, a fit nearby, serve as first derivatives of the quantities both have.
    pub fn fit(&self, hypothesis: &Hypothesis, at: Vec<f64>, known: Option<&Fit>) -> Fit {
        self.fit_with(hypothesis, at, known, MAX_STEPS, true)
    }

    /// A few steps of a fit with the derivatives that are there: enough to see what it is worth.
    pub fn fit_roughly(&self, hypothesis: &Hypothesis, at: Vec<f64>, known: &Fit) -> Fit {
        self.fit_with(hypothesis, at, Some(known), ROUGH_STEPS, false)
    }

    fn fit_with(
        &self,
        hypothesis: &Hypothesis,
        at: Vec<f64>,
        known: Option<&Fit>,
        max_steps: usize,
        polishes: bool,
    ) -> Fit {
        let mut fit = self.evaluate(hypothesis, at);
        let quantities = fit.at.len();
        let all: Vec<usize> = (0..quantities).collect();
        let mut fresh = true;
        match known {
            Some(known) => {
                fit.jacobian = known.jacobian.clone();
                fit.jacobian.truncate(known.at.len().min(quantities));
                let missing: Vec<usize> = (fit.jacobian.len()..quantities).collect();
                fresh = false;
                self.compute_jacobian_columns(&mut fit, &missing);
            }
            None => self.compute_jacobian_columns(&mut fit, &all),
        }
        let mut damping = DAMPING.0;
        for _ in 0..max_steps {
            let (normal, gradient) = (fit.normal(None), fit.gradient(None));
            let mut next = None;
            while damping < MAX_DAMPING {
                let probe = step(&fit, &normal, &gradient, damping);
                if probe == fit.at {
                    break;
                }
                let trial = self.evaluate(hypothesis, probe);
                if trial.chi_squared < fit.chi_squared {
                    damping = (damping * DAMPING.2).max(1e-9);
                    next = Some(trial);
                    break;
                }
                damping *= DAMPING.1;
                if !fresh && damping > 1.0 {
                    break;
                }
            }
            let gained = next.as_ref().map_or(0.0, |next| fit.chi_squared - next.chi_squared);
            if let Some(mut next) = next {
                next.jacobian = std::mem::take(&mut fit.jacobian);
                broyden(&mut next, &fit.at, &fit.residual);
                fit = next;
            }
            if gained < CONVERGED.0 + CONVERGED.1 * fit.chi_squared {
                if !polishes {
                    break;
                }
                if fresh {
                    fit.converged = true;
                    break;
                }
                self.compute_jacobian_columns(&mut fit, &all);
                fresh = true;
                damping = DAMPING.0;
            } else {
                fresh = false;
            }
        }
        fit
    }
}

/// What priors add to the misfit.
pub(super) fn prior_chi_squared(hypothesis: &Hypothesis, at: &[f64]) -> f64 {
    let with_value = hypothesis.free.iter().zip(at);
    with_value
        .map(|(free, value)| ((value - free.centre) / free.sigma).powi(2))
        .sum()
}

/// Step of a difference that stays within the limits.
fn inward(free: &Free, at: f64) -> f64 {
    if at + free.step <= free.max {
        free.step
    } else {
        -free.step
    }
}

/// One damped Gauss-Newton step, kept within the limits.
fn step(fit: &Fit, normal: &DMatrix<f64>, gradient: &DVector<f64>, damping: f64) -> Vec<f64> {
    let free = &fit.hypothesis.free;
    let mut held = vec![false; fit.at.len()];
    let mut at = fit.at.clone();
    // Whatever would leave its limits is put to them and held, and the others go their way without it.
    for _ in 0..=fit.at.len() {
        let open: Vec<usize> = (0..fit.at.len()).filter(|&quantity| !held[quantity]).collect();
        if open.is_empty() {
            break;
        }
        let mut matrix = DMatrix::from_fn(open.len(), open.len(), |row, column| normal[(open[row], open[column])]);
        let mut right = DVector::from_fn(open.len(), |row, _| {
            let shifted: f64 = (0..fit.at.len())
                .filter(|&other| held[other])
                .map(|other| normal[(open[row], other)] * (at[other] - fit.at[other]))
                .sum();
            -gradient[open[row]] - shifted
        });
        for row in 0..open.len() {
            matrix[(row, row)] += damping * matrix[(row, row)] + 1e-12;
        }
        let Some(factor) = matrix.cholesky() else {
            return fit.at.clone();
        };
        factor.solve_mut(&mut right);
        let mut any = false;
        for (row, &quantity) in open.iter().enumerate() {
            let to = fit.at[quantity] + right[row];
            if to < free[quantity].min || to > free[quantity].max {
                at[quantity] = to.clamp(free[quantity].min, free[quantity].max);
                held[quantity] = true;
                any = true;
            } else {
                at[quantity] = to;
            }
        }
        if !any {
            break;
        }
    }
    at
}

/// Makes the derivatives right for the step that was just made.
fn broyden(next: &mut Fit, before_at: &[f64], before_residual: &[f64]) {
    let scale: Vec<f64> = next.hypothesis.free.iter().map(|free| free.step).collect();
    let shift: Vec<f64> = next
        .at
        .iter()
        .zip(before_at)
        .map(|(after, before)| after - before)
        .collect();
    let length: f64 = shift
        .iter()
        .zip(&scale)
        .map(|(shift, scale)| (shift / scale).powi(2))
        .sum();
    if length == 0.0 {
        return;
    }
    let mut missed: Vec<f64> = next
        .residual
        .iter()
        .zip(before_residual)
        .map(|(after, before)| after - before)
        .collect();
    for (column, shift) in next.jacobian.iter().zip(&shift) {
        if *shift != 0.0 {
            for (missed, slope) in missed.iter_mut().zip(column) {
                *missed -= slope * shift;
            }
        }
    }
    for ((column, shift), scale) in next.jacobian.iter_mut().zip(&shift).zip(&scale) {
        let fraction = shift / (scale * scale) / length;
        if fraction != 0.0 {
            for (slope, missed) in column.iter_mut().zip(&missed) {
                *slope += fraction * missed;
            }
        }
    }
}

/// Results of independent tasks, in their order, computed by as many threads as the machine has processors.
pub(super) fn in_parallel<T: Send>(tasks: usize, task: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let threads = std::thread::available_parallelism()
        .map_or(1, std::num::NonZero::get)
        .min(tasks);
    if threads <= 1 {
        return (0..tasks).map(task).collect();
    }
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, T)>> = Mutex::new(Vec::with_capacity(tasks));
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    if number >= tasks {
                        break;
                    }
                    let result = task(number);
                    done.lock()
                        .unwrap_or_else(std::sync::PoisonError::into_inner)
                        .push((number, result));
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    done.sort_by_key(|(number, _)| *number);
    done.into_iter().map(|(_, result)| result).collect()
}
