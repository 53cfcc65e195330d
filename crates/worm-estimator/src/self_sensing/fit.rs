//! Fits worm and gears to the mean torque profile, cycle by cycle.
//!
//! # What is minimised
//! With the mean profile ȳ of N cycles (older ones forgotten), the model h(θ) and what is known before, θ₀ with information Λ:
//! W Σ_b w_b (ȳ_b − h_b)²/R + (θ − θ₀)ᵀ Λ (θ − θ₀), by Gauss-Newton steps with damping. It runs on from where the last cycle left it, so
//! a cycle needs one or two steps.
//!
//! [`search`] finds the place where this begins, [`uncertainty`] the standard errors.

mod search;
mod uncertainty;

use super::SelfSensingConfig;
use super::gear::{GearModel, MAX_RIPPLES};
use super::model::CycleModel;
use super::parameters::{MAX_UNKNOWNS, Matrix, Parameters, Vector};
use super::profile::{BINS_PER_STEP, MAX_BINS};
use std::f64::consts::{PI, TAU};
use worm_physics::Worm;

/// Damping of the pads makes the force of a loading cell lead by damping over stiffness, s: what is assumed, and its standard deviation.
const LEAD_S: [f64; 2] = [0.008, 0.005];
/// Torque that no profile is sure of, N m: rounding of the current, speed within a bin.
const FLOOR_N_M: f64 = 3e-4;
/// Weight of the bins on either side of the jump from one step to the next: readings are a tick apart, the jump is not.
const FIRST_BIN_WEIGHTS: [f64; 2] = [0.01, 0.3];
const LAST_BIN_WEIGHT: f64 = 0.02;
/// Finite differences: of a logarithm of friction, of stiffness, and of the pull, N.
const STEPS: [f64; 3] = [0.01, 0.02, 0.03];
/// Longest Gauss-Newton step: of a logarithm, and of the pull, N.
const LONGEST: [f64; 2] = [0.4, 0.8];
/// Expected gain of a step, in units of its variance, below which the search ends.
const CLOSE_ENOUGH: f64 = 1e-3;
/// Gauss-Newton steps in a cycle without a search.
const ROUNDS: usize = 2;
/// Cycles after which everything is searched anew, because the mean profile has become much better.
const SEARCHED_ANEW: f64 = 3.0;

