//! Largest tip deformations from positions alone: section 3.2 of the paper.
//!
//! [`gait`] finds which cell steps when, and removes the motion of the cells relative to one another from the positions. What remains is
//! the displacement of the body, for which the contacts are responsible. [`onset`] reads the first estimate from it (3.2.1). [`search`]
//! is the paper's exhaustive search (3.2.3); [`fit`] is the continuous estimator, which uses everything that the bounds cause and
//! reports standard errors.
//!
//! [`capture`] takes shifts of markers and camera out of a recording first; [`knock`] finds those of the camera. `rest` and `clock`
//! notice drifts of camera and clocks.
//!
//! Pure: series in, figures out, no files.

pub mod capture;
pub(crate) mod clean;
mod clock;
pub(crate) mod drift;
pub mod fit;
#[cfg(test)]
mod fixture;
pub mod gait;
mod gait_error;
pub mod knock;
pub mod onset;
mod rest;
mod running_median;
pub mod search;
mod steps;
pub(crate) mod theory;
mod track;

pub use capture::{Shift, Steadied, steady};
pub use fit::{FitError, Fitted, FittedRun, PositionRun};
pub use gait::{IdentifiedGait, Prior};
pub use gait_error::GaitError;
pub use onset::Onset;
