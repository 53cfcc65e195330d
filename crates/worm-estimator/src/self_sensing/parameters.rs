//! The unknowns of the fit, in one vector.
//!
//! | entries | what |
//! |---|---|
//! | n | ln of each cell's friction force k·δmax, N |
//! | n | ln of each cell's stiffness k, N/m |
//! | 1 | pull on the body, N: weight along the canal and every constant drag |
//! | 1 | torque beyond the gear model's, N m: its error in dry and viscous friction at this temperature |
//! | 1 | share by which the torque on the cam is wrong: the error of the torque constant |
//! | 1 | friction per load on the gears beyond the gear model's |
//! | 1 | lead of each step's rise, s: damping of the pads |
//! | 2 for each | sine and cosine of each ripple beyond the gear model's, N m |
//!
//! The first 2n + 1 describe the worm of the exact cycle, the others the gears and the pads' damping: they are estimated with the worm, so that what the gears leave uncertain is
//! uncertain in the worm.

use super::gear::MAX_RIPPLES;
use nalgebra::{SMatrix, SVector};
use worm_physics::MAX_CELLS;

/// Most unknowns.
pub(super) const MAX_UNKNOWNS: usize = 2 * MAX_CELLS + 5 + 2 * MAX_RIPPLES;

/// A vector with an entry for every unknown; those not in use are 0.
pub(super) type Vector = SVector<f64, MAX_UNKNOWNS>;
/// A matrix over the unknowns; those not in use are those of the unit matrix.
pub(super) type Matrix = SMatrix<f64, MAX_UNKNOWNS, MAX_UNKNOWNS>;

/// The unknowns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Parameters {
    pub(super) cells: usize,
    pub(super) values: Vector,
}

impl Parameters {
    /// Number of unknowns that describe the worm.
    pub(super) fn of_worm(&self) -> usize {
        2 * self.cells + 1
    }

    /// Where the pull is.
    pub(super) fn pull_at(&self) -> usize {
        2 * self.cells
    }

    /// Where the gears' unknowns begin: offset, gain, load, then the lead, then the ripples.
    pub(super) fn gears_at(&self) -> usize {
        2 * self.cells + 1
    }

    /// Friction force of a cell, k·δmax, N.
    pub(super) fn friction_n(&self, cell: usize) -> f64 {
        self.values[cell].exp()
    }

    /// Stiffness of a cell, N/m.
    pub(super) fn stiffness_n_per_m(&self, cell: usize) -> f64 {
        self.values[self.cells + cell].exp()
    }

    /// Pull on the body, N.
    pub(super) fn pull_n(&self) -> f64 {
        self.values[self.pull_at()]
    }
}
