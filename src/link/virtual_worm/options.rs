//! What is simulated beyond the configuration.

use super::fault::Fault;
use worm_physics::servo::Pendulum;

/// What to simulate beyond the configuration.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Faults, in the order in which they act.
    pub faults: Vec<Fault>,
    /// In place of `virtual_worm.seed`.
    pub seed: Option<u64>,
    /// Baud rate that the servo has at first and that the peer must use, bit/s; `None`: any baud rate is accepted.
    pub baud: Option<u32>,
    /// Length of the plant's steps, s, in place of [`DEFAULT_STEP_S`](super::DEFAULT_STEP_S). Simulations of many hours
    /// take 1 ms, and four times less time.
    pub step_s: Option<f64>,
    /// An arm on the servo's horn in place of the cam; the worm rests.
    pub arm: Option<Pendulum>,
}
