//! `sensor-scale`: The measurement shows lengths too long or too short.
//!
//! The measurement, not the worm. Positions alone cannot tell it from a rescaled stroke, δ and weight/k.

use super::super::physics::Physics;
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "sensor-scale",
    sentence: "The measurement shows lengths too long or too short.",
    formula: "x measured = s · x",
    signature: "every length is rescaled",
    twins: &["lost-stroke of all cells with rescaled friction and stiffness"],
    separated_by: "ruler",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "scale",
        unit: "",
        about: "measured length over true length",
        neutral: 1.0,
        min: 0.5,
        max: 2.0,
        notable: 0.005,
    }],
    apply,
};

fn apply(physics: &mut Physics, _cell: Option<usize>, values: &[f64]) {
    physics.view.scale *= values[0];
}
