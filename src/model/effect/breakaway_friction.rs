//! `breakaway-friction`: A resting tip holds more than a sliding one; the force drops when sliding begins.
//!
//! Source: section 2 of the paper measures 0.7 against 0.5.

use super::super::physics::Physics;
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "breakaway-friction",
    sentence: "A resting tip holds more than a sliding one; the force drops when sliding begins.",
    formula: "static limit = r · μN",
    signature: "a jump when sliding starts",
    twins: &[],
    separated_by: "slow ramp",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "static_over_kinetic",
        unit: "",
        about: "static friction over kinetic",
        neutral: 1.0,
        least: 1.0,
        most: 2.5,
        notable: 0.03,
    }],
    apply,
};

fn apply(physics: &mut Physics, _cell: Option<usize>, values: &[f64]) {
    physics.laws.static_over_kinetic *= values[0];
}
