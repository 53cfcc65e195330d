//! A cell's contact with the canal.

use super::error::{WormError, require};

/// A cell's compliant contact: a spring in series with a Coulomb slider.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Tangential stiffness k of the whole cell, N/m; above 0.
    pub stiffness_n_per_m: f64,
    /// Largest deformation μN/k with the tip about to slide forward, m; 0 or more.
    pub forward_bound_m: f64,
    /// Largest deformation with the tip about to slide backward, m, as a positive number; 0 or more.
    pub backward_bound_m: f64,
}

impl Contact {
    /// A contact that holds equally well both ways, as the paper assumes.
    pub const fn symmetric(stiffness_n_per_m: f64, max_deformation_m: f64) -> Self {
        Self {
            stiffness_n_per_m,
            forward_bound_m: max_deformation_m,
            backward_bound_m: max_deformation_m,
        }
    }

    /// Distance between the two bounds, m.
    pub(crate) fn range_m(&self) -> f64 {
        self.forward_bound_m + self.backward_bound_m
    }

    pub(super) fn check(&self) -> Result<(), WormError> {
        require(
            self.stiffness_n_per_m > 0.0,
            "stiffness_n_per_m",
            self.stiffness_n_per_m,
            "above 0",
        )?;
        require(
            self.forward_bound_m >= 0.0,
            "forward_bound_m",
            self.forward_bound_m,
            "0 or more",
        )?;
        require(
            self.backward_bound_m >= 0.0,
            "backward_bound_m",
            self.backward_bound_m,
            "0 or more",
        )
    }
}
