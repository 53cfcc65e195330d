//! `step-overlap`: The next cell starts before the last one ends.
//!
//! A cam whose ramps overlap.

use super::super::physics::Physics;
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "step-overlap",
    sentence: "The next cell starts before the last one ends.",
    formula: "step k runs from k − o to k + 1, in steps",
    signature: "two cells move together",
    twins: &[],
    separated_by: "encoder",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "overlap",
        unit: "",
        about: "share of a step by which it begins early",
        neutral: 0.0,
        min: 0.0,
        max: 0.5,
        notable: 0.005,
    }],
    apply,
};

fn apply(physics: &mut Physics, _cell: Option<usize>, values: &[f64]) {
    physics.laws.overlap = (physics.laws.overlap + values[0]).min(0.5);
}
