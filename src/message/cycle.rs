//! The `cycle` topic: what one gait cycle did and cost.

use crate::MAX_CELLS;
use iceoryx2::prelude::ZeroCopySend;

/// One finished gait cycle, with the model's prediction beside the measurement.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend)]
#[type_name("wormd_cycle_v1")]
#[repr(C)]
pub struct Cycle {
    /// Number of the cycle since crawling began, from 0.
    pub index: u64,
    /// When the cycle ended, ns of `CLOCK_MONOTONIC`.
    pub end_ns: u64,
    /// How long the cycle took, s.
    pub duration_s: f64,
    /// Distance travelled: mean over the cells of the net displacement, m.
    pub advance_m: f64,
    /// Standard error of the advance, m.
    pub advance_sigma_m: f64,
    /// Distance each tip slid forward, m.
    pub forward_slide_m: [f64; MAX_CELLS],
    /// Distance each tip slid backward, m, counted positive.
    pub backward_slide_m: [f64; MAX_CELLS],
    /// Energy by losses and weight, equation (11), J; like all that is measured by positions `NaN` when the tracker was silent.
    pub energy_loss_j: f64,
    /// Standard error of `energy_loss_j`, J.
    pub energy_loss_sigma_j: f64,
    /// Net actuator work, equation (13), J.
    pub energy_actuator_net_j: f64,
    /// Positive part of the actuator work (13), what a drive that takes no energy back pays, J.
    pub energy_actuator_positive_j: f64,
    /// Standard error of the two actuator energies, J.
    pub energy_actuator_sigma_j: f64,
    /// Electrical energy into the motor, J.
    pub energy_electrical_j: f64,
    /// Part of it that heated the winding, ∫ I² R dt, J.
    pub energy_copper_j: f64,
    /// Part of it that friction inside the device took: what copper and locomotion leave, J.
    pub energy_friction_inside_j: f64,
    /// Standard error of the electrical energies, J.
    pub energy_electrical_sigma_j: f64,
    /// Cost of transport, positive actuator work over weight and distance; `NaN` without progress.
    pub cot: f64,
    /// Advance that the model predicts, m; `NaN` where it predicts sliding down.
    pub predicted_advance_m: f64,
    /// Energy by (11) that the model predicts, J.
    pub predicted_energy_loss_j: f64,
    /// Positive actuator work that the model predicts, J.
    pub predicted_energy_positive_j: f64,
    /// Forward slide of each tip that the model predicts, m.
    pub predicted_forward_slide_m: [f64; MAX_CELLS],
    /// Backward slide of each tip that the model predicts, m.
    pub predicted_backward_slide_m: [f64; MAX_CELLS],
    /// Tracker samples in the cycle.
    pub samples: u32,
    /// How many cells are in use.
    pub cell_count: u32,
    /// 1 when every tip's deformation was known from the start of the cycle. 0 in the cycle in which they were found: its
    /// figures rest on a guess of how the tips stood at its start, and its standard errors are larger by that.
    pub settled: u32,
    /// +1 crawling forward, −1 backward.
    pub direction: i32,
}
