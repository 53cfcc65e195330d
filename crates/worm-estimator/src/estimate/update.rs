//! What the estimator gives out besides the messages.

use crate::config::ConfigProblem;
use crate::config::PhysicsError;
use crate::message::{Cycle, Estimate};

/// Why there can be no estimator.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EstimatorError {
    /// The configuration was changed after it was checked.
    #[error("the configuration is not valid: {0}")]
    Config(ConfigProblem),
    /// The configured worm is none to the model.
    #[error("the model refuses the configured worm: {0}")]
    Physics(#[from] PhysicsError),
}

/// What became of one state.
#[derive(Debug, Clone, Copy)]
pub struct Update<'a> {
    /// The estimate, when the state brought a tracker sample. `armed_mask`, `raised_mask` and `battery_fraction` are for the
    /// alarms to fill: 0, 0 and `NaN`.
    pub estimate: Option<&'a Estimate>,
    /// The gait cycle that ended.
    pub cycle: Option<&'a Cycle>,
}
