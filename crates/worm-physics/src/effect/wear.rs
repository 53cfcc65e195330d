//! `wear`: Friction falls from cycle to cycle.
//!
//! Dust, a drying or a warming pad. Each run begins afresh.

use super::super::physics::Physics;
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "wear",
    sentence: "Friction falls from cycle to cycle.",
    formula: "μN = μN₀ (1 − w)^cycles",
    signature: "a trend over the cycles of each run",
    twins: &[],
    separated_by: "repeat from the start",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "loss_per_cycle",
        unit: "",
        about: "share of the friction lost with each cycle since the start of the run",
        neutral: 0.0,
        min: -0.05,
        max: 0.15,
        notable: 0.0005,
    }],
    apply,
};

fn apply(physics: &mut Physics, _cell: Option<usize>, values: &[f64]) {
    physics.laws.wear_per_cycle += values[0];
}
