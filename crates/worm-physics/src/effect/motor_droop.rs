//! `motor-droop`: The motor turns more slowly under load.
//!
//! It changes when things happen, not where.

use super::super::physics::Physics;
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "motor-droop",
    sentence: "The motor turns more slowly under load.",
    formula: "speed = speed₀ / (1 + d F)",
    signature: "steps take longer on steeper slopes",
    twins: &[],
    separated_by: "encoder",
    scope: Scope::Worm,
    visible: Visible::PhaseTime,
    parameters: &[Parameter {
        name: "slowdown_per_n",
        unit: "1/N",
        about: "share of its speed that the motor loses for each newton of the stepping cell",
        neutral: 0.0,
        min: 0.0,
        max: 2.0,
        notable: 0.01,
    }],
    apply,
};

fn apply(physics: &mut Physics, _cell: Option<usize>, values: &[f64]) {
    physics.slowdown_per_n += values[0];
}