/// The fit and everything that it keeps between cycles.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    bins: usize,
    unknowns: usize,
    forgetting: f64,
    model: CycleModel,
    waves: [f64; MAX_RIPPLES],
    ripples: usize,
    gear: GearModel,
    velocity_rad_per_s: f64,
    bins_per_s: f64,
    stroke_m: f64,
    force_per_torque: f64, // of the stepping cell, 1/m
    prior: Vector,
    prior_information: Vector,
    at: Parameters,
    other: Option<Parameters>, // another answer, with another pull
    other_odds: f64,           // its odds to the best
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
    predicted_n_m: Box<[f64; MAX_BINS]>,
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
        let mut waves = [0.0; MAX_RIPPLES];
        let mut ripples = 0;
        for term in gear.ripple.iter().filter(|term| term.waves != 0.0) {
            waves[ripples] = term.waves;
            sigma[gears + 4 + 2 * ripples] = gear.ripple_sigma_n_m;
            sigma[gears + 5 + 2 * ripples] = gear.ripple_sigma_n_m;
            ripples += 1;
        }
        let mut model = CycleModel::new(worm);
        model.begin_at(&at);
        Self {
            bins: cells * BINS_PER_STEP,
            unknowns: gears + 4 + 2 * ripples,
            forgetting: 1.0 - 1.0 / config.memory_cycles.max(1.0),
            model,
            waves,
            ripples,
            gear: *gear,
            velocity_rad_per_s: TAU / config.cycle_s,
            bins_per_s: (cells * BINS_PER_STEP) as f64 / config.cycle_s,
            stroke_m: worm.stroke_m(),
            force_per_torque: TAU / (cells as f64 * worm.stroke_m()),
            prior: at.values,
            prior_information: sigma.map(|sigma| 1.0 / (sigma * sigma)),
            at,
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
            predicted_n_m: Box::new([0.0; MAX_BINS]),
        }
    }

    /// Forgets every cycle, and what they gave stays the place where the next search begins.
    pub(super) fn forget(&mut self) {
        (self.cycles, self.squared_cycles, self.scatter_count) = (0.0, 0.0, 0.0);
        self.scatter.fill(0.0);
    }

    /// Takes a cycle's profile, and the variance of its means by the noise within bins.
    pub(super) fn take(&mut self, torque_n_m: &[f64], variance: f64) {
        self.cycles = self.forgetting * self.cycles + 1.0;
        self.squared_cycles = self.forgetting * self.forgetting * self.squared_cycles + 1.0;
        let share = 1.0 / self.cycles;
        self.variance += share * (variance + FLOOR_N_M * FLOOR_N_M - self.variance);
        for (mean, torque) in self.mean_n_m.iter_mut().zip(torque_n_m) {
            *mean += share * (torque - *mean);
        }
        if self.cycles == 1.0 || (self.cycles - SEARCHED_ANEW).abs() < 0.5 {
            self.search_everywhere();
        } else {
            self.descend(ROUNDS);
        }
        self.weigh_other();
        self.model.begin_at(&self.at);
        self.assess(torque_n_m);
    }

    /// Weight of the data: that of the cycles, less what does not average out.
    fn weight(&self) -> f64 {
        self.cycles / (1.0 + self.cycles * self.misfit)
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
            let led_n_m = worm_n_m + values[gears + 3] * self.bins_per_s * rise(&plain, bin);
            *torque_n_m = gain * led_n_m + offset + load * self.load_on_gears_n_m(worm_n_m);
            for ripple in 0..self.ripples {
                let (sine, cosine) = self.ripple_of(ripple, bin);
                *torque_n_m += values[gears + 4 + 2 * ripple] * sine + values[gears + 5 + 2 * ripple] * cosine;
            }
        }
    }

    /// Torque that presses the gears' teeth together while the cam takes `cam_n_m`, without its sign, N m.
    fn load_on_gears_n_m(&self, cam_n_m: f64) -> f64 {
        let share = self.gear.load_share;
        let motor_n_m = self.gear.motor_torque_n_m(cam_n_m, self.velocity_rad_per_s);
        (share * motor_n_m + (1.0 - share) * cam_n_m).abs()
    }

    /// Means of a ripple's sine and cosine over a bin.
    fn ripple_of(&self, ripple: usize, bin: usize) -> (f64, f64) {
        let half = PI * self.waves[ripple] / self.bins as f64;
        let (sine, cosine) = (TAU * self.waves[ripple] * (bin as f64 + 0.5) / self.bins as f64).sin_cos();
        let mean = half.sin() / half;
        (mean * sine, mean * cosine)
    }

    fn predict(&self, parameters: &Parameters, bins: &mut [f64]) -> Option<()> {
        self.model.profile(parameters, bins)?;
        self.through_gears(parameters, bins);
        Some(())
    }

    /// What is minimised; `None` where no such worm holds.
    fn cost(&self, parameters: &Parameters) -> Option<f64> {
        let mut predicted = [0.0; MAX_BINS];
        self.predict(parameters, &mut predicted[..self.bins])?;
        let squares: f64 = (0..self.bins)
            .map(|bin| Self::bin_weight(bin) * (self.mean_n_m[bin] - predicted[bin]).powi(2))
            .sum();
        let off = parameters.values - self.prior;
        Some(self.weight() / self.variance * squares + off.component_mul(&self.prior_information).dot(&off))
    }

    /// The profile at the present parameters and its derivatives.
    fn linearise(&mut self) -> Option<()> {
        let bins = self.bins;
        let at = self.at;
        let mut plain = [0.0; MAX_BINS];
        self.model.profile(&at, &mut plain[..bins])?;
        let mut predicted = plain;
        self.through_gears(&at, &mut predicted[..bins]);
        *self.predicted_n_m = predicted;
        let gears = at.gears_at();
        let gain = 1.0 + at.values[gears + 1];
        let mut other = [0.0; MAX_BINS];
        for unknown in 0..at.of_worm() {
            let step = STEPS[(unknown / at.cells).min(2)];
            let moved = |by: f64| {
                let mut moved = at;
                moved.values[unknown] += by;
                moved
            };
            let mut width = 2.0 * step;
            let column = &mut self.column[unknown];
            if self.model.profile(&moved(step), &mut column[..bins]).is_none() {
                column[..bins].copy_from_slice(&plain[..bins]);
                width -= step;
            }
            if self.model.profile(&moved(-step), &mut other[..bins]).is_none() {
                other[..bins].copy_from_slice(&plain[..bins]);
                width -= step;
            }
            if width <= 0.0 {
                return None;
            }
            for (forward, backward) in column[..bins].iter_mut().zip(&other[..bins]) {
                *forward = gain * (*forward - backward) / width;
            }
        }
        for bin in 0..bins {
            self.column[gears][bin] = 1.0;
            self.column[gears + 1][bin] = plain[bin];
            self.column[gears + 2][bin] = self.load_on_gears_n_m(plain[bin]);
            self.column[gears + 3][bin] = gain * self.bins_per_s * rise(&plain, bin);
            for ripple in 0..self.ripples {
                let (sine, cosine) = self.ripple_of(ripple, bin);
                self.column[gears + 4 + 2 * ripple][bin] = sine;
                self.column[gears + 5 + 2 * ripple][bin] = cosine;
            }
        }
        let mut single = Matrix::zeros();
        for row in 0..self.unknowns {
            for other in 0..=row {
                let sum: f64 = (0..bins)
                    .map(|bin| Self::bin_weight(bin) * self.column[row][bin] * self.column[other][bin])
                    .sum();
                single[(row, other)] = sum / self.variance;
                single[(other, row)] = single[(row, other)];
            }
        }
        self.single = single;
        Some(())
    }

    /// Σ over bins of derivative × weight × (`torque` − `from`) / R.
    fn score(&self, torque_n_m: &[f64], from_n_m: &[f64]) -> Vector {
        let mut score = Vector::zeros();
        for unknown in 0..self.unknowns {
            let sum: f64 = (0..self.bins)
                .map(|bin| Self::bin_weight(bin) * self.column[unknown][bin] * (torque_n_m[bin] - from_n_m[bin]))
                .sum();
            score[unknown] = sum / self.variance;
        }
        score
    }

    fn information(&self) -> Matrix {
        let mut information = self.single * self.weight();
        for unknown in 0..MAX_UNKNOWNS {
            information[(unknown, unknown)] += self.prior_information[unknown];
        }
        information
    }

    /// Gauss-Newton steps with damping.
    fn descend(&mut self, rounds: usize) {
        let at = self.at;
        let Some(mut cost) = self.cost(&at) else { return };
        let mut damping = 1e-3;
        for _ in 0..rounds {
            if self.linearise().is_none() {
                return;
            }
            let gradient = self.score(&self.mean_n_m[..], &self.predicted_n_m[..]) * self.weight()
                - (self.at.values - self.prior).component_mul(&self.prior_information);
            let information = self.information();
            let mut improved = false;
            for _ in 0..4 {
                let mut damped = information;
                for unknown in 0..MAX_UNKNOWNS {
                    damped[(unknown, unknown)] *= 1.0 + damping;
                }
                let Some(cholesky) = damped.cholesky() else { return };
                let mut step = cholesky.solve(&gradient);
                if gradient.dot(&step) < CLOSE_ENOUGH {
                    return;
                }
                let pull_at = self.at.pull_at();
                let too_long = (0..self.at.of_worm())
                    .map(|unknown| step[unknown].abs() / LONGEST[usize::from(unknown == pull_at)])
                    .fold(1.0, f64::max);
                step /= too_long;
                let mut moved = self.at;
                moved.values += step;
                match self.cost(&moved) {
                    Some(lower) if lower < cost => {
                        (self.at, cost, improved) = (moved, lower, true);
                        damping *= 0.2;
                        break;
                    }
                    _ => damping = (damping * 8.0).max(1e-2),
                }
            }
            if !improved {
                return;
            }
        }
    }

    /// One cycle's difference to the mean of all, by a step from the present parameters in which each unknown may change by about
    /// `sigma` (0: not at all), and its standard errors.
    pub(super) fn change(&self, torque_n_m: &[f64], sigma: &Vector) -> Option<(Vector, Vector)> {
        let gradient = self.score(torque_n_m, &self.mean_n_m[..]);
        let mut information = self.single;
        for unknown in 0..MAX_UNKNOWNS {
            information[(unknown, unknown)] += if unknown < self.unknowns && sigma[unknown] > 0.0 {
                1.0 / (sigma[unknown] * sigma[unknown])
            } else {
                1e12
            };
        }
        let cholesky = information.cholesky()?;
        let inverse = cholesky.inverse();
        Some((inverse * gradient, inverse.diagonal().map(f64::sqrt)))
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

    /// Standard deviation of what was known of an unknown before.
    pub(super) fn prior_sigma(&self, unknown: usize) -> f64 {
        1.0 / self.prior_information[unknown].sqrt()
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
        (&self.mean_n_m[..self.bins], &self.predicted_n_m[..self.bins])
    }
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
