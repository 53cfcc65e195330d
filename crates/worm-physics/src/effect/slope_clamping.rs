//! `slope-clamping`: The clamps press less, or more, where the canal is steep.
//!
//! Part of the clamp force is the weight across the canal.

use super::super::physics::Physics;
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "slope-clamping",
    sentence: "The clamps press less, or more, where the canal is steep.",
    formula: "μN = μN₀ (1 − s (1 − cos λ))",
    signature: "friction changes with the slope only",
    twins: &[],
    separated_by: "load cell in a clamp",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "sensitivity",
        unit: "",
        about: "s",
        neutral: 0.0,
        min: -2.0,
        max: 3.0,
        notable: 0.05,
    }],
    apply,
};

fn apply(physics: &mut Physics, _cell: Option<usize>, values: &[f64]) {
    physics.slope_clamping += values[0];
}
