//! `unequal-clamping`: One cell is clamped harder or softer than the others, so its friction differs.
//!
//! Friction or normal force: only their product shows in positions.

use super::super::physics::Physics;
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "unequal-clamping",
    sentence: "One cell is clamped harder or softer than the others, so its friction differs.",
    formula: "μᵢNᵢ = f · μN",
    signature: "one cell slides more or less; the others retract more or less while it steps",
    twins: &["friction-coefficient of that cell (only μN shows)"],
    separated_by: "pull test of one cell",
    scope: Scope::OneCell,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "friction_factor",
        unit: "",
        about: "friction of the cell over that of the others",
        neutral: 1.0,
        min: 0.2,
        max: 3.0,
        notable: 0.02,
    }],
    apply,
};

fn apply(physics: &mut Physics, cell: Option<usize>, values: &[f64]) {
    physics.worm.scale_friction(cell, values[0]);
}
