//! `lost-stroke`: Cells step by less than the stroke.
//!
//! A worn cam, a slipping belt. A negative share is a longer stroke.

use super::super::physics::Physics;
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "lost-stroke",
    sentence: "Cells step by less than the stroke.",
    formula: "Lsᵢ = (1 − l) Ls",
    signature: "in every step; one cell falls behind the others cycle by cycle",
    twins: &["sensor-scale, where all cells lose alike"],
    separated_by: "caliper",
    scope: Scope::AnyCells,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "lost_share",
        unit: "",
        about: "share of the stroke that is lost",
        neutral: 0.0,
        min: -0.3,
        max: 0.7,
        notable: 0.005,
    }],
    apply,
};

fn apply(physics: &mut Physics, cell: Option<usize>, values: &[f64]) {
    physics.worm.scale_stroke(cell, 1.0 - values[0]);
}
