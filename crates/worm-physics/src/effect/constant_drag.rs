//! `constant-drag`: A constant force holds the worm back.
//!
//! Positions cannot tell it from tips that hold better in one direction.

use super::super::physics::Physics;
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "constant-drag",
    sentence: "A constant force holds the worm back.",
    formula: "F = const",
    signature: "all steps and all slopes alike",
    twins: &["directional-friction"],
    separated_by: "cut the tether",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "force_n",
        unit: "N",
        about: "force on the whole worm towards smaller positions",
        neutral: 0.0,
        min: -4.0,
        max: 4.0,
        notable: 0.02,
    }],
    apply,
};

fn apply(physics: &mut Physics, _cell: Option<usize>, values: &[f64]) {
    physics.worm.add_resisting_force_n(values[0]);
}
