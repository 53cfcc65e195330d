//! `tether-drag`: Something trails behind and resists more the further the worm gets.
//!
//! A cable, a hose, a spring.

use super::super::physics::Physics;
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "tether-drag",
    sentence: "Something trails behind and resists more the further the worm gets.",
    formula: "F = κ (x̄ − x̄₀)",
    signature: "a trend over the distance",
    twins: &[],
    separated_by: "longer run",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "force_per_distance_n_per_m",
        unit: "N/m",
        about: "force for each metre travelled since the start of the run",
        neutral: 0.0,
        min: -30.0,
        max: 100.0,
        notable: 0.3,
    }],
    apply,
};

fn apply(physics: &mut Physics, _cell: Option<usize>, values: &[f64]) {
    physics.laws.tether_n_per_m += values[0];
}
