//! The residual map: what the model does not explain of the crawl.
//!
//! # How it works
//! The model (`reference_model`) runs beside the estimator over the same gait phase, on bounds that are measured or were identified. At
//! the end of each gait cycle the displacement of each cell that was *measured* in each [`BINS`]th of a step is compared with the model's,
//! and the difference enters the [`map`](ResidualMap): for each cell, step and bin an exponentially weighted mean, with a standard error
//! from its scatter over the cycles (`weighted_mean`). The alarm `model-mismatch` reads the map, and so can anything else, by
//! [`Observer::residual_map`](super::Observer::residual_map).
//!
//! # How a displacement is measured
//! From the raw samples of the `window`, not from the fit: the fit assumes that cells outside their own step keep their distances, which
//! may be just what is wrong. The position of a cell at the edge of a bin is the mean residual of half a bin on each side of it, so an
//! increment has the noise of some ten samples. The last edge of a cycle needs samples of the next one. A cycle is therefore taken from
//! the last bin of the one before to its own last but one.
//!
//! # What is left out
//! - The first cycle after a start, a reversal, a silence of the tracker or new bounds: the model starts again from rest, and the two need
//!   a cycle to meet.
//! - Every cycle in which the worm did not crawl all the time or another alarm was raised, and the one after it.
//! - All cycles while the bounds are still being identified, and then those of the other direction than theirs: a tip that never slid
//!   backward shows its bound only there, and until then it is a guess.
//!
//! A reversal starts another map.
//!
//! # The test
//! The alarm is raised when an entry, or the advance of a whole cycle, is larger than the threshold with the confidence of the whole
//! family: a t-test of the excess over the threshold, on at least four cycles, with a Bonferroni correction (`map`). Every cycle has 7/8
//! of the weight of the next, so a mismatch that was there from the start is reported after five cycles, or some more when it is just
//! above the threshold: friction that scatters by 1 % from cycle to cycle moves each advance by 0.02 mm. One that appears later must first outweigh what was before: 8 to 13 cycles.
//!
//! The alarm clears when nothing in the map exceeds the threshold any more. One that was large would stay in the mean for long: a slide by
//! 40 mm a cycle for 41 cycles. So when the mean is far off, but the last four cycles by themselves are within the threshold everywhere,
//! what was before is over and forgotten.
//!
//! Bounds that were identified are known to their standard errors only, and so is the motion of a model that has them: 0.1 mm a cycle
//! with a noisy tracker (0.3 mm). Three standard errors of each entry and of the advance are added to the threshold there.
//!
//! # What cannot be detected, and what is allowed for
//! Recalibration hides effects, so there is little of it.
//!
//! - A slightly different stroke is a matter of the cam's calibration, not of the worm. A common one within ±2 %, as it shows in the
//!   extension of the stepping cells, is subtracted before the test.
//! - So is a common stiffness within ±2.5 % at unchanged bounds, as it shows in the body. On steep slopes that moves the worm as much as
//!   a degree or two more of slope; on the level it does nothing.
//! - Friction is *not* adapted. On the level with equal cells a drag of 0.3 N, a slope of 5° and 9 % more friction all take 0.1 mm from
//!   each step, within the same quarter of it: no test on positions can allow for the last and detect the first. A common 3 % makes some
//!   0.14 mm a cycle and stays within the default threshold of 0.16 mm; 5 % makes 0.23 mm, as a slope of 3° does, and both are reported.
//!
//! If the friction of a worm is only roughly known, have its bounds identified (`worm.max_deformation = "identified"`). That allows for any
//! offset, and also hides whatever looks like one and was there from the beginning. Or set the threshold to 0.0006 m, which a common 10 %
//! does not reach.

mod map;
mod reference_model;
mod weighted_mean;

#[cfg(test)]
mod tests;

pub use map::{Residual, ResidualMap, Unexplained};

use super::window::{INTERVALS, Window};
use reference_model::ReferenceModel;
use worm_physics::MAX_CELLS;
use worm_physics::Worm;

/// Phase bins of a step.
pub const BINS: usize = 4;
/// Pieces of the window in a bin.
const PIECES: usize = INTERVALS / BINS;
/// Pieces on each side of an edge that give a cell's position at it.
const SIDE: usize = PIECES / 2;

/// The model, the map, and which cycles may enter it.
#[derive(Debug, Clone)]
pub(super) struct Mismatch {
    model: ReferenceModel,
    is_whole: bool, // whether that model has every effect of the configuration
    map: ResidualMap,
    disturbed: bool,            // the open cycle
    was_undisturbed: bool,      // the cycle before it
    identified_in: Option<i32>, // the direction in which the bounds were found
    step: Vec<f64>,             // increments of one cycle, as the map has its entries
}

