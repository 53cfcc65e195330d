//! What the model does not explain: the residual of the crawl, kept as a map while the worm crawls.
//!
//! # The story
//! Beside the estimator runs the configured worm as the model has it (`model`), over the same gait phase, on the bounds that
//! are measured or were identified. At the end of each gait cycle the way that each cell was *seen* to make in each
//! [`BINS`]th of a step is compared with the way that the model makes there, and the difference enters the [`map`](ResidualMap):
//! for each cell, step and bin a mean that forgets slowly, with a standard error from its scatter over the cycles (`mean`).
//! The alarm `model-mismatch` reads the map; so may anybody else, by [`Observer::residual_map`](super::Observer::residual_map).
//!
//! # How a way is measured
//! From the raw samples of the `window`, not from the fit: the fit takes cells outside their own step to keep
//! their distances, which is one of the things that may be wrong. Where a cell is at the edge of a bin is the mean residual of
//! half a bin before and half a bin behind it, so an increment has the noise of some ten samples. The last edge of a cycle
//! needs samples of the next; a cycle is therefore taken from the last bin of the one before to its own last but one.
//!
//! # What is left out
//! The first cycle after a start, a reversal or a silence of the tracker, and after new bounds: the model begins anew there, at
//! rest, and the two need a cycle to meet. Every cycle in which the worm did not crawl all the time or another alarm stood, and
//! the one after it. While the bounds are still being identified there is no map, and none of the other direction than
//! theirs: a tip that never slid backward shows its bound only there, and then it is no more than a guess. A reversal begins
//! another map.
//!
//! # What is told
//! Something is told when an entry, or the advance of a whole cycle, is larger than the threshold with the confidence of the
//! whole family: a t-test of the excess over the threshold, on at least four cycles, with Bonferroni's share (`map`).
//! Every cycle weighs 7/8 of the next, so a mismatch that was there from the start is told after five cycles, or a few
//! more when it is just beyond; one that comes up later must first outweigh what was before, 8 to 13 cycles.
//!
//! # What cannot be told, and what is allowed for
//! Recalibration hides effects, so little of it is done.
//!
//! - A stroke a little off is the calibration of the cam, not of the worm. A common one within ±2 %, as the extension of the
//!   stepping cells shows it, is taken off before the test.
//! - So is a common stiffness within ±2.5 % at unchanged bounds, as the body shows it. On steep slopes that moves the worm as much
//!   as a degree or two more of slope does; on the level it does nothing.
//! - Friction is *not* adapted. On the level with equal cells a drag of 0.3 N, a slope of 5° and 9 % more friction all take
//!   0.1 mm from each step, within the same quarter of it: no test on positions can allow for the last and tell the
//!   first. A common 3 % makes some 0.14 mm a cycle and stays within the default threshold of 0.15 mm; 5 % makes 0.23 mm, as
//!   a slope of 3° does, and both are told.
//!
//! A worm whose friction is only roughly known should have its bounds identified (`worm.max_deformation = "identified"`). That
//! allows for any offset, and hides with it what looks like one and was there from the beginning. A threshold of 0.0006 m
//! instead is not reached by a common 10 %.

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
/// Pieces on each side of an edge that tell where a cell is at it.
const SIDE: usize = PIECES / 2;

/// Model and map, and which cycles may enter it.
#[derive(Debug, Clone)]
pub(super) struct Mismatch {
    model: ReferenceModel,
    map: ResidualMap,
    disturbed: bool,            // the open cycle
    was_undisturbed: bool,      // the cycle before it
    identified_in: Option<i32>, // the direction in which the bounds were found
    step: Vec<f64>,             // increments of one cycle, as the map has its entries
}

impl Mismatch {
    /// Beside a worm as it is configured, in forward direction.
    pub(super) fn new(worm: &Worm) -> Self {
        let map = ResidualMap::new(worm.cells());
        let mut new = Self {
            model: ReferenceModel::new(worm),
            step: vec![f64::NAN; map.size()],
            map,
            disturbed: true,
            was_undisturbed: false,
            identified_in: None,
        };
        new.clear(1);
        new
    }

    /// Takes up bounds that were identified in the present direction: everything begins anew.
    pub(super) fn set_identified(&mut self, worm: &Worm) {
        self.model.set_worm(worm);
        self.identified_in = Some(self.map.direction());
        self.clear(self.map.direction());
    }

    /// The next cycle does not join on to the last, or runs the other way.
    pub(super) fn begin(&mut self, direction: i32) {
        if direction != self.map.direction() {
            self.clear(direction);
        }
        self.model.begin(direction);
        (self.disturbed, self.was_undisturbed) = (false, false);
    }

    /// The open cycle is not to be judged.
    pub(super) fn disturb(&mut self) {
        self.disturbed = true;
    }

    /// The open cycle has not begun: whatever was done before it does not disturb it.
    pub(super) fn rest(&mut self) {
        self.disturbed = false;
    }

    /// The map as of the last cycle.
    pub(super) fn map(&self) -> &ResidualMap {
        &self.map
    }

    /// The controller began anew, and with it the account of the crawl.
    pub(super) fn forget(&mut self) {
        self.clear(self.map.direction());
    }

    fn clear(&mut self, direction: i32) {
        self.model.begin(direction);
        self.map.clear(direction, &self.model);
    }

    /// Takes up the cycle that has just ended, the newer one of the window.
    pub(super) fn take_up(&mut self, window: &Window) {
        let undisturbed = !std::mem::replace(&mut self.disturbed, false);
        let both_undisturbed = std::mem::replace(&mut self.was_undisturbed, undisturbed) && undisturbed;
        let is_told = self
            .identified_in
            .is_none_or(|direction| direction == self.map.direction());
        if !is_told
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

    /// The increments of the residual over the bins, from the last bin of the cycle before on.
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

    /// Residual of each cell at the beginning of a piece, m, but for a constant; `NaN` where it was not seen on both sides.
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
