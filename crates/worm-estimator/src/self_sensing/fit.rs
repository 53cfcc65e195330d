//! Fits worm and gears to the mean torque profile, cycle by cycle.
//!
//! # What is minimised
//! With the mean profile ȳ of N cycles (older ones forgotten), the model h(θ) and what is known before, θ₀ with information Λ:
//! W Σ_b w_b (ȳ_b − h_b)²/R + (θ − θ₀)ᵀ Λ (θ − θ₀), by Gauss-Newton steps with damping. It runs on from where the last cycle left it, so
//! a cycle needs one or two steps.
//!
//! # In small pieces
//! A cycle takes some hundred evaluations of the model, and more than a thousand where everything is searched. The estimator must not
//! be late, so [`Fit::take`] only says what is to be done, and each [`Fit::step`] does one evaluation, or one piece of algebra that takes no longer;
//! an evaluation whose crawl is long in becoming periodic takes several.
//!
//! [`work`] is the order of these pieces, [`linearise`] and [`descent`] a Gauss-Newton step, [`search`] the place where this begins,
//! [`uncertainty`] the standard errors. [`before`] keeps the worm before it changed.

mod before;
mod descent;
mod linearise;
mod search;
mod uncertainty;
mod work;

use super::SelfSensingConfig;
use super::gear::{GearModel, MAX_RIPPLES};
use super::leading;
use super::model::{CycleFigures, CycleModel, FIGURES};
use super::parameters::{MAX_UNKNOWNS, Matrix, Parameters, Vector};
use super::pitch::MeasuredPull;
use super::profile::{BINS_PER_STEP, MAX_BINS, Profile};
use before::Before;
use linearise::{Linearisation, dot};
use std::f64::consts::{PI, TAU};
use std::task::Poll;
use uncertainty::Slopes;
use work::Work;
use worm_physics::{MAX_CELLS, Worm};

/// Damping of the pads makes the force of a loading cell lead by damping over stiffness, s: what is assumed, and its standard deviation.
const LEAD_S: [f64; 2] = [0.008, 0.005];
/// Torque that no profile is sure of, N m: rounding of the current, speed within a bin.
const FLOOR_N_M: f64 = 3e-4;
/// Weight of the bins on either side of the jump from one step to the next: readings are a tick apart, the jump is not.
const FIRST_BIN_WEIGHTS: [f64; 2] = [0.01, 0.3];
const LAST_BIN_WEIGHT: f64 = 0.02;
/// Standard deviation of the mean ln friction of all cells, which lie in one canal: about what is stated, and of a worm that has changed, in a canal
/// that may be wet.
const COMMON_FRICTION_SIGMAS: [f64; 2] = [0.4, 1.0];
/// Finite differences: of a logarithm of friction, of stiffness, and of the pull, N.
const STEPS: [f64; 3] = [0.01, 0.02, 0.03];
/// Cycles after which everything is searched anew, because the mean profile has become much better.
const SEARCHED_ANEW: f64 = 3.0;

/// Means of each ripple's sine and cosine over each bin.
type Ripples = [[(f64, f64); MAX_BINS]; MAX_RIPPLES];

/// By how much the unknowns differ in one cycle.
#[derive(Debug, Clone, Copy)]
pub(super) struct CycleChange {
    /// The differences.
    pub(super) by: Vector,
    /// Their standard errors by the noise of one cycle.
    pub(super) sigma: Vector,
    /// The same of the load: the pull, and the gears' friction as a pull on the body, N.
    pub(super) load_sigma_n: f64,
}

