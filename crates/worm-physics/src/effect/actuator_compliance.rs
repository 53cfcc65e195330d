//! `actuator-compliance`: The drive gives way under load: each cell stands off from where the drive has it.
//!
//! A spring between drive and cell; it shows in how the cells stand to each other.

use super::super::physics::Physics;
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "actuator-compliance",
    sentence: "The drive gives way under load: each cell stands off from where the drive has it.",
    formula: "Xᵢ = drive − C Fᵢ",
    signature: "the stepping cell lags under load",
    twins: &[],
    separated_by: "stall test",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "compliance_m_per_n",
        unit: "m/N",
        about: "way by which a cell gives way for each newton of its contact force",
        neutral: 0.0,
        min: 0.0,
        max: 0.001,
        notable: 5e-6,
    }],
    apply,
};

fn apply(physics: &mut Physics, _cell: Option<usize>, values: &[f64]) {
    physics.laws.compliance_m_per_n += values[0];
}
