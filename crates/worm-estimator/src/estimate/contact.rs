//! Where the tips touch the canal now: equations (1) to (4) on filtered positions.
//!
//! A tip slides when its deformation exceeds the bound, and on noisy positions it seems to do so at every peak of the noise. Two rules
//! keep that from adding up. A tip counts as sliding only beyond the bound by one standard deviation of the filtered position, and at
//! the end of its own step (1) gives the contact point from that position alone. The remaining error is removed at the end of the
//! cycle, when [`fit`](super::fit) has better contact points.

use super::energy_balance::Tip;
use worm_physics::MAX_CELLS;

/// Contact points, deformations and slides of all tips, along the canal whichever way the worm crawls.
#[derive(Debug, Clone)]
pub(super) struct Contacts {
    tips: Vec<Tip>,
    contact_m: [f64; MAX_CELLS], // NaN while unknown
    forward_m: [f64; MAX_CELLS],
    backward_m: [f64; MAX_CELLS],
    loss_j: f64,
    sliding_mask: u32,
}

impl Contacts {
    pub(super) fn new(tips: &[Tip]) -> Self {
        Self {
            tips: tips.to_vec(),
            contact_m: [f64::NAN; MAX_CELLS],
            forward_m: [0.0; MAX_CELLS],
            backward_m: [0.0; MAX_CELLS],
            loss_j: 0.0,
            sliding_mask: 0,
        }
    }

    /// Changes the bounds. A tip beyond its new bound then slides to it.
    pub(super) fn set_tips(&mut self, tips: &[Tip]) {
        self.tips.copy_from_slice(tips);
    }

    /// Forgets the contact points, but not the distances slid so far.
    pub(super) fn forget(&mut self) {
        self.contact_m = [f64::NAN; MAX_CELLS];
        self.sliding_mask = 0;
    }

    /// Follows a cell to its position, m, known with a standard deviation (2, 3).
    pub(super) fn follow(&mut self, cell: usize, position_m: f64, sigma_m: f64) {
        self.sliding_mask &= !(1 << cell);
        let bound_m = self.tips[cell].bound_m;
        let deformation_m = position_m - self.contact_m[cell];
        let slide_m = deformation_m.abs() - bound_m - sigma_m;
        if slide_m > 0.0 {
            self.sliding_mask |= 1 << cell;
            self.shift(cell, deformation_m.signum() * slide_m);
        }
    }

    /// (1): the cell has ended its step, which went `sign`-ward and was `step_m` long; its tip is at its bound.
    pub(super) fn anchor(&mut self, cell: usize, position_m: f64, sigma_m: f64, step_m: f64, sign: f64) {
        let Tip { bound_m, .. } = self.tips[cell];
        let anchored_m = position_m - sign * bound_m;
        if self.contact_m[cell].is_nan() {
            if sign * step_m > 2.0 * bound_m {
                self.contact_m[cell] = anchored_m;
            }
        } else if sign * (position_m - self.contact_m[cell]) > bound_m - 2.0 * sigma_m {
            self.shift(cell, anchored_m - self.contact_m[cell]);
        }
    }

    fn shift(&mut self, cell: usize, slide_m: f64) {
        let Tip {
            stiffness_n_per_m,
            bound_m,
            ..
        } = self.tips[cell];
        self.contact_m[cell] += slide_m;
        let slid = if slide_m > 0.0 {
            &mut self.forward_m
        } else {
            &mut self.backward_m
        };
        slid[cell] += slide_m.abs();
        self.loss_j += stiffness_n_per_m * bound_m * slide_m.abs();
    }

    /// Replaces contact points and totals by better ones; a contact point of `NaN` is left as it is.
    pub(super) fn correct(&mut self, contact_m: &[f64], forward_m: &[f64], backward_m: &[f64], loss_j: f64) {
        for cell in 0..self.tips.len() {
            if contact_m[cell].is_finite() {
                self.contact_m[cell] = contact_m[cell];
            }
            self.forward_m[cell] = forward_m[cell];
            self.backward_m[cell] = backward_m[cell];
        }
        self.loss_j = loss_j;
    }

    /// Contact points, m; `NaN` where not known.
    pub(super) fn contact_m(&self) -> &[f64; MAX_CELLS] {
        &self.contact_m
    }

    /// Deformation (4) of a cell at a position, within its bounds, m.
    pub(super) fn deformation_m(&self, cell: usize, position_m: f64) -> f64 {
        let Tip { bound_m, .. } = self.tips[cell];
        let deformation_m = position_m - self.contact_m[cell];
        if deformation_m.is_nan() {
            deformation_m
        } else {
            deformation_m.clamp(-bound_m, bound_m)
        }
    }

    /// Distances slid forward, m.
    pub(super) fn forward_m(&self) -> &[f64; MAX_CELLS] {
        &self.forward_m
    }

    /// Distances slid backward, m, as positive numbers.
    pub(super) fn backward_m(&self) -> &[f64; MAX_CELLS] {
        &self.backward_m
    }

    /// Sliding losses (12), J.
    pub(super) fn loss_j(&self) -> f64 {
        self.loss_j
    }

    /// Bit i set: tip i slides.
    pub(super) fn sliding_mask(&self) -> u32 {
        self.sliding_mask
    }
}