/// The fit and everything that it keeps between cycles.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    bins: usize,
    unknowns: usize,
    forgetting: f64,
    model: CycleModel,
    ripples: Box<Ripples>,
    ripple_count: usize,
    gear: GearModel,
    velocity_rad_per_s: f64, // of the cam, in the mean over the cycles
    stroke_m: f64,
    force_per_torque: f64, // of the stepping cell, 1/m
    prior: Vector,
    prior_information: Vector,
    common_sigma: f64,         // of the mean ln friction of all cells
    common_freedom: f64,       // information on it that the cells' own standard deviations would have beyond that
    stated_pull_n: (f64, f64), // by the configured slope, with its standard deviation
    measured: MeasuredPull,
    at: Parameters,
    first_answer: Option<Parameters>, // of a search under way, from where the fit was
    other: Option<Parameters>,        // another answer, with another pull
    other_odds: f64,                  // its odds to the best
    mean_n_m: Box<[f64; MAX_BINS]>,
    cycles: f64,         // effective number, forgotten ones left out
    squared_cycles: f64, // Σ of the squared weights
    variance: f64,       // R, N² m²
    misfit: f64,         // MISFIT_BINS · variance of the misfit / R
    scatter: Matrix,     // Σ of squared scores about the mean
    scatter_count: f64,
    single: Matrix, // M
    covariance: Matrix,
    column: Box<[[f64; MAX_BINS]; MAX_UNKNOWNS]>,
    trial_n_m: Box<[f64; MAX_BINS]>,     // of the worm alone, where a descent would go
    predicted_n_m: Box<[f64; MAX_BINS]>, // at the parameters of the linearisation
    fitted_n_m: Box<[f64; MAX_BINS]>,    // at `at`
    cycle_n_m: Box<[f64; MAX_BINS]>,     // the cycle that was taken last
    figures: Option<(CycleFigures, CycleFigures)>, // with their standard errors
    backward_advance_m: Option<f64>,
    linearisation: Linearisation,
    slopes: Box<Slopes>, // of the figures
    scratch: Box<[Matrix; 2]>,
    before: Before,
    work: Work,
}

impl Fit {
    pub(super) fn new(worm: &Worm, config: &SelfSensingConfig) -> Self {
        let cells = worm.cells();
        let gear = &config.gear;
        let mut at = Parameters {
            cells,
            values: Vector::zeros(),
        };
        let mut sigma = Vector::repeat(1.0);
        for (cell, contact) in worm.contacts().iter().enumerate() {
            at.values[cell] = (contact.stiffness_n_per_m * contact.forward_bound_m).max(1e-3).ln();
            at.values[cells + cell] = contact.stiffness_n_per_m.ln();
            sigma[cell] = config.friction_sigma;
            sigma[cells + cell] = config.stiffness_sigma;
        }
        let pull_at = at.pull_at();
        at.values[pull_at] = worm.pull_n();
        sigma[pull_at] = config.pull_sigma_n;
        let gears = at.gears_at();
        sigma[gears] = gear.friction_sigma_n_m;
        sigma[gears + 1] = gear.torque_constant_sigma;
        sigma[gears + 2] = gear.load_friction_sigma;
        at.values[gears + 3] = LEAD_S[0];
        sigma[gears + 3] = LEAD_S[1];
        let bins = cells * BINS_PER_STEP;
        let mut ripples: Box<Ripples> = Box::new([[(0.0, 0.0); MAX_BINS]; MAX_RIPPLES]);
        let mut ripple_count = 0;
        for term in gear.ripple.iter().filter(|term| term.waves != 0.0) {
            for (bin, means) in ripples[ripple_count][..bins].iter_mut().enumerate() {
                *means = ripple_over_bin(term.waves, bin, bins);
            }
            sigma[gears + 4 + 2 * ripple_count] = gear.ripple_sigma_n_m;
            sigma[gears + 5 + 2 * ripple_count] = gear.ripple_sigma_n_m;
            ripple_count += 1;
        }
        let mut model = CycleModel::new(worm);
        while model.begin_at(&at).is_pending() {}
        let mut fit = Self {
            bins,
            unknowns: gears + 4 + 2 * ripple_count,
            forgetting: 1.0 - 1.0 / config.memory_cycles.max(1.0),
            model,
            ripples,
            ripple_count,
            gear: *gear,
            velocity_rad_per_s: TAU / config.cycle_s,
            stroke_m: worm.stroke_m(),
            force_per_torque: TAU / (cells as f64 * worm.stroke_m()),
            prior: at.values,
            prior_information: sigma.map(|sigma| 1.0 / (sigma * sigma)),
            common_sigma: 0.0,
            common_freedom: 0.0,
            stated_pull_n: (at.values[pull_at], config.pull_sigma_n),
            measured: MeasuredPull::default(),
            at,
            first_answer: None,
            other: None,
            other_odds: 0.0,
            mean_n_m: Box::new([0.0; MAX_BINS]),
            cycles: 0.0,
            squared_cycles: 0.0,
            variance: FLOOR_N_M * FLOOR_N_M,
            misfit: 0.0,
            scatter: Matrix::zeros(),
            scatter_count: 0.0,
            single: Matrix::zeros(),
            covariance: Matrix::from_diagonal(&sigma.map(|sigma| sigma * sigma)),
            column: Box::new([[0.0; MAX_BINS]; MAX_UNKNOWNS]),
            trial_n_m: Box::new([0.0; MAX_BINS]),
            predicted_n_m: Box::new([0.0; MAX_BINS]),
            fitted_n_m: Box::new([0.0; MAX_BINS]),
            cycle_n_m: Box::new([0.0; MAX_BINS]),
            figures: None,
            backward_advance_m: None,
            linearisation: Linearisation::new(),
            slopes: Box::new([[0.0; FIGURES]; 2 * MAX_CELLS + 1]),
            scratch: Box::new([Matrix::zeros(); 2]),
            before: Before::new(at),
            work: Work::Idle,
        };
        fit.free_common_friction(COMMON_FRICTION_SIGMAS[0]);
        // What is known before the first cycle.
        fit.work = Work::figures();
        while !fit.step() {}
        fit
    }

