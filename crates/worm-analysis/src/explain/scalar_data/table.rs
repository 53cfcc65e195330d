//! The scalars, what a hypothesis says of them, and its least-squares fit within limits.
//!
//! A quantity is turned through the sine of an angle, which cannot leave its limits; priors are residuals like any other.

use super::super::error::ExplainError;
use super::super::fit::Fit;
use super::super::hypothesis::Hypothesis;
use super::super::parameter::{Free, Nuisance, What};
use super::name;
use crate::recording::Advance;
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, Owned};
use worm_estimator::config::Config;
use worm_physics::effect::Setting;
use worm_physics::{Cycle, Physics, Worm, steady_cycle_of};

/// Relative change of the misfit, and of the quantities, at which a fit has converged.
const CONVERGED: f64 = 1e-4;
/// Evaluations of a fit, for each quantity, after which it has not.
const PATIENCE: usize = 5;
/// Descents of a fit at most, and the gain in the misfit with which they end.
const DESCENTS: usize = 3;
const GAIN: f64 = 0.03;
/// Share of its reach at which a quantity begins at most.
const WITHIN: f64 = 0.998;
/// Residual of an advance that the worm could not have made.
const IMPOSSIBLE: f64 = 1e3;
/// A run that is none of the table's, to which no run's slope error belongs.
const NEW_RUN: usize = usize::MAX;

/// Advances, and the worm that is believed to have made them.
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
            if table.said(run, &plain, &[]).is_none() {
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
            if let What::Nuisance(nuisance) = free.what {
                nuisance.apply(value, run, &mut worm);
            }
        }
        Physics::of(worm).with(&self.settings).with(&hypothesis.settings(at))
    }

    /// Advance of a run, m; none where the worm slides down.
    fn said(&self, run: usize, hypothesis: &Hypothesis, at: &[f64]) -> Option<f64> {
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
        self.said(run, &fit.hypothesis, &fit.at).unwrap_or(f64::NAN)
    }

    /// Mean over the runs of how far the advance is off, m.
    pub fn mean_error_m(&self, fit: &Fit) -> f64 {
        let runs = self.advances.iter().enumerate();
        let off_m = runs.map(|(run, advance)| (self.advance_m(run, fit) - advance.advance_m).abs());
        off_m.sum::<f64>() / self.advances.len() as f64
    }

    /// Whether an effect with some values leaves a steady crawl, and another advance than the believed one.
    pub fn shows(&self, hypothesis: &Hypothesis, nominal: &Fit, values: &[f64], min_m: f64) -> bool {
        let at = [&nominal.at, values].concat();
        let is_steady = self.physics(NEW_RUN, (0.0, 0.0), hypothesis, &at).is_periodic();
        let changes = |run: usize| {
            self.said(run, hypothesis, &at)
                .is_none_or(|with_m| (with_m - self.advance_m(run, nominal)).abs() > min_m)
        };
        is_steady && (0..self.advances.len()).any(changes)
    }

    /// About the misfit that an effect with some values would leave, were the recalibration to do no more than it does about the
    /// believed worm, and where everything would lie then; none where the worm slides down.
    pub fn promise(&self, hypothesis: &Hypothesis, nominal: &Fit, values: &[f64]) -> Option<(f64, Vec<f64>)> {
        let mut at = [&nominal.at, values].concat();
        let runs = self.advances.len();
        let left = (0..runs).map(|run| self.residual(run, hypothesis, &at));
        let left = DVector::from_iterator(runs, left);
        if left.amax() >= IMPOSSIBLE {
            return None;
        }
        let slopes = DMatrix::from_fn(runs, nominal.at.len(), |run, quantity| {
            nominal.jacobian[quantity][run] * nominal.hypothesis.free[quantity].sigma
        });
        let covariance = DMatrix::identity(runs, runs) + &slopes * slopes.transpose();
        let whitened = covariance.cholesky()?.solve(&left);
        for ((at, free), turned) in at
            .iter_mut()
            .zip(&nominal.hypothesis.free)
            .zip(&slopes.tr_mul(&whitened))
        {
            *at = (*at - free.sigma * turned).clamp(free.min, free.max);
        }
        Some((left.dot(&whitened), at))
    }

    /// What is left of one advance, in its standard errors.
    fn residual(&self, run: usize, hypothesis: &Hypothesis, at: &[f64]) -> f64 {
        let advance = &self.advances[run];
        self.said(run, hypothesis, at)
            .map_or(IMPOSSIBLE, |said_m| (said_m - advance.advance_m) / advance.sigma_m)
    }

    /// Square sum of what is left of the advances, and of what the priors add.
    pub fn chi_squared(&self, hypothesis: &Hypothesis, at: &[f64]) -> f64 {
        let runs = 0..self.advances.len();
        let advances = runs.map(|run| self.residual(run, hypothesis, at));
        let priors = hypothesis.free.iter().zip(at).map(|(free, &value)| prior(free, value));
        advances.chain(priors).map(|left| left * left).sum()
    }

    /// A hypothesis at some values.
    pub fn evaluate(&self, hypothesis: &Hypothesis, at: &[f64]) -> Fit {
        let runs = 0..self.advances.len();
        let residual: Vec<f64> = runs.map(|run| self.residual(run, hypothesis, at)).collect();
        Fit {
            chi_squared: self.chi_squared(hypothesis, at),
            hypothesis: hypothesis.clone(),
            at: at.to_vec(),
            jacobian: self.derivatives(hypothesis, at, &residual),
            residual,
            converged: true,
        }
    }

    /// How the residuals change with each quantity: a column for each, by differences towards the inside of its limits.
    fn derivatives(&self, hypothesis: &Hypothesis, at: &[f64], here: &[f64]) -> Vec<Vec<f64>> {
        let column = |(quantity, free): (usize, &Free)| {
            let inward = at[quantity] + free.step <= free.max;
            let step = if inward { free.step } else { -free.step };
            let mut probe = at.to_vec();
            probe[quantity] += step;
            let of_run = |(run, here): (usize, &f64)| match free.what {
                What::Nuisance(Nuisance::SlopeOf(of)) if of != run => 0.0,
                _ => (self.residual(run, hypothesis, &probe) - here) / step,
            };
            here.iter().enumerate().map(of_run).collect()
        };
        hypothesis.free.iter().enumerate().map(column).collect()
    }

    /// Fits every quantity within its limits, from some values. A tip that begins to slide puts a kink into the advance, at which a
    /// descent may end too early, so it begins anew from there until that gains nothing.
    pub fn fit(&self, hypothesis: &Hypothesis, from: &[f64]) -> Fit {
        let (mut values, mut chi_squared) = (from.to_vec(), self.chi_squared(hypothesis, from));
        let mut converged = false;
        for _ in 0..DESCENTS {
            let (reached, ended) = self.descend(hypothesis, &values);
            let reached_chi_squared = self.chi_squared(hypothesis, &reached);
            let gained = chi_squared - reached_chi_squared;
            if gained > 0.0 {
                (values, chi_squared) = (reached, reached_chi_squared);
            }
            converged = ended && gained < GAIN;
            if converged {
                break;
            }
        }
        Fit {
            converged,
            ..self.evaluate(hypothesis, &values)
        }
    }

    /// One descent, and whether it ended by itself.
    fn descend(&self, hypothesis: &Hypothesis, from: &[f64]) -> (Vec<f64>, bool) {
        let angles = hypothesis
            .free
            .iter()
            .zip(from)
            .map(|(free, &value)| angle(free, value));
        let search = Search {
            angles: DVector::from_iterator(from.len(), angles),
            hypothesis,
            table: self,
        };
        let method = LevenbergMarquardt::new()
            .with_ftol(CONVERGED)
            .with_xtol(CONVERGED)
            .with_patience(PATIENCE);
        let (search, report) = method.minimize(search);
        (search.values(), report.termination.was_successful())
    }
}

