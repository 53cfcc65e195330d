//! The messages before anything is known.

use crate::message::{Cycle, Estimate};
use worm_physics::MAX_CELLS;

const NOT_KNOWN: [f64; MAX_CELLS] = [f64::NAN; MAX_CELLS];

pub(super) fn estimate(cells: usize) -> Estimate {
    Estimate {
        state_sequence: 0,
        time_ns: 0,
        sample: 0,
        states_lost: 0,
        phase: f64::NAN,
        position_m: NOT_KNOWN,
        contact_m: NOT_KNOWN,
        deformation_m: NOT_KNOWN,
        force_n: NOT_KNOWN,
        forward_slide_m: [0.0; MAX_CELLS],
        backward_slide_m: [0.0; MAX_CELLS],
        power_electrical_w: f64::NAN,
        energy_electrical_j: 0.0,
        energy_loss_j: 0.0,
        max_deformation_m: NOT_KNOWN,
        battery_fraction: f64::NAN,
        cell_count: cells as u32,
        sliding_mask: 0,
        armed_mask: 0,
        raised_mask: 0,
    }
}

/// On a worm that never has positions, the totals that come from them are unknown, too, and not zero.
pub(super) fn estimate_without_positions(cells: usize) -> Estimate {
    Estimate {
        forward_slide_m: NOT_KNOWN,
        backward_slide_m: NOT_KNOWN,
        energy_loss_j: f64::NAN,
        ..estimate(cells)
    }
}

pub(super) fn cycle(cells: usize) -> Cycle {
    Cycle {
        index: 0,
        end_ns: 0,
        duration_s: f64::NAN,
        host_paused_s: f64::NAN,
        advance_m: f64::NAN,
        advance_sigma_m: f64::NAN,
        forward_slide_m: NOT_KNOWN,
        backward_slide_m: NOT_KNOWN,
        energy_loss_j: f64::NAN,
        energy_loss_sigma_j: f64::NAN,
        energy_actuator_net_j: f64::NAN,
        energy_actuator_positive_j: f64::NAN,
        energy_actuator_sigma_j: f64::NAN,
        energy_electrical_j: f64::NAN,
        energy_copper_j: f64::NAN,
        energy_friction_inside_j: f64::NAN,
        energy_electrical_sigma_j: f64::NAN,
        cot: f64::NAN,
        predicted_advance_m: f64::NAN,
        predicted_energy_loss_j: f64::NAN,
        predicted_energy_positive_j: f64::NAN,
        predicted_forward_slide_m: NOT_KNOWN,
        predicted_backward_slide_m: NOT_KNOWN,
        samples: 0,
        cell_count: cells as u32,
        settled: 0,
        direction: 0,
    }
}