    /// Forgets every cycle, and what they gave stays the place where the next search begins.
    pub(super) fn forget(&mut self) {
        (self.cycles, self.squared_cycles, self.scatter_count) = (0.0, 0.0, 0.0);
        self.scatter.fill(0.0);
        self.measured.forget();
    }

    /// Takes a cycle's profile; where the slope was measured, the pull that follows from it, with its standard deviation, N.
    /// [`step`](Self::step) fits it.
    pub(super) fn take(&mut self, profile: &Profile, pull_n: Option<(f64, f64)>) {
        let torque_n_m = profile.torque_n_m();
        self.cycles = self.forgetting * self.cycles + 1.0;
        self.squared_cycles = self.forgetting * self.forgetting * self.squared_cycles + 1.0;
        let share = 1.0 / self.cycles;
        self.variance += share * (profile.variance() + FLOOR_N_M * FLOOR_N_M - self.variance);
        self.velocity_rad_per_s += share * (profile.velocity_rad_per_s() - self.velocity_rad_per_s);
        for (mean, torque) in self.mean_n_m.iter_mut().zip(torque_n_m) {
            *mean += share * (torque - *mean);
        }
        self.measured.take(pull_n, self.forgetting);
        let (pull_n, sigma_n) = self.measured.prior_n(self.cycles, self.stated_pull_n);
        let pull_at = self.at.pull_at();
        self.prior[pull_at] = pull_n;
        self.prior_information[pull_at] = sigma_n.powi(-2);
        self.cycle_n_m[..torque_n_m.len()].copy_from_slice(torque_n_m);
        self.work = if self.cycles == 1.0 || (self.cycles - SEARCHED_ANEW).abs() < 0.5 {
            Work::Search(self.search_everywhere())
        } else {
            Work::refine(self.at)
        };
    }

    /// Weight of the data: that of the cycles, less what does not average out.
    fn weight(&self) -> f64 {
        self.cycles / (1.0 + self.cycles * self.misfit)
    }

    /// A = W M + Λ, its lower triangle, into the first scratch matrix.
    fn fill_information(&mut self) {
        let weight = self.weight();
        let information = &mut self.scratch[0];
        for column in 0..self.unknowns {
            for row in column..self.unknowns {
                information[(row, column)] = weight * self.single[(row, column)];
            }
            information[(column, column)] += self.prior_information[column];
        }
        for column in 0..self.at.cells {
            for row in column..self.at.cells {
                information[(row, column)] -= self.common_freedom;
            }
        }
    }

    /// Λ (θ − θ₀): half the derivative of what the prior adds to what is minimised.
    fn prior_pull(&self, at: &Parameters) -> Vector {
        let off = at.values - self.prior;
        let mut pull = off.component_mul(&self.prior_information);
        let common: f64 = off.iter().take(at.cells).sum();
        (0..at.cells).for_each(|cell| pull[cell] -= self.common_freedom * common);
        pull
    }

    /// From now on, all tips together may hold less or more than is stated, by this standard deviation of their mean ln friction.
    fn free_common_friction(&mut self, sigma: f64) {
        let cells = self.at.cells as f64;
        let stated: f64 = self.prior_information.iter().take(self.at.cells).sum();
        self.common_sigma = sigma;
        self.common_freedom = ((stated - sigma.powi(-2)) / (cells * cells)).max(0.0);
    }

