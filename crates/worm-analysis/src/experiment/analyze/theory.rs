//! What theory says beside the measured cycles.

use crate::experiment::analysis::{CycleValues, TheoryCycle};
use worm_physics::{Cycle, Physics, rigid_energy_j, steady_cycle_of};

/// What theory says of a worm's steady cycle, lengths as they are measured; none where it slides down.
pub(in crate::experiment) fn theory(physics: &Physics, cycle_s: f64) -> Option<TheoryCycle> {
    let outcome = steady_cycle_of(physics, cycle_s);
    let worm = physics.clamped_worm();
    let scale = physics.view.scale;
    let measured_m = |lengths_m: &[f64]| lengths_m.iter().map(|length_m| scale * length_m).collect();
    let Cycle {
        advance_m,
        forward_slide_m,
        backward_slide_m,
        energy_loss_j,
        energy_actuator_net_j,
        energy_actuator_positive_j,
        ..
    } = outcome.cycle()?;
    let cells = worm.cells();
    Some(TheoryCycle {
        values: CycleValues {
            advance_m: scale * advance_m,
            forward_slide_m: measured_m(&forward_slide_m[..cells]),
            backward_slide_m: measured_m(&backward_slide_m[..cells]),
            energy_loss_j: *energy_loss_j,
            energy_actuator_net_j: *energy_actuator_net_j,
            energy_actuator_positive_j: *energy_actuator_positive_j,
        },
        max_deformation_m: worm
            .contacts()
            .iter()
            .map(|contact| scale * contact.forward_bound_m)
            .collect(),
        rigid_energy_j: rigid_energy_j(&worm, *advance_m),
    })
}
