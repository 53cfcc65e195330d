//! The `cycle` topic: what one gait cycle did and cost.

use super::ZeroCopySend;
use super::message;
use worm_physics::MAX_CELLS;

message! {
    /// One finished gait cycle, with the model's prediction beside the measurement.
    Cycle = "wormd_cycle_v2", made: end_ns, cells: |cycle| cycle.cell_count, {
        /// Number of the cycle since crawling began, from 0.
        index: u64,
        /// When the cycle ended, ns of `CLOCK_MONOTONIC`.
        end_ns: u64,
        /// How long the cycle took, s.
        duration_s: f64,
        /// Part of it in which the computer paused and ran no controller, s: 0 in an undisturbed cycle. The energies leave out what
        /// the worm did not live through.
        host_paused_s: f64,
        /// Distance travelled: mean over the cells of the net displacement, m.
        advance_m: f64,
        /// Standard error of the advance, m.
        advance_sigma_m: f64,
        /// Distance each tip slid forward, m.
        forward_slide_m: [f64; MAX_CELLS],
        /// Distance each tip slid backward, m, counted positive.
        backward_slide_m: [f64; MAX_CELLS],
        /// Energy by losses and weight, equation (11), J; like all that is measured by positions `NaN` when the tracker was silent.
        energy_loss_j: f64,
        /// Standard error of `energy_loss_j`, J.
        energy_loss_sigma_j: f64,
        /// Net actuator work, equation (13), J.
        energy_actuator_net_j: f64,
        /// Positive part of the actuator work (13), what a drive that takes no energy back pays, J.
        energy_actuator_positive_j: f64,
        /// Standard error of the two actuator energies, J.
        energy_actuator_sigma_j: f64,
        /// Electrical energy into the motor, J.
        energy_electrical_j: f64,
        /// Part of it that heated the winding, ∫ I² R dt, J.
        energy_copper_j: f64,
        /// Part of it that friction inside the device took: what copper and locomotion leave, J.
        energy_friction_inside_j: f64,
        /// Standard error of the electrical energies, J.
        energy_electrical_sigma_j: f64,
        /// Cost of transport, positive actuator work over weight and distance; `NaN` without progress.
        cot: f64,
        /// Advance that the model predicts, m; `NaN` where it predicts sliding down.
        predicted_advance_m: f64,
        /// Energy by (11) that the model predicts, J.
        predicted_energy_loss_j: f64,
        /// Positive actuator work that the model predicts, J.
        predicted_energy_positive_j: f64,
        /// Forward slide of each tip that the model predicts, m.
        predicted_forward_slide_m: [f64; MAX_CELLS],
        /// Backward slide of each tip that the model predicts, m.
        predicted_backward_slide_m: [f64; MAX_CELLS],
        /// Tracker samples in the cycle.
        samples: u32,
        /// How many cells are in use.
        cell_count: u32,
        /// 1 when every tip's deformation was known from the start of the cycle. 0 in the cycle in which they were found: its
        /// figures rest on a guess of how the tips stood at its start, and its standard errors are larger by that.
        settled: u32,
        /// +1 crawling forward, −1 backward.
        direction: i32,
    }
}
