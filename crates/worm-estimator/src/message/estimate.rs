//! The `estimate` topic: what the estimator knows after one tracker sample.

use super::ZeroCopySend;
use super::message;
use worm_physics::MAX_CELLS;

message! {
    /// The estimator's view after one tracker sample; repeated as a heartbeat while no sample comes.
    Estimate = "wormd_estimate_v1", made: time_ns, cells: |estimate| estimate.cell_count, {
        /// Tick number of the state that this estimate rests on.
        state_sequence: u64,
        /// Time of that state, ns of `CLOCK_MONOTONIC`.
        time_ns: u64,
        /// Tracker sample that this estimate rests on, as in [`super::State::sample`].
        sample: u64,
        /// States that the controller published and the estimator never received.
        states_lost: u64,
        /// Gait cycles done, unwrapped.
        phase: f64,
        /// Filtered cell positions, m; `NaN` before the first sample.
        position_m: [f64; MAX_CELLS],
        /// Where each tip touches the canal, m, by equations (1) to (3); `NaN` before the cell's first step.
        contact_m: [f64; MAX_CELLS],
        /// Tip deformation, m, by equation (4).
        deformation_m: [f64; MAX_CELLS],
        /// Contact force on each cell's tip, k δ, N.
        force_n: [f64; MAX_CELLS],
        /// Distance that each tip slid forward since the estimator started, m.
        forward_slide_m: [f64; MAX_CELLS],
        /// Distance that each tip slid backward since the estimator started, m, counted positive.
        backward_slide_m: [f64; MAX_CELLS],
        /// Electrical power into the motor, W.
        power_electrical_w: f64,
        /// Electrical energy into the motor since the estimator started, J.
        energy_electrical_j: f64,
        /// Locomotion energy by losses, equation (11), since the estimator started, J.
        energy_loss_j: f64,
        /// Largest tip deformation in use for each cell, m: measured, or identified on the first cycles.
        max_deformation_m: [f64; MAX_CELLS],
        /// Charge left in the battery by the estimator's account, 0 to 1; `NaN` when no battery is configured.
        battery_fraction: f64,
        /// How many cells are in use.
        cell_count: u32,
        /// Bit i set: tip i slides.
        sliding_mask: u32,
        /// Bit k set: the alarm with code k watches (is calibrated and in a state in which it can tell).
        armed_mask: u32,
        /// Bit k set: the alarm with code k is raised.
        raised_mask: u32,
    }
}
