//! `pad-creep`: The pad relaxes under load: a spring and a damper in series beside its spring.
//!
//! A Maxwell branch; slow runs feel k alone, quick ones (1 + s) k.

use super::super::physics::Physics;
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "pad-creep",
    sentence: "The pad relaxes under load: a spring and a damper in series beside its spring.",
    formula: "F = k δ + s k (δ − z), τ z′ = δ − z",
    signature: "drift in holds, depends on the rate",
    twins: &[],
    separated_by: "slower run, dwell",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[
        Parameter {
            name: "creep_share",
            unit: "",
            about: "stiffness of the relaxing branch over that of the pad",
            neutral: 0.0,
            min: 0.0,
            max: 4.0,
            notable: 0.05,
        },
        Parameter {
            name: "time_constant_s",
            unit: "s",
            about: "time in which it relaxes",
            neutral: 0.5,
            min: 0.03,
            max: 20.0,
            notable: 0.3,
        },
    ],
    apply,
};

fn apply(physics: &mut Physics, _cell: Option<usize>, values: &[f64]) {
    physics.laws.creep_share += values[0];
    physics.laws.creep_time_s = values[1];
}