    /// Standard deviation of a cell's ln friction before.
    fn friction_sigma(&self, cell: usize) -> f64 {
        self.prior_sigma(cell).hypot(self.common_sigma)
    }

    fn bin_weight(bin: usize) -> f64 {
        let of_step = bin % BINS_PER_STEP;
        match FIRST_BIN_WEIGHTS.get(of_step) {
            Some(weight) => *weight,
            None if of_step + 1 == BINS_PER_STEP => LAST_BIN_WEIGHT,
            None => 1.0,
        }
    }

    /// What the gears make of a profile of the worm.
    fn through_gears(&self, parameters: &Parameters, bins: &mut [f64]) {
        let gears = parameters.gears_at();
        let values = &parameters.values;
        let (offset, gain, load) = (values[gears], 1.0 + values[gears + 1], values[gears + 2]);
        let mut plain = [0.0; MAX_BINS];
        plain[..bins.len()].copy_from_slice(bins);
        for (bin, torque_n_m) in bins.iter_mut().enumerate() {
            let worm_n_m = plain[bin];
            let led_n_m = worm_n_m + values[gears + 3] * self.bins_per_s() * rise(&plain, bin);
            *torque_n_m = gain * led_n_m + offset + load * self.load_on_gears_n_m(worm_n_m);
            for (ripple, means) in self.ripples[..self.ripple_count].iter().enumerate() {
                let (sine, cosine) = means[bin];
                *torque_n_m += values[gears + 4 + 2 * ripple] * sine + values[gears + 5 + 2 * ripple] * cosine;
            }
        }
    }

    fn bins_per_s(&self) -> f64 {
        self.bins as f64 * self.velocity_rad_per_s / TAU
    }

    /// Torque that presses the gears' teeth together while the cam takes `cam_n_m`, without its sign, N m.
    fn load_on_gears_n_m(&self, cam_n_m: f64) -> f64 {
        let share = self.gear.load_share;
        let motor_n_m = self.gear.motor_torque_n_m(cam_n_m, self.velocity_rad_per_s);
        (share * motor_n_m + (1.0 - share) * cam_n_m).abs()
    }

    /// The profile of a worm before the gears, into `trial_n_m`.
    fn evaluate(&mut self, parameters: &Parameters) -> Poll<Option<()>> {
        self.model.profile(parameters, &mut self.trial_n_m[..self.bins])
    }

    /// What is minimised, at parameters that were evaluated.
    fn cost(&self, parameters: &Parameters) -> f64 {
        let mut predicted = *self.trial_n_m;
        self.through_gears(parameters, &mut predicted[..self.bins]);
        let squares: f64 = (0..self.bins)
            .map(|bin| Self::bin_weight(bin) * (self.mean_n_m[bin] - predicted[bin]).powi(2))
            .sum();
        let off = parameters.values - self.prior;
        self.weight() / self.variance * squares + self.prior_pull(parameters).dot(&off)
    }

    /// Σ over bins of derivative × weight × (`torque` − `from`) / R.
    pub(super) fn score(&self, torque_n_m: &[f64], from_n_m: &[f64]) -> Vector {
        let bins = self.bins;
        let mut weighted = [0.0; MAX_BINS];
        for (bin, weighted) in weighted[..bins].iter_mut().enumerate() {
            *weighted = Self::bin_weight(bin) * (torque_n_m[bin] - from_n_m[bin]);
        }
        let mut score = Vector::zeros();
        for unknown in 0..self.unknowns {
            score[unknown] = dot(&self.column[unknown][..bins], &weighted[..bins]) / self.variance;
        }
        score
    }

    /// One cycle's difference to another profile, of which it has this [`score`](Self::score): by a step from the present parameters in which
    /// each unknown may change by about `sigma` (0: not at all). Uses the scratch matrices.
    pub(super) fn change(&mut self, score: &Vector, sigma: &Vector) -> Option<CycleChange> {
        let [information, inverse] = &mut *self.scratch;
        for column in 0..self.unknowns {
            for row in column..self.unknowns {
                information[(row, column)] = self.single[(row, column)];
            }
            information[(column, column)] += if sigma[column] > 0.0 {
                1.0 / (sigma[column] * sigma[column])
            } else {
                1e12
            };
        }
        if !leading::cholesky(information, self.unknowns) {
            return None;
        }
        leading::inverse(information, self.unknowns, inverse);
        let mut change = CycleChange {
            by: Vector::zeros(),
            sigma: Vector::zeros(),
            load_sigma_n: 0.0,
        };
        for unknown in 0..self.unknowns {
            change.by[unknown] = (0..self.unknowns)
                .map(|other| inverse[(unknown, other)] * score[other])
                .sum();
            change.sigma[unknown] = inverse[(unknown, unknown)].sqrt();
        }
        // More pull looks like less friction in the gears: their sum is much surer than either.
        let (pull, gears) = (self.at.pull_at(), self.at.gears_at());
        let per_torque = self.at.cells as f64 * self.force_per_torque;
        let variance = inverse[(pull, pull)]
            + 2.0 * per_torque * inverse[(pull, gears)]
            + per_torque * per_torque * inverse[(gears, gears)];
        change.load_sigma_n = variance.max(0.0).sqrt();
        Some(change)
    }

