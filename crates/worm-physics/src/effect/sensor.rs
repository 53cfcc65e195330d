//! Effects of the measurement, not of the worm.

use super::definition::{Apply, Effect, Parameter, Scope, Sense, ShapeStarts, Visible};

/// A miscalibrated camera. Positions alone cannot distinguish it from a rescaled stroke, δ and weight/k.
pub(super) static SCALE: Effect = Effect {
    name: "sensor-scale",
    sentence: "The measurement shows lengths too long or too short.",
    formula: "x measured = s · x",
    signature: "every length is rescaled",
    twins: &["lost-stroke"],
    described_twins: &["lost-stroke of all cells with rescaled friction and stiffness"],
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
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Either,
    care: None,
    may_begin: false,
    apply: Apply::Worm(|physics, _, values| physics.view.scale *= values[0]),
};

/// Delay between the true position and its time stamp.
pub(super) static LATENCY: Effect = Effect {
    name: "sensor-latency",
    sentence: "Positions are older than their time stamps say.",
    formula: "x measured(t) = x(t − τ)",
    signature: "time is shifted against the gait phase",
    twins: &[],
    described_twins: &["an offset of the gait clock"],
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
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Either,
    care: None,
    may_begin: false,
    apply: Apply::Worm(|physics, _, values| physics.view.latency_s += values[0]),
};

impl Effect {
    /// Whether the forces on the cells show it: what a tracker does to positions moves nothing.
    pub fn is_visible_in_forces(&self) -> bool {
        let of_tracker = [&SCALE, &LATENCY];
        !self.shows_in_time_alone() && of_tracker.iter().all(|effect| effect.name != self.name)
    }
}
