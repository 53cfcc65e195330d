//! The fit as a problem of least squares: parameters, residuals, Jacobian.

use super::run::{RunData, common_deformation_m};
use super::{FitError, PositionRun};
use crate::least_squares::{LeastSquares, Quantity, dot};
use rayon::prelude::*;
use worm_physics::{Worm, WormError};

/// Spread of the bounds of one worm about their common mean, as a share: what shares out that which the data do not tell.
const BOUND_SPREAD: f64 = 0.5;
/// Standard deviation of the configured mass, as a share.
const MASS_SPREAD: f64 = 0.1;
/// Damping ratio that the search begins with, and the standard deviation of its logarithm.
pub(super) const DAMPING: (f64, f64) = (0.5, 1.5);
/// Standard deviation of a tip's deformation at the start of a run of which nothing is known, m, and of a tip laid down.
const START_SPREAD_M: (f64, f64) = (1.5e-3, 2e-5);
/// Steps of the numerical derivatives: of the logarithms of bounds and mass, and of the deformations at the start, mm.
const DIFFERENCES: (f64, f64) = (2e-3, 4e-3);
/// How much wider the differences are by which standard errors are found.
const WIDE: f64 = 5.0;
/// Residual of a run that the worm could not have made.
pub(super) const IMPOSSIBLE: f64 = 1e3;

/// How the parameters lie in their vector: logarithms of the bounds, of the damping ratio, and of the mass where it can be
/// seen, then each run's deformations at the start in mm.
pub(super) struct BoundsProblem<'a> {
    pub base: Worm,
    pub runs: Vec<RunData<'a>>,
    pub with_mass: bool,
    pub parameters: Vec<f64>,
    quantities: Vec<Quantity>,
}

