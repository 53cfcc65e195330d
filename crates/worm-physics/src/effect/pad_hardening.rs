//! `pad-hardening`: The pad grows stiffer the further it is deformed.
//!
//! The friction force stays; the largest deformation shrinks.

use super::super::physics::Physics;
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "pad-hardening",
    sentence: "The pad grows stiffer the further it is deformed.",
    formula: "F = k δ (1 + β (δ/d)²), d = μN/k",
    signature: "curved loading",
    twins: &[],
    separated_by: "larger pull",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "hardening",
        unit: "",
        about: "β, relative growth of the secant stiffness at the nominal largest deformation",
        neutral: 0.0,
        min: 0.0,
        max: 4.0,
        notable: 0.05,
    }],
    apply,
};

fn apply(physics: &mut Physics, _cell: Option<usize>, values: &[f64]) {
    physics.laws.hardening += values[0];
}
