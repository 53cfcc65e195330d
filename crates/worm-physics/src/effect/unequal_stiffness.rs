//! `unequal-stiffness`: One cell's pads are stiffer or softer than the others'.
//!
//! The friction force stays, so the largest deformation μN/k changes too.

use super::super::physics::Physics;
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "unequal-stiffness",
    sentence: "One cell's pads are stiffer or softer than the others'.",
    formula: "kᵢ = f · k",
    signature: "the retraction is shared out differently in every step",
    twins: &[],
    separated_by: "pull below slip",
    scope: Scope::OneCell,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "stiffness_factor",
        unit: "",
        about: "stiffness of the cell over that of the others",
        neutral: 1.0,
        min: 0.2,
        max: 4.0,
        notable: 0.03,
    }],
    apply,
};

fn apply(physics: &mut Physics, cell: Option<usize>, values: &[f64]) {
    physics.worm.scale_stiffness(cell, values[0]);
}
