//! `directional-friction`: Tips hold better in one direction than in the other.
//!
//! Positions cannot tell it from a constant force of Σ kᵢ cᵢ with c = (δ forward − δ backward)/2.

use super::super::physics::Physics;
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "directional-friction",
    sentence: "Tips hold better in one direction than in the other.",
    formula: "μN backward = r · μN forward",
    signature: "the other cells slide back more or less, mostly on slopes",
    twins: &["constant-drag"],
    separated_by: "flip the pads",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "backward_over_forward",
        unit: "",
        about: "friction against sliding backward over that against sliding forward",
        neutral: 1.0,
        min: 0.3,
        max: 2.5,
        notable: 0.02,
    }],
    apply,
};

fn apply(physics: &mut Physics, _cell: Option<usize>, values: &[f64]) {
    physics.worm.scale_backward_friction(values[0]);
}
