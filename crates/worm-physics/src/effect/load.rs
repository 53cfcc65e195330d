//! Effects of external forces and mass.

use super::definition::{Apply, Effect, Parameter, Scope, Sense, ShapeStarts, Visible};

/// A fluid, a lubricant or a sleeve.
pub(super) static VISCOUS_DRAG: Effect = Effect {
    name: "viscous-drag",
    sentence: "Something resists each cell in proportion to its velocity.",
    formula: "Fᵢ = c Xᵢ′",
    signature: "seen while a cell steps, in proportion to the speed",
    twins: &[],
    described_twins: &[],
    separated_by: "speed sweep",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "drag_n_s_per_m",
        unit: "N s/m",
        about: "resistance of each cell to its velocity",
        neutral: 0.0,
        min: 0.0,
        max: 120.0,
        notable: 1.0,
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Either,
    care: None,
    may_begin: true,
    apply: Apply::Worm(|physics, _, values| physics.laws.drag_n_s_per_m += values[0]),
};

/// Positions cannot distinguish it from tips that hold better in one direction.
pub(super) static CONSTANT_DRAG: Effect = Effect {
    name: "constant-drag",
    sentence: "A constant force holds the worm back, or pushes it.",
    formula: "F = const",
    signature: "all steps and all slopes alike",
    twins: &["directional-friction"],
    described_twins: &[],
    separated_by: "cut the tether",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "force_n",
        unit: "N",
        about: "force on the whole worm towards smaller positions",
        neutral: 0.0,
        min: -4.0,
        max: 4.0,
        notable: 0.02,
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Positive,
    care: None,
    may_begin: true,
    apply: Apply::Worm(|physics, _, values| physics.worm.add_resisting_force_n(values[0])),
};

/// Only weight over stiffness shows, unless the stiffness is known from the bench.
pub(super) static PAYLOAD: Effect = Effect {
    name: "payload",
    sentence: "The worm is heavier, or lighter, than believed.",
    formula: "m = m₀ + Δm",
    signature: "grows with sin λ",
    twins: &[],
    described_twins: &["softer, or stiffer, pads everywhere (only weight over stiffness shows)"],
    separated_by: "weigh",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "mass_kg",
        unit: "kg",
        about: "mass beyond the believed one, in equal shares",
        neutral: 0.0,
        min: -0.3,
        max: 2.0,
        notable: 0.004,
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::UsuallyPositive,
    care: None,
    may_begin: true,
    apply: Apply::Worm(|physics, _, values| physics.worm.add_mass_kg(values[0])),
};

/// A cable, a hose, a spring.
pub(super) static TETHER_DRAG: Effect = Effect {
    name: "tether-drag",
    sentence: "Something trails behind and resists more the further the worm gets.",
    formula: "F = κ (x̄ − x̄₀)",
    signature: "a trend over the distance",
    twins: &[],
    described_twins: &[],
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
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Positive,
    care: None,
    may_begin: false,
    apply: Apply::Worm(|physics, _, values| physics.laws.tether_n_per_m += values[0]),
};