impl<'a> BoundsProblem<'a> {
    pub(super) fn new(base: &Worm, runs: &[PositionRun<'a>]) -> Result<Self, FitError> {
        let cells = base.cells();
        let runs: Vec<RunData<'a>> = runs
            .iter()
            .map(|run| RunData::new(base, *run))
            .collect::<Result<_, WormError>>()?;
        let with_mass = runs.iter().any(|run| run.worm.slope_rad() != 0.0);
        let shared = cells + 1 + usize::from(with_mass);
        let count = shared + cells * runs.len();
        Ok(Self {
            base: base.clone(),
            with_mass,
            parameters: vec![0.0; count],
            quantities: (0..count)
                .map(|parameter| {
                    Quantity::unlimited(if parameter < shared {
                        DIFFERENCES.0
                    } else {
                        DIFFERENCES.1
                    })
                })
                .collect(),
            runs,
        })
    }

    pub(super) fn cells(&self) -> usize {
        self.base.cells()
    }

    pub(super) fn first_start(&self, run: usize) -> usize {
        self.cells() * (1 + run) + 1 + usize::from(self.with_mass)
    }

    /// Where the mass stands, when it can be seen.
    pub(super) fn mass_at(&self) -> usize {
        self.cells() + 1
    }

    pub(super) fn damping_ratio(&self, at: &[f64]) -> f64 {
        at[self.cells()].exp()
    }

    pub(super) fn mass_kg(&self, at: &[f64]) -> f64 {
        if self.with_mass {
            at[self.mass_at()].exp()
        } else {
            self.base.mass_kg()
        }
    }

    pub(super) fn bounds_m(&self, at: &[f64]) -> Vec<f64> {
        at.iter().take(self.cells()).map(|log| log.exp()).collect()
    }

    pub(super) fn set(&mut self, parameters: Vec<f64>) {
        self.parameters = parameters;
    }

    /// The worm of a run with some parameters.
    pub(super) fn worm(&self, run: usize, at: &[f64]) -> Result<Worm, WormError> {
        let data = &self.runs[run];
        data.worm
            .clone()
            .with_max_deformations_m(&self.bounds_m(at))?
            .with_mass_kg(self.mass_kg(at) + data.run.payload_kg)
    }

    /// What theory leaves of the measured way of a run, m; none where the worm could not have made it.
    pub(super) fn rest_m(&self, run: usize, at: &[f64]) -> Option<Vec<f64>> {
        let theory_m = self.theory_m(run, at)?;
        let measured_m = &self.runs[run].run.gait.body_m;
        Some(
            measured_m
                .iter()
                .zip(theory_m)
                .map(|(measured, theory)| measured - theory)
                .collect(),
        )
    }

    /// Way of the body by theory at every sample of a run, m.
    pub(super) fn theory_m(&self, run: usize, at: &[f64]) -> Option<Vec<f64>> {
        let worm = self.worm(run, at).ok()?;
        self.runs[run].displacement_m(&worm, &self.start_m(run, at), self.damping_ratio(at))
    }

    pub(super) fn start_m(&self, run: usize, at: &[f64]) -> Vec<f64> {
        let first = self.first_start(run);
        (0..self.cells()).map(|cell| at[first + cell] * 1e-3).collect()
    }

    /// Deformations of tips that were laid down unloaded and gave way together, m.
    pub(super) fn laid_down_start_m(&self, run: usize, at: &[f64]) -> Vec<f64> {
        match self.worm(run, at) {
            Ok(worm) => vec![common_deformation_m(&worm); worm.cells()],
            Err(_) => vec![0.0; self.cells()],
        }
    }

    /// Square sum of the surprises alone.
    pub(super) fn data_misfit(&self) -> f64 {
        self.misfit_at(&self.parameters)
    }

    /// Square sum of the surprises with other parameters.
    pub(super) fn misfit_at(&self, at: &[f64]) -> f64 {
        let mut surprises = Vec::with_capacity(self.rows());
        for run in 0..self.runs.len() {
            self.surprises(run, at, &mut surprises);
        }
        surprises.iter().map(|surprise| surprise * surprise).sum()
    }

    /// Mean square of the surprises.
    pub(super) fn misfit_ratio(&self) -> f64 {
        let seen = |data: &RunData<'_>| data.variance_m2.iter().filter(|variance| variance.is_finite()).count();
        let samples: usize = self.runs.iter().map(seen).sum();
        self.data_misfit() / (samples.saturating_sub(self.parameters.len()).max(1)) as f64
    }

    pub(super) fn rows(&self) -> usize {
        self.runs.iter().map(|data| data.variance_m2.len()).sum::<usize>() + self.parameters.len()
    }

    /// Appends the surprises of a run.
    pub(super) fn surprises(&self, run: usize, at: &[f64], out: &mut Vec<f64>) {
        let data = &self.runs[run];
        match self.rest_m(run, at) {
            Some(rest_m) => data.drift.whiten(rest_m, |surprise| out.push(surprise)),
            None => out.extend(std::iter::repeat_n(IMPOSSIBLE, data.variance_m2.len())),
        }
    }

    /// Appends what the parameters should be like before the data are asked, each in standard deviations, in their order.
    pub(super) fn expectations(&self, at: &[f64], out: &mut Vec<f64>) {
        let cells = self.cells();
        let mean = at[..cells].iter().sum::<f64>() / cells as f64;
        out.extend((0..cells).map(|cell| (at[cell] - mean) / BOUND_SPREAD));
        out.push((at[cells] - DAMPING.0.ln()) / DAMPING.1);
        if self.with_mass {
            out.push((at[self.mass_at()] - self.base.mass_kg().ln()) / MASS_SPREAD);
        }
        for run in 0..self.runs.len() {
            let expected_m = self.laid_down_start_m(run, at);
            let spread_m = if self.runs[run].laid_down {
                START_SPREAD_M.1
            } else {
                START_SPREAD_M.0
            };
            let start_m = self.start_m(run, at);
            out.extend(
                start_m
                    .iter()
                    .zip(expected_m)
                    .map(|(start, expected)| (start - expected) / spread_m),
            );
        }
    }

    /// Residuals of the runs that a parameter concerns, all for none; zeros in the place of the others.
    pub(super) fn residuals_at(&self, at: &[f64], parameter: Option<usize>) -> Vec<f64> {
        let mut all = Vec::with_capacity(self.rows());
        for (run, data) in self.runs.iter().enumerate() {
            let first = self.first_start(run);
            let shared = self.first_start(0);
            if parameter
                .is_none_or(|parameter| parameter < shared || (first..first + self.cells()).contains(&parameter))
            {
                self.surprises(run, at, &mut all);
            } else {
                all.extend(std::iter::repeat_n(0.0, data.variance_m2.len()));
            }
        }
        self.expectations(at, &mut all);
        all
    }

    /// The residuals with a parameter's value increased and decreased by a step.
    fn sides(&self, at: &[f64], parameter: usize, step: f64) -> [Vec<f64>; 2] {
        [step, -step].map(|step| {
            let mut probe = at.to_vec();
            probe[parameter] = at[parameter] + step;
            self.residuals_at(&probe, Some(parameter))
        })
    }

    /// The Jacobian by the flatter of both sides. Where a tip just begins to slide backward, its bound shows on one side only, and
    /// a standard error must not rest on that side.
    pub(super) fn flatter_jacobian(&self) -> Vec<Vec<f64>> {
        let at = &self.parameters;
        let column = |parameter: usize| {
            let step = WIDE * self.quantities[parameter].step;
            let here = self.residuals_at(at, Some(parameter));
            let [above, below] = self.sides(at, parameter, step);
            let above = slope(&above, &here, step);
            let below = slope(&here, &below, step);
            if dot(&above, &above, None) < dot(&below, &below, None) {
                above
            } else {
                below
            }
        };
        (0..at.len()).into_par_iter().map(column).collect()
    }
}

/// How much residuals change over a width, each.
fn slope(to: &[f64], from: &[f64], width: f64) -> Vec<f64> {
    to.iter().zip(from).map(|(to, from)| (to - from) / width).collect()
}

impl LeastSquares for BoundsProblem<'_> {
    fn quantities(&self) -> &[Quantity] {
        &self.quantities
    }

    /// What the parameters should be like before the data are seen is among the residuals.
    fn residuals(&self, at: &[f64]) -> Vec<f64> {
        self.residuals_at(at, None)
    }

    fn derivatives(&self, at: &[f64], _residual: &[f64], quantities: &[usize]) -> Vec<Vec<f64>> {
        let column = |&parameter: &usize| {
            let step = self.quantities[parameter].step;
            let [above, below] = self.sides(at, parameter, step);
            slope(&above, &below, 2.0 * step)
        };
        quantities.par_iter().map(column).collect()
    }
}