impl Mismatch {
    /// For the configured worm, in forward direction, against a threshold in m a cycle. `exact` is the worm that moves as the model does
    /// with all effects; without one the map stays empty, for it would only show the effects that are known.
    pub(super) fn new(worm: &Worm, exact: Option<Worm>, threshold_m: f64) -> Self {
        let map = ResidualMap::new(worm.cells(), threshold_m);
        let mut new = Self {
            is_whole: exact.is_some(),
            model: ReferenceModel::new(exact.as_ref().unwrap_or(worm)),
            step: vec![f64::NAN; map.size()],
            map,
            disturbed: true,
            was_undisturbed: false,
            identified_in: None,
        };
        new.clear(1);
        new
    }

    /// Starts over with bounds that were identified in the present direction; `standard_error` is that of Σ wᵢ δmaxᵢ.
    pub(super) fn set_identified(&mut self, exact: Option<Worm>, standard_error: impl Fn(&[f64; MAX_CELLS]) -> f64) {
        if let Some(exact) = exact {
            self.model.set_worm(&exact);
        }
        self.identified_in = Some(self.map.direction());
        self.clear(self.map.direction());
        self.map.set_uncertainty(&self.model, standard_error);
    }

    /// Starts a cycle that does not continue the last one, or runs in the other direction.
    pub(super) fn begin(&mut self, direction: i32) {
        if direction != self.map.direction() {
            self.clear(direction);
        }
        self.model.begin(direction);
        (self.disturbed, self.was_undisturbed) = (false, false);
    }

    /// Keeps the open cycle, and the one after it, out of the map.
    pub(super) fn disturb(&mut self) {
        self.disturbed = true;
    }

    /// The open cycle has not begun, so nothing has disturbed it yet.
    pub(super) fn rest(&mut self) {
        self.disturbed = false;
    }

    /// The map as of the last cycle.
    pub(super) fn map(&self) -> &ResidualMap {
        &self.map
    }

    /// Starts over, because the controller did.
    pub(super) fn forget(&mut self) {
        self.clear(self.map.direction());
    }

    fn clear(&mut self, direction: i32) {
        self.model.begin(direction);
        self.map.clear(direction, &self.model);
    }

    /// Adds the cycle that has just ended, the newer one of the window.
    pub(super) fn add_cycle(&mut self, window: &Window) {
        let undisturbed = !std::mem::replace(&mut self.disturbed, false);
        let both_undisturbed = std::mem::replace(&mut self.was_undisturbed, undisturbed) && undisturbed;
        let bounds_are_known = self
            .identified_in
            .is_none_or(|direction| direction == self.map.direction());
        if !(self.is_whole && bounds_are_known)
            || self.model.run_cycle().is_err()
            || !both_undisturbed
            || window.cycles() < 2
            || self.model.cycles() < 2
        {
            return;
        }
        self.measure(window);
        self.map.add(&self.step);
    }

    /// Increments of the residual over the bins, from the last bin of the cycle before.
    fn measure(&mut self, window: &Window) {
        let cells = self.map.cells();
        let bins = cells * BINS;
        let mut before_m = self.edge(window, window.pieces() - PIECES);
        for ahead in 0..bins {
            let edge_m = self.edge(window, window.pieces() + ahead * PIECES);
            let bin = (ahead + bins - 1) % bins;
            for cell in 0..cells {
                self.step[bin * cells + cell] = edge_m[cell] - before_m[cell];
            }
            before_m = edge_m;
        }
    }

    /// Residual of each cell at the beginning of a piece, m, up to a constant; `NaN` where it was not seen on both sides.
    fn edge(&self, window: &Window, piece: usize) -> [f64; MAX_CELLS] {
        let mut edge_m = [f64::NAN; MAX_CELLS];
        for (cell, edge_m) in edge_m[..self.map.cells()].iter_mut().enumerate() {
            let before_m = self.mean_residual(window, piece - SIDE..piece, cell);
            *edge_m = 0.5 * (before_m + self.mean_residual(window, piece..piece + SIDE, cell));
        }
        edge_m
    }

    fn mean_residual(&self, window: &Window, pieces: std::ops::Range<usize>, cell: usize) -> f64 {
        let (mut sum_m, mut count) = (0.0, 0.0);
        for piece in pieces {
            let seen = window.piece(piece)[cell];
            let (from_m, to_m) = (
                self.model.position_m(piece, cell),
                self.model.position_m(piece + 1, cell),
            );
            sum_m += seen.x - from_m * seen.count - (to_m - from_m) * seen.t;
            count += seen.count;
        }
        sum_m / count
    }
}
