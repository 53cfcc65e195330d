//! The continuous estimator of the largest tip deformations: theory laid through everything that was seen.
//!
//! The exact model, started with assumed deformations and run with assumed bounds, says how the body goes; what it leaves of
//! the measured way is noise and drift. Levenberg and Marquardt's method finds the bounds, the mass where a slope
//! lets it be seen, and the deformations at the start of each run that leave the least. Unlike the balance of (5) to (7), which
//! looks at forces that follow from noisy positions, it uses all that the bounds cause: when sliding begins, how far the body
//! is pushed back, how far the worm gets. Several runs of one worm share bounds and mass.
//!
//! # What positions cannot tell
//! A tip that never slides backward shows its bound only through the balance, and of several such tips only the sum. Two
//! things help. A worm whose first step the recording shows was probably laid down there with unloaded tips, which makes its
//! first cycle tell them apart: this is assumed where it agrees with the data, and said. And what is left is shared out
//! as evenly as the data allow, with standard errors that say how little is known.
//!
//! # Standard errors
//! They are those of least squares, enlarged where the misfit is more than noise and drift explain. They do not know of effects
//! that the model lacks, but for a small allowance for cams, pads and inertia that are not quite as theory has them.

mod problem;
mod run;

use super::drift::Drift;
use super::gait::IdentifiedGait;
use crate::least_squares::{self, Derivatives, LeastSquares, Method, normal_matrix};
use problem::{BoundsProblem, DAMPING, IMPOSSIBLE};
use worm_physics::{Worm, WormError};

/// Rise of the misfit, beyond one for each cell, up to which a worm counts as laid down.
const LAID_DOWN_MISFIT: f64 = 16.0;
/// Drifts that are tried, as standard deviations after one cycle, m: from `.0` on, each `.1` times the one before.
const DRIFTS: (f64, f64, usize) = (2e-7, 2.0, 14);
/// What a worm with mass, cam and pads of its own was seen to add to the standard error of a bound, m: tests hold the standard
/// errors against such worms.
const SYSTEMATIC_M: f64 = 6e-6;
/// Starting points that are tried at least, and the misfit over what noise and the first drift explain from which no further one
/// is.
const MIN_STARTS: usize = 2;
const GOOD_RATIO: f64 = 1.2;
/// Shares of their difference by which two bounds are moved towards each other, how often all pairs are tried, and what way is
/// worth it, m.
const SHARES: [f64; 3] = [0.5, 0.25, 0.1];
const SHARING_ROUNDS: usize = 3;
const MIN_MOVE_M: f64 = 5e-5;
/// Ways by which bounds are moved at each other's expense to see whether the data mind, m.
const MOVES_M: [f64; 4] = [5e-5, 1e-4, 2e-4, 4e-4];
/// A descent of the fit.
const DESCENT: Method = Method {
    derivatives: Derivatives::EveryStep,
    max_steps: 50,
    converged: (0.0, 1e-6),
};
/// Times that drift and parameters are found from one another.
const ROUNDS: usize = 2;

/// One run of the worm.
#[derive(Debug, Clone, Copy)]
pub struct PositionRun<'a> {
    /// Time of each sample, s.
    pub time_s: &'a [f64],
    /// Its gait.
    pub gait: &'a IdentifiedGait,
    /// Slope of the canal, rad.
    pub slope_rad: f64,
    /// Known extra mass, kg.
    pub payload_kg: f64,
}

/// What was found.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// Largest tip deformations, m.
    pub max_deformation_m: Vec<f64>,
    /// Their standard errors, m.
    pub max_deformation_sigma_m: Vec<f64>,
    /// Mass of the worm without payload, kg, where a run is on a slope.
    pub mass_kg: Option<f64>,
    /// Its standard error, kg.
    pub mass_sigma_kg: Option<f64>,
    /// Damping ratio of the body on its contacts.
    pub damping_ratio: f64,
    /// Misfit over what noise and drift explain: 1 where theory holds.
    pub misfit_ratio: f64,
    /// What was found of each run.
    pub runs: Vec<FittedRun>,
}

/// What was found of one run.
#[derive(Debug, Clone)]
pub struct FittedRun {
    /// The worm in its canal, as found.
    pub worm: Worm,
    /// Deformations at the first sample, m.
    pub start_deformation_m: Vec<f64>,
    /// The tips were laid down unloaded at the start of this run.
    pub laid_down: bool,
    /// Standard deviation that the drift gathers in a cycle, m.
    pub drift_per_cycle_m: f64,
    /// Way of the body by theory at each sample, drift left out, m, from an origin that makes the drift's mean vanish.
    pub theory_m: Vec<f64>,
    /// The drift at each sample, m.
    pub drift_m: Vec<f64>,
}

/// Why there is no fit.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// The configured worm with what was found is none to the model.
    #[error("the model refuses the worm as found: {0}")]
    Worm(#[from] WormError),
    /// No starting point leads to a crawl like the one seen.
    #[error(
        "no largest tip deformations make the configured worm crawl as recorded: are slope, mass and stiffness right?"
    )]
    NoCrawl,
}

