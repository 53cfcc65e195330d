//! Largest tip deformations from positions alone: section 3.2 of the paper.
//!
//! # The story
//! [`gait`] finds which cell steps when, and takes what the cells do relative to one another out of the positions; what
//! remains is the way of the body, the contacts' doing. [`onset`] reads from it the first estimate (3.2.1). [`search`] is the
//! paper's exhaustive search (3.2.3), [`fit`] the continuous estimator that uses everything the bounds cause, and tells how well
//! it knows them.
//!
//! Pure: series in, figures out; knows of no files.

pub(crate) mod clean;
pub(crate) mod drift;
pub mod fit;
pub mod gait;
mod gait_error;
pub mod onset;
mod running_median;
pub mod search;
mod steps;
pub(crate) mod theory;
mod track;

pub use fit::{FitError, Fitted, FittedRun, PositionRun};
pub use gait::{IdentifiedGait, Prior};
pub use gait_error::GaitError;
pub use onset::Onset;
