//! Largest tip deformations found on the first cycles from positions alone: section 3.2 of the paper made continuous.
//!
//! The worm is so slow that the contacts carry the pull at every moment: F = Σ kᵢ δᵢ + m g sin λ = 0. Equations (1) to (4)
//! give every δᵢ once its bound is assumed, so the bounds sought are those with the least mean square of F over whole
//! cycles, which is the square of its mean (7) plus its variance. Where the paper tries 7⁴ candidates, this runs
//! Gauss and Newton's method: dδᵢ/dδmaxᵢ is +1 after the tip last slid forward and −1 after it last slid backward.
//!
//! # What positions cannot tell
//! A tip that never slides backward has +1 all the time, and so has every other such tip: of their bounds only Σ kᵢ δmaxᵢ
//! can be found. A weak pull towards the configured first guess shares that sum out, and the standard errors say how
//! weakly the single bounds are known. On the level with equal cells this concerns all of them.

use super::energy_balance::Tip;
use super::fit::Fit;
use super::window::INTERVALS;
use nalgebra::{Cholesky, Const, SMatrix, SVector};
use worm_physics::MAX_CELLS;

/// A quantity of each cell; zero beyond the last.
type PerCell = SVector<f64, MAX_CELLS>;

/// Information on the bounds, of fixed size so that nothing is allocated; the identity beyond the last cell.
type Information = SMatrix<f64, MAX_CELLS, MAX_CELLS>;

/// Whole cycles on which the bounds are found, the first of which only finds the contact points.
pub(super) const CYCLES: usize = 5;
/// Cycles after which a first answer is worth more than the guess.
const FIRST_SEARCH: usize = 3;
/// Standard deviation of the first guess, as a share of it.
const GUESS_SPREAD: f64 = 0.3;
/// How far from the first guess a bound may lie, as factors.
const RANGE: (f64, f64) = (0.1, 4.0);
/// Starting points, as factors of the first guess.
const STARTS: [f64; 3] = [1.0, 0.7, 1.4];
/// Iterations from each.
const ITERATIONS: usize = 12;
/// Slides that are not told from noise, in standard deviations of one measured position. Without it, noise at a tip that just
/// fails to slide would pass for knowledge of its bound.
const DEADBAND_SIGMAS: f64 = 0.5;
/// Knots over which the errors of a fit hang together.
const CORRELATED_KNOTS: f64 = 1.5;

/// The search and the cycles it rests on.
#[derive(Debug, Clone)]
pub(super) struct Identification {
    guess_m: Vec<f64>,
    bound_m: Vec<f64>,
    stroke_cells: Vec<usize>, // whose step each step of the stored cycles was
    path_m: Vec<f64>,         // [knot][cell], continuous over the stored cycles
    stored: usize,
    force_sigma_n: f64,
    deadband_m: f64,                                      // slides up to this are taken for noise
    information: Option<Cholesky<f64, Const<MAX_CELLS>>>, // after a search, as a factor
    force_n: Vec<f64>,
    slope: Vec<f64>, // [knot][cell], k dδ/dδmax
}

impl Identification {
    pub(super) fn new(tips: &[Tip]) -> Self {
        let cells = tips.len();
        let guess_m: Vec<f64> = tips.iter().map(|tip| tip.bound_m).collect();
        let knots = CYCLES * cells * INTERVALS + 1;
        Self {
            bound_m: guess_m.clone(),
            guess_m,
            stroke_cells: vec![0; cells],
            path_m: vec![0.0; knots * cells],
            stored: 0,
            force_sigma_n: 0.0,
            deadband_m: 0.0,
            information: None,
            force_n: vec![0.0; knots],
            slope: vec![0.0; knots * cells],
        }
    }

    /// Enough cycles are stored; the answer stays.
    pub(super) fn is_done(&self) -> bool {
        self.stored == CYCLES
    }

    /// The next cycle does not join on to the stored ones. A finished search stays.
    pub(super) fn interrupt(&mut self) {
        if !self.is_done() {
            self.stored = 0;
        }
    }

    /// Stores the last cycle of a fit and searches when there are enough. True when there is a new answer.
    pub(super) fn take_up(&mut self, fit: &Fit, tips: &[Tip]) -> bool {
        if self.is_done() {
            return false;
        }
        let (cells, pieces, from) = (tips.len(), fit.pieces(), fit.last_cycle_from());
        for step in 0..cells {
            self.stroke_cells[step] = fit.stepping_cell(step * INTERVALS);
        }
        let first = self.stored * pieces;
        for cell in 0..cells {
            let start_m = fit.position_m(cell, from);
            let joint_m = if self.stored == 0 {
                start_m
            } else {
                self.path_m[first * cells + cell]
            };
            for knot in 0..=pieces {
                self.path_m[(first + knot) * cells + cell] = joint_m + fit.position_m(cell, from + knot) - start_m;
            }
        }
        self.stored += 1;
        let squares: f64 = tips.iter().map(|tip| tip.stiffness_n_per_m.powi(2)).sum();
        self.force_sigma_n = squares.sqrt() * fit.sigma_m();
        self.deadband_m = DEADBAND_SIGMAS * fit.sigma_m();
        if self.stored < FIRST_SEARCH {
            return false;
        }
        self.search(tips);
        true
    }