/// Fits all runs together. `base` is the configured worm, `starts_m` are bounds to begin the search from, best guess first;
/// `progress` is called with the share done.
///
/// # Errors
/// [`FitError`].
pub fn fit(
    base: &Worm,
    runs: &[PositionRun<'_>],
    starts_m: &[Vec<f64>],
    progress: &mut dyn FnMut(f64),
) -> Result<Fitted, FitError> {
    let mut problem = BoundsProblem::new(base, runs)?;
    let rounds = (1 + ROUNDS + runs.len()) as f64;
    let mut done = 0.0;
    let mut step = || {
        done += 1.0;
        progress(done / rounds);
    };
    let parameters = problem.search(starts_m)?;
    step();
    problem.set(parameters);
    for _ in 0..ROUNDS {
        problem.find_drift();
        problem.minimise();
        step();
    }
    problem.share_out();
    for run in 0..runs.len() {
        problem.try_laid_down(run);
        step();
    }
    problem.finish()
}

impl<'a> BoundsProblem<'a> {
    /// Searches from the starting points, those first that promise most, until one leads to what noise explains; else from all.
    fn search(&mut self, starts_m: &[Vec<f64>]) -> Result<Vec<f64>, FitError> {
        let mut starts: Vec<(f64, Vec<f64>)> = Vec::with_capacity(starts_m.len());
        for start_m in starts_m {
            self.begin_at(start_m);
            starts.push((self.data_misfit(), self.parameters.clone()));
        }
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut best: Option<(f64, Vec<f64>)> = None;
        for (tried, (_, start)) in starts.into_iter().enumerate() {
            if tried >= MIN_STARTS && best.is_some() && self.misfit_ratio() < GOOD_RATIO {
                break;
            }
            self.set(start);
            let chi_squared = self.minimise();
            if chi_squared < IMPOSSIBLE * IMPOSSIBLE && best.as_ref().is_none_or(|(min, _)| chi_squared < *min) {
                best = Some((chi_squared, self.parameters.clone()));
            }
        }
        best.map(|(_, parameters)| parameters).ok_or(FitError::NoCrawl)
    }

    /// Begins a search with these bounds.
    fn begin_at(&mut self, bounds_m: &[f64]) {
        let cells = self.cells();
        for (cell, bound_m) in bounds_m.iter().enumerate() {
            self.parameters[cell] = bound_m.ln();
        }
        if self.with_mass {
            let mass_at = self.mass_at();
            self.parameters[mass_at] = self.base.mass_kg().ln();
        }
        self.parameters[cells] = DAMPING.0.ln();
        for run in 0..self.runs.len() {
            let first = self.first_start(run);
            let start_m = match self.worm(run, &self.parameters) {
                Ok(worm) => self.runs[run].likely_start_m(&worm),
                Err(_) => vec![0.0; cells],
            };
            for (cell, deformation_m) in start_m.iter().enumerate() {
                self.parameters[first + cell] = deformation_m * 1e3;
            }
        }
    }

    /// Minimises the misfit from where the parameters are; returns it.
    fn minimise(&mut self) -> f64 {
        let estimate = least_squares::minimise(self, self.parameters.clone(), None, &DESCENT);
        self.parameters = estimate.at;
        if estimate.chi_squared.is_finite() {
            estimate.chi_squared
        } else {
            f64::INFINITY
        }
    }

    /// Takes the drift that makes the present misfit of each run most likely.
    fn find_drift(&mut self) {
        for run in 0..self.runs.len() {
            let Some(rest_m) = self.rest_m(run, &self.parameters) else {
                continue;
            };
            let data = &mut self.runs[run];
            let likeliest = (0..DRIFTS.2)
                .map(|at| {
                    let per_cycle_m = DRIFTS.0 * DRIFTS.1.powi(at as i32);
                    let drift = Drift::new(&data.run.gait.phase, &data.variance_m2, per_cycle_m * per_cycle_m);
                    (drift.chi_squared(rest_m.iter().copied()), drift)
                })
                .min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((_, drift)) = likeliest {
                data.drift = drift;
            }
        }
    }

    /// Moves bounds towards each other in pairs as far as the data do not mind. Of tips that never slide backward the data know
    /// only the sum, and the search ends anywhere among all ways to share it out, often where one of them would just begin to
    /// slide.
    fn share_out(&mut self) {
        let allowed = self.data_misfit() + self.misfit_ratio().max(1.0);
        let cells = self.cells();
        for (one, other) in (0..SHARING_ROUNDS).flat_map(|_| pairs(cells)) {
            let bounds_m = self.bounds_m(&self.parameters);
            for fraction in SHARES {
                let displacement_m = fraction * (bounds_m[other] - bounds_m[one]);
                if displacement_m.abs() < MIN_MOVE_M {
                    break;
                }
                let probe = self.moved(one, other, displacement_m);
                if self.misfit_at(&probe) < allowed {
                    self.set(probe);
                    break;
                }
            }
        }
    }

    /// How far each bound can be moved at another's expense without the data minding, m.
    fn free_ways_m(&self) -> Vec<f64> {
        let allowed = self.data_misfit() + self.misfit_ratio().max(1.0);
        let bounds_m = self.bounds_m(&self.parameters);
        let mut free_m = vec![0.0_f64; self.cells()];
        for (one, other) in pairs(self.cells()) {
            for sign in [1.0, -1.0] {
                for displacement_m in MOVES_M {
                    let displacement_m = sign * displacement_m;
                    let possible = bounds_m[one] + displacement_m > 0.0 && bounds_m[other] - displacement_m > 0.0;
                    if !possible || self.misfit_at(&self.moved(one, other, displacement_m)) >= allowed {
                        break;
                    }
                    free_m[one] = free_m[one].max(displacement_m.abs());
                    free_m[other] = free_m[other].max(displacement_m.abs());
                }
            }
        }
        free_m
    }

    /// The parameters with one bound larger by `displacement_m` and another smaller. A tip that never slides backward has a deformation
    /// larger by as much all the time, from the start.
    fn moved(&self, one: usize, other: usize, displacement_m: f64) -> Vec<f64> {
        let mut moved = self.parameters.clone();
        for (cell, displacement_m) in [(one, displacement_m), (other, -displacement_m)] {
            moved[cell] = (self.parameters[cell].exp() + displacement_m).ln();
            for run in 0..self.runs.len() {
                if !self.runs[run].laid_down {
                    moved[self.first_start(run) + cell] += displacement_m * 1e3;
                }
            }
        }
        moved
    }

    /// Assumes that the worm was laid down at the start of a run, and keeps to it if the data agree.
    fn try_laid_down(&mut self, run: usize) {
        if !self.runs[run].at_begin {
            return;
        }
        let (free, free_misfit) = (self.parameters.clone(), self.data_misfit());
        self.runs[run].laid_down = true;
        let first = self.first_start(run);
        for (cell, deformation_m) in self.laid_down_start_m(run, &self.parameters).into_iter().enumerate() {
            self.parameters[first + cell] = deformation_m * 1e3;
        }
        self.minimise();
        let allowed = (LAID_DOWN_MISFIT + self.cells() as f64) * self.misfit_ratio().max(1.0);
        self.runs[run].laid_down = self.data_misfit() - free_misfit < allowed;
        if !self.runs[run].laid_down {
            self.set(free);
        }
    }

    /// What a systematic error of all bounds does to the mass, kg: least on the steepest run.
    fn mass_systematic_kg(&self) -> f64 {
        let squares: f64 = self
            .base
            .contacts()
            .iter()
            .map(|contact| contact.stiffness_n_per_m.powi(2))
            .sum();
        let steepest = self
            .runs
            .iter()
            .map(|data| data.worm.slope_rad().sin().abs())
            .fold(0.0, f64::max);
        squares.sqrt() * SYSTEMATIC_M / (self.base.gravity_m_per_s2() * steepest)
    }

    fn finish(self) -> Result<Fitted, FitError> {
        let ratio = self.misfit_ratio();
        let normal = normal_matrix(self.quantities(), &self.flatter_jacobian(), None);
        let covariance = normal.cholesky().map(|factor| factor.inverse() * ratio.max(1.0));
        let sigma = |at: usize| {
            covariance
                .as_ref()
                .map_or(f64::NAN, |covariance| covariance[(at, at)].sqrt())
        };
        let at = &self.parameters;
        let bounds_m = self.bounds_m(at);
        let free_m = self.free_ways_m();
        let mut runs = Vec::with_capacity(self.runs.len());
        for run in 0..self.runs.len() {
            let (Some(mut theory_m), Some(rest_m)) = (self.theory_m(run, at), self.rest_m(run, at)) else {
                return Err(FitError::NoCrawl);
            };
            let data = &self.runs[run];
            let mut drift_m = data.drift.smooth(&rest_m);
            let mean_m = drift_m.iter().sum::<f64>() / drift_m.len().max(1) as f64;
            theory_m.iter_mut().for_each(|displacement_m| *displacement_m += mean_m);
            drift_m.iter_mut().for_each(|displacement_m| *displacement_m -= mean_m);
            runs.push(FittedRun {
                worm: self.worm(run, at)?,
                start_deformation_m: self.start_m(run, at),
                laid_down: data.laid_down,
                drift_per_cycle_m: data.drift.per_cycle_m2().sqrt(),
                theory_m,
                drift_m,
            });
        }
        Ok(Fitted {
            max_deformation_sigma_m: bounds_m
                .iter()
                .enumerate()
                .map(|(cell, bound_m)| (bound_m * sigma(cell)).hypot(SYSTEMATIC_M).max(free_m[cell]))
                .collect(),
            max_deformation_m: bounds_m,
            mass_kg: self.with_mass.then(|| self.mass_kg(at)),
            mass_sigma_kg: self
                .with_mass
                .then(|| (self.mass_kg(at) * sigma(self.mass_at())).hypot(self.mass_systematic_kg())),
            damping_ratio: self.damping_ratio(at),
            misfit_ratio: ratio,
            runs,
        })
    }
}

/// All pairs of cells.
fn pairs(cells: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..cells).flat_map(move |first| (first + 1..cells).map(move |second| (first, second)))
}
