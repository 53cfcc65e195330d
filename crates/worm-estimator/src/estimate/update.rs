//! The estimator's output besides the messages.

use crate::config::ConfigProblem;
use crate::config::PhysicsError;
use crate::message::{Cycle, Estimate};

/// Why an estimator cannot be made, or cannot work on these states.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EstimatorError {
    /// The configuration was changed after it was checked.
    #[error("the configuration is not valid: {0}")]
    Config(ConfigProblem),
    /// The model refuses the configured worm.
    #[error("the model refuses the configured worm: {0}")]
    Physics(#[from] PhysicsError),
    /// The states are of a worm with another number of cells.
    #[error(
        "the states have {states} cells and the configuration has {configured}: start controller and estimator with the same \
         configuration, or correct worm.cells"
    )]
    CellCount {
        /// Cells in the states.
        states: u32,
        /// Cells in the configuration.
        configured: usize,
    },
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
