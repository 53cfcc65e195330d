//! The estimator's output besides the messages.

use crate::config::ConfigProblem;
use crate::config::PhysicsError;
use crate::message::{Cycle, Estimate};

/// Why an estimator cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EstimatorError {
    /// The configuration was changed after it was checked.
    #[error("the configuration is not valid: {0}")]
    Config(ConfigProblem),
    /// The model refuses the configured worm.
    #[error("the model refuses the configured worm: {0}")]
    Physics(#[from] PhysicsError),
}

/// What one state gave.
#[derive(Debug, Clone, Copy)]
pub struct Update<'a> {
    /// The estimate, if the state carried a tracker sample. The alarms fill in `armed_mask`, `raised_mask` and
    /// `battery_fraction`: here they are 0, 0 and `NaN`.
    pub estimate: Option<&'a Estimate>,
    /// The gait cycle that ended, if one did.
    pub cycle: Option<&'a Cycle>,
}