    pub(super) fn parameters(&self) -> &Parameters {
        &self.at
    }

    pub(super) fn covariance(&self) -> &Matrix {
        &self.covariance
    }

    pub(super) fn unknowns(&self) -> usize {
        self.unknowns
    }

    /// Another answer, which the profile does not exclude: its pull, N, and its probability.
    pub(super) fn other(&self) -> Option<(f64, f64)> {
        self.other
            .map(|other| (other.pull_n(), self.other_odds / (1.0 + self.other_odds)))
    }

    /// The first answer of a search under way, once.
    pub(super) fn take_first_answer(&mut self) -> Option<Parameters> {
        self.first_answer.take()
    }

    /// The profile of the cycle that was taken last, N m at the cam.
    pub(super) fn cycle_n_m(&self) -> &[f64] {
        &self.cycle_n_m[..self.bins]
    }

    /// Figures of the steady cycle with their standard errors; `None` while no worm holds that the profile allows.
    pub(super) fn figures(&self) -> Option<&(CycleFigures, CycleFigures)> {
        self.figures.as_ref()
    }

    /// Advance of a cycle backward, m, along that crawl.
    pub(super) fn backward_advance_m(&self) -> Option<f64> {
        self.backward_advance_m
    }

    /// Standard deviation of what was known of an unknown before.
    pub(super) fn prior_sigma(&self, unknown: usize) -> f64 {
        1.0 / self.prior_information[unknown].sqrt()
    }

    /// The pull that follows from the slope, N, in the mean over the cycles in which that was measured; none where it was not in the newest.
    pub(super) fn known_pull_n(&self) -> Option<f64> {
        self.measured.newest_n.and(self.measured.mean_n())
    }

    /// The same in the newest cycle alone.
    pub(super) fn newest_pull_n(&self) -> Option<f64> {
        self.measured.newest_n
    }

    /// Effective number of cycles.
    pub(super) fn cycles(&self) -> f64 {
        self.cycles
    }

    /// Root mean square of what the fit leaves in the mean profile, N m.
    pub(super) fn residual_n_m(&self) -> f64 {
        (self.misfit * self.variance / uncertainty::MISFIT_BINS).sqrt()
    }

    /// The mean profile and the fitted one, N m at the cam.
    pub(super) fn profiles_n_m(&self) -> (&[f64], &[f64]) {
        (&self.mean_n_m[..self.bins], &self.fitted_n_m[..self.bins])
    }
}

/// Means of the sine and cosine of so many waves a turn over one of the bins.
fn ripple_over_bin(waves: f64, bin: usize, bins: usize) -> (f64, f64) {
    let half = PI * waves / bins as f64;
    let (sine, cosine) = (TAU * waves * (bin as f64 + 0.5) / bins as f64).sin_cos();
    let mean = half.sin() / half;
    (mean * sine, mean * cosine)
}

/// By how much the torque rises from bin to bin, within its step.
fn rise(bins: &[f64], at: usize) -> f64 {
    let of_step = at % BINS_PER_STEP;
    let (from, to) = (
        at - usize::from(of_step > 0),
        at + usize::from(of_step + 1 < BINS_PER_STEP),
    );
    (bins[to] - bins[from]) / (to - from) as f64
}

/// Parameters of which an unknown of the worm is moved up, or the second time down, for its derivative; and by how much.
fn moved(at: &Parameters, unknown: usize, is_second: bool) -> (Parameters, f64) {
    let step = STEPS[(unknown / at.cells).min(2)];
    let mut moved = *at;
    moved.values[unknown] += if is_second { -step } else { step };
    (moved, step)
}
