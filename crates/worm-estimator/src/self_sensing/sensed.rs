//! What self-sensing says after a cycle.

use super::{Armed, Blind, Changes, CycleFigures};
use worm_physics::MAX_CELLS;

/// What the current says after a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SelfSensed {
    /// Number of cells.
    pub cells: usize,
    /// [`MotorSample::stamp_ns`](super::MotorSample::stamp_ns) of the reading that ended the newest cycle.
    pub end_ns: u64,
    /// Gait phase at its end, cycles.
    pub end_phase: f64,
    /// How the newest cycle was taken.
    pub standing: Standing,
    /// Cycles that were fitted together, forgotten ones counted less.
    pub cycles: f64,
    /// Friction force k·δmax of each cell, N.
    pub friction_n: [f64; MAX_CELLS],
    /// Its standard error, N.
    pub friction_sigma_n: [f64; MAX_CELLS],
    /// Stiffness of each cell, N/m.
    pub stiffness_n_per_m: [f64; MAX_CELLS],
    /// Its standard error, N/m.
    pub stiffness_sigma_n_per_m: [f64; MAX_CELLS],
    /// Pull on the body down the canal, N: weight and constant drag together.
    pub pull_n: f64,
    /// Its standard error, N.
    pub pull_sigma_n: f64,
    /// The slope, rad: as measured, or if all the pull is the stated mass's weight.
    pub slope_rad: f64,
    /// Its standard error, rad.
    pub slope_sigma_rad: f64,
    /// Whether a pitch sensor measured it.
    pub slope_is_measured: bool,
    /// Figures of the cycle by the model.
    pub figures: CycleFigures,
    /// Their standard errors.
    pub figures_sigma: CycleFigures,
    /// Electrical energy of the last cycle, measured, J.
    pub electrical_j: f64,
    /// Its standard error, J.
    pub electrical_sigma_j: f64,
    /// Root mean square of what the model leaves unexplained in the mean profile, N m at the cam.
    pub residual_n_m: f64,
    /// What the current cannot tell.
    pub blind: Blind,
    /// What differs from the usual.
    pub changes: Changes,
    /// What could be seen to differ.
    pub armed: Armed,
}

/// How the newest cycle was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standing {
    /// Fitted; but of so few cycles the intervals may be too narrow, and no change can be seen yet.
    WarmingUp,
    /// Fitted with those before.
    Fitted,
    /// Set aside: it is not like those before, and the next one will show whether that was an accident.
    Odd,
    /// Fitted: the worm is another than it was, and [`SelfSensed::changes`] says in what.
    Changed,
}
