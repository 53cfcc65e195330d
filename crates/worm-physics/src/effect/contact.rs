//! Effects of the friction between tips and wall.

use super::definition::{Apply, Effect, Parameter, Scope, Sense, ShapeStarts, Visible};

/// One cell holds harder or softer than the others. Positions show only the product of friction coefficient and normal force.
pub(super) static UNEQUAL_CLAMPING: Effect = Effect {
    name: "unequal-clamping",
    sentence: "One cell is clamped harder or softer than the others, so its friction differs.",
    formula: "μᵢNᵢ = f · μN",
    signature: "one cell slides more or less; the others retract more or less while it steps",
    twins: &[],
    described_twins: &["friction-coefficient of that cell (only μN shows)"],
    separated_by: "pull test of one cell",
    scope: Scope::OneCell,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "friction_factor",
        unit: "",
        about: "friction of the cell over that of the others",
        neutral: 1.0,
        min: 0.2,
        max: 3.0,
        notable: 0.02,
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Either,
    care: None,
    may_begin: true,
    apply: Apply::Worm(|physics, cell, values| physics.worm.scale_friction(cell, values[0])),
};

/// Tips hold better in one direction than in the other. Positions cannot distinguish it from a constant force of Σ kᵢ cᵢ with
/// c = (δ forward − δ backward)/2.
pub(super) static DIRECTIONAL_FRICTION: Effect = Effect {
    name: "directional-friction",
    sentence: "Tips hold better in one direction than in the other.",
    formula: "μN backward = r · μN forward",
    signature: "the other cells slide back more or less, mostly on slopes",
    twins: &["constant-drag"],
    described_twins: &[],
    separated_by: "flip the pads",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "backward_over_forward",
        unit: "",
        about: "friction against sliding backward over that against sliding forward",
        neutral: 1.0,
        min: 0.3,
        max: 2.5,
        notable: 0.02,
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Either,
    care: None,
    may_begin: true,
    apply: Apply::Worm(|physics, _, values| physics.worm.scale_backward_friction(values[0])),
};

/// Static friction above kinetic friction, by a rate and state law (Dieterich 1979, Ruina 1983): slip loses the excess, rest restores
/// it. At a steady speed v the excess is the fraction 1/(1 + v t/d) of its value at rest, as in a Stribeck curve of speed d/t. Section 2
/// of the paper measures coefficients of 0.7 at rest and 0.5 in motion.
pub(super) static BREAKAWAY_FRICTION: Effect = Effect {
    name: "breakaway-friction",
    sentence: "A resting tip holds more than a sliding one; the force drops when sliding begins.",
    formula: "limit = μN (1 + (r − 1) θ), θ′ = (1 − θ)/t − θ |v|/d",
    signature: "a jump when sliding starts",
    twins: &[],
    described_twins: &[],
    separated_by: "slow ramp",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[
        Parameter {
            name: "static_over_kinetic",
            unit: "",
            about: "static friction over kinetic",
            neutral: 1.0,
            min: 1.0,
            max: 2.5,
            notable: 0.03,
            none_at_min: false,
        },
        Parameter {
            name: "slip_m",
            unit: "m",
            about: "slip over which it drops",
            neutral: 1e-4,
            min: 1e-6,
            max: 3e-3,
            notable: 3e-5,
            none_at_min: false,
        },
        Parameter {
            name: "grip_s",
            unit: "s",
            about: "rest in which it comes back",
            neutral: 0.1,
            min: 0.005,
            max: 3.0,
            notable: 0.05,
            none_at_min: false,
        },
    ],
    shape_starts: ShapeStarts::Grid(&[&[1e-5, 1e-4, 1e-3], &[0.05, 0.3]]),
    sense: Sense::Either,
    care: None,
    may_begin: true,
    apply: Apply::Worm(|physics, _, values| {
        physics.laws.static_over_kinetic *= values[0];
        physics.laws.slip_m = values[1];
        physics.laws.grip_s = values[2];
    }),
};

/// Friction falls with each cycle: dust, a pad that dries or warms up. Each run starts afresh.
pub(super) static WEAR: Effect = Effect {
    name: "wear",
    sentence: "Friction falls from cycle to cycle.",
    formula: "μN = μN₀ (1 − w)^cycles",
    signature: "a trend over the cycles of each run",
    twins: &[],
    described_twins: &[],
    separated_by: "repeat from the start",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "loss_per_cycle",
        unit: "",
        about: "share of the friction lost with each cycle since the start of the run",
        neutral: 0.0,
        min: -0.05,
        max: 0.15,
        notable: 0.0005,
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Positive,
    care: None,
    may_begin: false,
    apply: Apply::Worm(|physics, _, values| physics.laws.wear_per_cycle += values[0]),
};
