//! The advances, what a hypothesis predicts of them, and its fit.

use super::super::error::ExplainError;
use super::name;
use crate::explain::search::fit::Fit;
use crate::explain::search::hypothesis::Hypothesis;
use crate::explain::worm::nuisance::Nuisance;
use crate::least_squares::{self, Derivatives, LeastSquares, Method, Quantity};
use crate::recording::Advance;
use nalgebra::{DMatrix, DVector};
use worm_estimator::config::Config;
use worm_physics::effect::Setting;
use worm_physics::{Cycle, Physics, Worm, steady_cycle_of};

/// One descent of a fit: the advances are few and quickly computed.
const DESCENT: Method = Method {
    derivatives: Derivatives::EveryStep,
    max_steps: 40,
    converged: (1e-5, 1e-4),
};
/// Descents of a fit at most, and the gain in chi-squared with which they end.
const DESCENTS: usize = 3;
const GAIN: f64 = 0.03;
/// Residual of an advance that the worm could not have made.
const IMPOSSIBLE: f64 = 1e3;
/// Index of a run outside the table, to which no run's slope error applies.
const NEW_RUN: usize = usize::MAX;

/// Advances, and the nominal worm.
pub(super) struct Table<'a> {
    pub advances: &'a [Advance],
    pub worm: Worm,
    settings: Vec<Setting>,
    cycle_s: f64,
}

impl<'a> Table<'a> {
    pub fn new(advances: &'a [Advance], config: &Config) -> Result<Self, ExplainError> {
        let settings = config.effect.iter().map(|effect| effect.setting(config.worm.cells));
        let table = Self {
            advances,
            worm: Worm::try_from(config)?,
            settings: settings.collect::<Result<_, _>>()?,
            cycle_s: config.gait.cycle_s,
        };
        let plain = Hypothesis::default();
        for (run, advance) in advances.iter().enumerate() {
            let (recording, slope_deg) = (name(advance), advance.slope_deg);
            if !(-90.0..=90.0).contains(&slope_deg) {
                return Err(ExplainError::Slope { recording, slope_deg });
            }
            if !(advance.sigma_m > 0.0 && advance.sigma_m.is_finite() && advance.advance_m.is_finite()) {
                return Err(ExplainError::NoSigma { recording });
            }
            if table.predict_m(run, &plain, &[]).is_none() {
                return Err(ExplainError::SlidesDown { recording, slope_deg });
            }
        }
        Ok(table)
    }

    fn physics(&self, run: usize, (slope_deg, payload_kg): (f64, f64), hypothesis: &Hypothesis, at: &[f64]) -> Physics {
        let mut worm = self.worm.clone();
        worm.tilt_rad(slope_deg.to_radians() - worm.slope_rad());
        worm.add_mass_kg(payload_kg);
        for (free, &value) in hypothesis.free.iter().zip(at) {
            if let Some(nuisance) = Nuisance::of(free.what) {
                nuisance.apply(value, run, &mut worm);
            }
        }
        Physics::of(worm).with(&self.settings).with(&hypothesis.settings(at))
    }

    /// Predicted advance of a run, m; none where the worm slides down.
    fn predict_m(&self, run: usize, hypothesis: &Hypothesis, at: &[f64]) -> Option<f64> {
        let advance = &self.advances[run];
        let physics = self.physics(run, (advance.slope_deg, advance.payload_kg), hypothesis, at);
        let outcome = steady_cycle_of(&physics, advance.cycle_s.unwrap_or(self.cycle_s));
        Some(outcome.cycle()?.advance_m * physics.view.scale)
    }

    /// The steady cycle that a fitted model would make on a slope, without payload, and its advance as it would be measured, m; none
    /// where its worm slides down.
    pub fn on_slope(&self, slope_deg: f64, fit: &Fit) -> Option<(Cycle, f64)> {
        let physics = self.physics(NEW_RUN, (slope_deg, 0.0), &fit.hypothesis, &fit.at);
        physics.clamped_worm().check_hold().ok()?;
        let cycle = steady_cycle_of(&physics, self.cycle_s).cycle()?.clone();
        let advance_m = cycle.advance_m * physics.view.scale;
        Some((cycle, advance_m))
    }

    /// Advance of a run by a fitted model, m; `NaN` where it slides down.
    pub fn advance_m(&self, run: usize, fit: &Fit) -> f64 {
        self.predict_m(run, &fit.hypothesis, &fit.at).unwrap_or(f64::NAN)
    }

    /// Mean over the runs of how far the advance is off, m.
    pub fn mean_error_m(&self, fit: &Fit) -> f64 {
        let runs = self.advances.iter().enumerate();
        let off_m = runs.map(|(run, advance)| (self.advance_m(run, fit) - advance.advance_m).abs());
        off_m.sum::<f64>() / self.advances.len() as f64
    }

