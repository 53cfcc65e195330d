//! `sensor-latency`: Positions are older than their time stamps say.
//!
//! The measurement, not the worm.

use super::super::physics::Physics;
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "sensor-latency",
    sentence: "Positions are older than their time stamps say.",
    formula: "x measured(t) = x(t − τ)",
    signature: "time is shifted against the gait phase",
    twins: &["an offset of the gait clock"],
    separated_by: "sync flash",
    scope: Scope::Worm,
    visible: Visible::RecordedPhase,
    parameters: &[Parameter {
        name: "latency_s",
        unit: "s",
        about: "age of a position at its time stamp",
        neutral: 0.0,
        min: -0.2,
        max: 0.5,
        notable: 0.001,
    }],
    apply,
};

fn apply(physics: &mut Physics, _cell: Option<usize>, values: &[f64]) {
    physics.view.latency_s += values[0];
}
