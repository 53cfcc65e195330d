//! Where the electrical energy of a gait cycle went.

use crate::relay::wire::Subject;
use serde::Serialize;
use worm_estimator::message::Cycle;

/// Acceleration of gravity, m/s².
const GRAVITY_M_PER_S2: f64 = 9.81;

/// Where the electrical energy of a cycle went, J; NaN is not known. What the parts leave is work that the tips have not spent yet, or
/// error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Breakdown {
    /// All of it.
    pub(crate) electrical_j: f64,
    /// Heat of the winding.
    pub(crate) copper_j: f64,
    /// Friction inside.
    pub(crate) gears_j: f64,
    /// What the sliding tips spent.
    pub(crate) sliding_j: f64,
    /// What lifted the weight up the slope.
    pub(crate) weight_j: f64,
}

impl Breakdown {
    /// Copper heat, friction inside, and what reaches the canal: there (11) has the sliding tips, and the weight that was lifted.
    pub(crate) fn of(cycle: &Cycle, subject: &Subject) -> Self {
        let forward = if subject.backward { -1.0 } else { 1.0 };
        let rise_m = cycle.advance_m * f64::from(cycle.direction) * forward * subject.slope_deg.to_radians().sin();
        let weight_j = subject.mass_kg * GRAVITY_M_PER_S2 * rise_m;
        let is_known = cycle.energy_loss_sigma_j.is_finite();
        Self {
            electrical_j: cycle.energy_electrical_j,
            copper_j: cycle.energy_copper_j,
            gears_j: cycle.energy_friction_inside_j,
            sliding_j: if is_known {
                cycle.energy_loss_j - weight_j
            } else {
                f64::NAN
            },
            weight_j,
        }
    }
}