    /// Whether an effect with some values leaves a steady crawl, with another advance than the nominal one.
    pub fn shows(&self, hypothesis: &Hypothesis, nominal: &Fit, values: &[f64], min_m: f64) -> bool {
        let at = [&nominal.at, values].concat();
        let is_steady = self.physics(NEW_RUN, (0.0, 0.0), hypothesis, &at).is_periodic();
        let changes = |run: usize| {
            self.predict_m(run, hypothesis, &at)
                .is_none_or(|with_m| (with_m - self.advance_m(run, nominal)).abs() > min_m)
        };
        is_steady && (0..self.advances.len()).any(changes)
    }

    /// Chi-squared that an effect with some values would leave after recalibration, to first order about the nominal worm, and the values
    /// of all quantities then; none where the worm slides down.
    pub fn promise(&self, hypothesis: &Hypothesis, nominal: &Fit, values: &[f64]) -> Option<(f64, Vec<f64>)> {
        let mut at = [&nominal.at, values].concat();
        let runs = self.advances.len();
        let left = (0..runs).map(|run| self.residual(run, hypothesis, &at));
        let left = DVector::from_iterator(runs, left);
        if left.amax() >= IMPOSSIBLE {
            return None;
        }
        let slopes = DMatrix::from_fn(runs, nominal.at.len(), |run, quantity| {
            nominal.jacobian[quantity][run] * nominal.hypothesis.free[quantity].quantity.sigma
        });
        let covariance = DMatrix::identity(runs, runs) + &slopes * slopes.transpose();
        let whitened = covariance.cholesky()?.solve(&left);
        for ((at, free), turned) in at
            .iter_mut()
            .zip(&nominal.hypothesis.free)
            .zip(&slopes.tr_mul(&whitened))
        {
            *at = (*at - free.quantity.sigma * turned).clamp(free.quantity.min, free.quantity.max);
        }
        Some((left.dot(&whitened), at))
    }

    /// Residual of one advance, in its standard errors.
    fn residual(&self, run: usize, hypothesis: &Hypothesis, at: &[f64]) -> f64 {
        let advance = &self.advances[run];
        self.predict_m(run, hypothesis, at).map_or(IMPOSSIBLE, |predicted_m| {
            (predicted_m - advance.advance_m) / advance.sigma_m
        })
    }

    fn under<'t>(&'t self, hypothesis: &'t Hypothesis) -> UnderHypothesis<'t> {
        UnderHypothesis {
            table: self,
            hypothesis,
            quantities: hypothesis.quantities(),
        }
    }

    /// A hypothesis at some values, with derivatives.
    pub fn evaluate(&self, hypothesis: &Hypothesis, at: &[f64]) -> Fit {
        let problem = self.under(hypothesis);
        let estimate = least_squares::evaluate(&problem, at.to_vec());
        let all: Vec<usize> = (0..at.len()).collect();
        let jacobian = problem.derivatives(&estimate.at, &estimate.residual, &all);
        Fit {
            jacobian,
            converged: true,
            ..Fit::new(hypothesis, estimate)
        }
    }

    /// Fits every quantity within its limits, from some values. A tip that begins to slide puts a kink into the advance, at which a
    /// descent may end too early, so another starts from there until that gains nothing.
    pub fn fit(&self, hypothesis: &Hypothesis, from: &[f64]) -> Fit {
        let problem = self.under(hypothesis);
        let mut best = least_squares::evaluate(&problem, from.to_vec());
        let mut converged = false;
        for _ in 0..DESCENTS {
            let reached = least_squares::minimise(&problem, best.at.clone(), None, &DESCENT);
            let gained = best.chi_squared - reached.chi_squared;
            converged = reached.converged && gained < GAIN;
            if gained > 0.0 {
                best = reached;
            }
            if converged {
                break;
            }
        }
        Fit {
            converged,
            ..self.evaluate(hypothesis, &best.at)
        }
    }
}

/// The advances' residuals under one hypothesis.
struct UnderHypothesis<'t> {
    table: &'t Table<'t>,
    hypothesis: &'t Hypothesis,
    quantities: Vec<Quantity>,
}

impl LeastSquares for UnderHypothesis<'_> {
    fn quantities(&self) -> &[Quantity] {
        &self.quantities
    }

    fn residuals(&self, at: &[f64]) -> Vec<f64> {
        let runs = 0..self.table.advances.len();
        runs.map(|run| self.table.residual(run, self.hypothesis, at)).collect()
    }

    /// By differences towards the inside of the limits.
    fn derivatives(&self, at: &[f64], residual: &[f64], quantities: &[usize]) -> Vec<Vec<f64>> {
        let column = |&number: &usize| {
            let step = self.quantities[number].inward_step(at[number]);
            let mut probe = at.to_vec();
            probe[number] += step;
            let of_run = |(run, here): (usize, &f64)| match Nuisance::of(self.hypothesis.free[number].what) {
                Some(nuisance) if !nuisance.concerns(run) => 0.0,
                _ => (self.table.residual(run, self.hypothesis, &probe) - here) / step,
            };
            residual.iter().enumerate().map(of_run).collect()
        };
        quantities.iter().map(column).collect()
    }
}