/// What a quantity is off the centre of its prior, in standard deviations.
fn prior(free: &Free, value: f64) -> f64 {
    (value - free.centre) / free.sigma
}

fn middle_and_reach(free: &Free) -> (f64, f64) {
    (0.5 * (free.max + free.min), 0.5 * (free.max - free.min))
}

fn angle(free: &Free, value: f64) -> f64 {
    let (middle, reach) = middle_and_reach(free);
    // At a limit the sine has no slope, and nothing would ever move it away.
    ((value - middle) / reach).clamp(-WITHIN, WITHIN).asin()
}

/// A fit under way.
struct Search<'s> {
    table: &'s Table<'s>,
    hypothesis: &'s Hypothesis,
    angles: DVector<f64>,
}

impl Search<'_> {
    fn values(&self) -> Vec<f64> {
        let turned = self.hypothesis.free.iter().zip(&self.angles);
        turned
            .map(|(free, angle)| {
                let (middle, reach) = middle_and_reach(free);
                (middle + reach * angle.sin()).clamp(free.min, free.max)
            })
            .collect()
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Search<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, angles: &DVector<f64>) {
        self.angles.copy_from(angles);
    }

    fn params(&self) -> DVector<f64> {
        self.angles.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let values = self.values();
        let runs = 0..self.table.advances.len();
        let mut rows: Vec<f64> = runs
            .map(|run| self.table.residual(run, self.hypothesis, &values))
            .collect();
        rows.extend(
            self.hypothesis
                .free
                .iter()
                .zip(&values)
                .map(|(free, &value)| prior(free, value)),
        );
        Some(DVector::from_vec(rows))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let values = self.values();
        let runs = self.table.advances.len();
        let here: Vec<f64> = (0..runs)
            .map(|run| self.table.residual(run, self.hypothesis, &values))
            .collect();
        let columns = self.table.derivatives(self.hypothesis, &values, &here);
        let count = values.len();
        Some(DMatrix::from_fn(runs + count, count, |row, quantity| {
            let free = &self.hypothesis.free[quantity];
            let per_value = match row.checked_sub(runs) {
                None => columns[quantity][row],
                Some(of) if of == quantity => free.sigma.recip(),
                Some(_) => 0.0,
            };
            per_value * middle_and_reach(free).1 * self.angles[quantity].cos()
        }))
    }
}
