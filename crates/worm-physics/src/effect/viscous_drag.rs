//! `viscous-drag`: Something resists each cell in proportion to its velocity.
//!
//! Source of the drag may be a fluid, a lubricant or a sleeve.

use super::super::physics::Physics;
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "viscous-drag",
    sentence: "Something resists each cell in proportion to its velocity.",
    formula: "Fᵢ = c Xᵢ′",
    signature: "seen while a cell steps, in proportion to the speed",
    twins: &[],
    separated_by: "speed sweep",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "drag_n_s_per_m",
        unit: "N s/m",
        about: "resistance of each cell to its velocity",
        neutral: 0.0,
        min: 0.0,
        max: 120.0,
        notable: 1.0,
    }],
    apply,
};

fn apply(physics: &mut Physics, _cell: Option<usize>, values: &[f64]) {
    physics.laws.drag_n_s_per_m += values[0];
}
