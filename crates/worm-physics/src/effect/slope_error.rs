//! `slope-error`: The canal does not lie at the stated angle.
//!
//! The same error on all runs, as of a badly levelled bench.

use super::super::physics::Physics;
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "slope-error",
    sentence: "The canal does not lie at the stated angle.",
    formula: "λ = λ₀ + Δλ",
    signature: "grows with cos λ",
    twins: &[],
    separated_by: "inclinometer, payload",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "angle_deg",
        unit: "deg",
        about: "angle beyond the stated one, the same for all runs",
        neutral: 0.0,
        min: -15.0,
        max: 15.0,
        notable: 0.15,
    }],
    apply,
};

fn apply(physics: &mut Physics, _cell: Option<usize>, values: &[f64]) {
    physics.worm.tilt_rad(values[0].to_radians());
}
