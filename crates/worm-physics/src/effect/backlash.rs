//! `backlash`: Play between the drive and a cell must be run through before the cell follows.
//!
//! Without a recorded phase it looks like a motor that pauses between steps.

use super::super::physics::Physics;
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "backlash",
    sentence: "Play between the drive and a cell must be run through before the cell follows.",
    formula: "extension = max(0, Ls u − p)",
    signature: "each step starts late and ends short",
    twins: &[],
    separated_by: "encoder",
    scope: Scope::Worm,
    visible: Visible::RecordedPhase,
    parameters: &[Parameter {
        name: "play_m",
        unit: "m",
        about: "play",
        neutral: 0.0,
        min: 0.0,
        max: 0.005,
        notable: 2e-5,
    }],
    apply,
};

fn apply(physics: &mut Physics, _cell: Option<usize>, values: &[f64]) {
    physics.laws.play_m += values[0];
}
