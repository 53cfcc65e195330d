//! Effects of the elasticity of the pads.

use super::definition::{Apply, Effect, Parameter, Scope, Sense, ShapeStarts, Visible};

/// One cell's pads are stiffer or softer. The friction force stays, so the largest deformation μN/k changes too.
pub(super) static UNEQUAL_STIFFNESS: Effect = Effect {
    name: "unequal-stiffness",
    sentence: "One cell's pads are stiffer or softer than the others'.",
    formula: "kᵢ = f · k",
    signature: "the retraction is shared out differently in every step",
    twins: &[],
    described_twins: &[],
    separated_by: "pull below slip",
    scope: Scope::OneCell,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "stiffness_factor",
        unit: "",
        about: "stiffness of the cell over that of the others",
        neutral: 1.0,
        min: 0.2,
        max: 4.0,
        notable: 0.03,
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Either,
    care: None,
    may_begin: true,
    apply: Apply::Worm(|physics, cell, values| physics.worm.scale_stiffness(cell, values[0])),
};

/// Hardening spring. The friction force stays; the largest deformation shrinks.
pub(super) static HARDENING: Effect = Effect {
    name: "pad-hardening",
    sentence: "The pad grows stiffer the further it is deformed.",
    formula: "F = k δ (1 + β (δ/d)²), d = μN/k",
    signature: "curved loading",
    twins: &[],
    described_twins: &[],
    separated_by: "larger pull",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "hardening",
        unit: "",
        about: "β, relative growth of the secant stiffness at the nominal largest deformation",
        neutral: 0.0,
        min: 0.0,
        max: 4.0,
        notable: 0.05,
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Either,
    care: None,
    may_begin: true,
    apply: Apply::Worm(|physics, _, values| physics.laws.hardening += values[0]),
};

/// A Maxwell branch beside the spring: slow runs feel k alone, fast ones (1 + s) k.
pub(super) static CREEP: Effect = Effect {
    name: "pad-creep",
    sentence: "The pad relaxes under load: a spring and a damper in series beside its spring.",
    formula: "F = k δ + s k (δ − z), τ z′ = δ − z",
    signature: "drift in holds, depends on the rate",
    twins: &[],
    described_twins: &[],
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
            none_at_min: false,
        },
        Parameter {
            name: "time_constant_s",
            unit: "s",
            about: "time in which it relaxes",
            neutral: 0.5,
            min: 0.03,
            max: 20.0,
            notable: 0.3,
            none_at_min: false,
        },
    ],
    shape_starts: ShapeStarts::Grid(&[&[0.1, 0.4, 1.5]]),
    sense: Sense::Either,
    care: None,
    may_begin: true,
    apply: Apply::Worm(|physics, _, values| {
        physics.laws.creep_share += values[0];
        physics.laws.creep_time_s = values[1];
    }),
};

/// Distributed sliders (Iwan model).
pub(super) static HYSTERESIS: Effect = Effect {
    name: "pad-hysteresis",
    sentence: "Part of the pad yields within itself before the tip slides.",
    formula: "F = (1 − s) k δ + Σⱼ yielding elements, yield deformations even up to μN/k",
    signature: "unloading differs from loading, whatever the rate",
    twins: &[],
    described_twins: &[],
    separated_by: "reversal loops",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "yielding_share",
        unit: "",
        about: "share of the pad's stiffness that yields",
        neutral: 0.0,
        min: 0.0,
        max: 0.8,
        notable: 0.03,
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Either,
    care: None,
    may_begin: true,
    apply: Apply::Worm(|physics, _, values| {
        physics.laws.yielding_share = (physics.laws.yielding_share + values[0]).min(0.8)
    }),
};
