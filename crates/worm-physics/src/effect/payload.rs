//! `payload`: The worm is heavier than believed.
//!
//! Only weight over stiffness shows, unless the stiffness is known from the bench.

use super::super::physics::Physics;
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "payload",
    sentence: "The worm is heavier than believed.",
    formula: "m = m₀ + Δm",
    signature: "grows with sin λ",
    twins: &["softer pads everywhere (only weight over stiffness shows)"],
    separated_by: "weigh",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "mass_kg",
        unit: "kg",
        about: "mass beyond the believed one, in equal shares",
        neutral: 0.0,
        min: -0.3,
        max: 2.0,
        notable: 0.004,
    }],
    apply,
};

fn apply(physics: &mut Physics, _cell: Option<usize>, values: &[f64]) {
    physics.worm.add_mass_kg(values[0]);
}