    /// The bounds as far as found, m.
    pub(super) fn bound_m(&self) -> &[f64] {
        &self.bound_m
    }

    /// Standard error of Σ wᵢ δmaxᵢ, in the unit of the weights times m; `NaN` before the first search.
    pub(super) fn standard_error(&self, weights: &[f64; MAX_CELLS]) -> f64 {
        let weights = PerCell::from(*weights);
        self.information
            .as_ref()
            .map_or(f64::NAN, |factor| weights.dot(&factor.solve(&weights)).sqrt())
    }

    fn search(&mut self, tips: &[Tip]) {
        let mut best = (f64::INFINITY, [0.0; MAX_CELLS]);
        for start in STARTS {
            let mut bound_m = [0.0; MAX_CELLS];
            for (to, guess) in bound_m.iter_mut().zip(&self.guess_m) {
                *to = guess * start;
            }
            for _ in 0..ITERATIONS {
                let chi_squared = self.chi_squared(tips, &bound_m);
                if chi_squared < best.0 {
                    best = (chi_squared, bound_m);
                }
                let Some(step) = self.gauss_newton_step(&bound_m) else {
                    break;
                };
                for (cell, bound_m) in bound_m[..tips.len()].iter_mut().enumerate() {
                    let (low, high) = (RANGE.0 * self.guess_m[cell], RANGE.1 * self.guess_m[cell]);
                    let largest = 0.3 * self.guess_m[cell];
                    *bound_m = (*bound_m + step[cell].clamp(-largest, largest)).clamp(low, high);
                }
            }
        }
        let bound_m = best.1;
        self.chi_squared(tips, &bound_m);
        self.gauss_newton_step(&bound_m);
        self.bound_m.copy_from_slice(&bound_m[..tips.len()]);
    }

    /// Twice the negative logarithm of the likelihood of some bounds; leaves F and its slopes behind.
    fn chi_squared(&mut self, tips: &[Tip], bound_m: &[f64; MAX_CELLS]) -> f64 {
        let cells = tips.len();
        let pieces = cells * INTERVALS;
        let knots = self.stored * pieces + 1;
        let pull_n: f64 = tips.iter().map(|tip| tip.weight_n).sum();
        self.force_n[..knots].fill(pull_n);
        for (cell, tip) in tips.iter().enumerate() {
            let (bound_m, mut contact_m, mut side) = (bound_m[cell], f64::NAN, 0.0);
            for knot in 0..knots {
                let at_m = self.path_m[knot * cells + cell];
                let ended = knot > 0 && self.stroke_cells[(knot - 1) / INTERVALS % cells] == cell;
                if at_m - contact_m > bound_m + self.deadband_m
                    || (contact_m.is_nan() && ended && knot % INTERVALS == 0)
                {
                    (contact_m, side) = (at_m - bound_m, 1.0);
                } else if at_m - contact_m < -bound_m - self.deadband_m {
                    (contact_m, side) = (at_m + bound_m, -1.0);
                }
                self.force_n[knot] += tip.stiffness_n_per_m * (at_m - contact_m);
                self.slope[knot * cells + cell] = tip.stiffness_n_per_m * side;
            }
        }
        let weight = self.weight();
        let balance: f64 = self.force_n[pieces..knots]
            .iter()
            .map(|force| force * force * weight)
            .sum();
        let guesses = bound_m.iter().zip(&self.guess_m);
        balance
            + guesses
                .map(|(bound, guess)| ((bound - guess) / (GUESS_SPREAD * guess)).powi(2))
                .sum::<f64>()
    }

    fn weight(&self) -> f64 {
        1.0 / (CORRELATED_KNOTS * self.force_sigma_n * self.force_sigma_n)
    }

    /// Solves for the change of the bounds that would bring the misfit to its minimum if the slopes stayed; leaves the
    /// information on the bounds behind. None when the bounds cannot be told at all.
    fn gauss_newton_step(&mut self, bound_m: &[f64; MAX_CELLS]) -> Option<PerCell> {
        let cells = self.guess_m.len();
        let pieces = cells * INTERVALS;
        let weight = self.weight();
        let (mut information, mut step) = (Information::identity(), PerCell::zeros());
        for (i, (bound_m, guess_m)) in bound_m.iter().zip(&self.guess_m).enumerate() {
            let trust = 1.0 / (GUESS_SPREAD * guess_m).powi(2);
            information[(i, i)] = trust;
            step[i] = -trust * (bound_m - guess_m);
        }
        for knot in pieces..=self.stored * pieces {
            let slope = &self.slope[knot * cells..][..cells];
            for i in 0..cells {
                step[i] -= weight * slope[i] * self.force_n[knot];
                for j in 0..=i {
                    // The decomposition reads the lower triangle alone.
                    information[(i, j)] += weight * slope[i] * slope[j];
                }
            }
        }
        self.information = information.cholesky();
        self.information.as_ref().map(|factor| factor.solve(&step))
    }
}
