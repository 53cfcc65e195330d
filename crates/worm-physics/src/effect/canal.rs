//! Effects of the slope and the surface of the canal.

use super::definition::{Apply, Effect, Parameter, Scope, Sense, ShapeStarts, Visible};
use crate::physics::Patch;

/// The same error on all runs, as from a badly levelled bench.
pub(super) static SLOPE_ERROR: Effect = Effect {
    name: "slope-error",
    sentence: "The canal does not lie at the stated angle.",
    formula: "λ = λ₀ + Δλ",
    signature: "grows with cos λ",
    twins: &[],
    described_twins: &[],
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
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Either,
    care: Some(1.5),
    may_begin: false,
    apply: Apply::Worm(|physics, _, values| physics.worm.tilt_rad(values[0].to_radians())),
};

/// A wet spot, a polished tile.
pub(super) static SLICK_PATCH: Effect = Effect {
    name: "slick-patch",
    sentence: "A stretch of the canal has less friction.",
    formula: "μN = f · μN for tips within [a, a + l]",
    signature: "fixed in space",
    twins: &[],
    described_twins: &[],
    separated_by: "shift the start",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[
        Parameter {
            name: "friction_factor",
            unit: "",
            about: "friction there over that elsewhere",
            neutral: 1.0,
            min: 0.1,
            max: 1.0,
            notable: 0.05,
            none_at_min: false,
        },
        Parameter {
            name: "from_m",
            unit: "m",
            about: "where the stretch begins along the canal",
            neutral: 0.0,
            min: -10.0,
            max: 10.0,
            notable: 0.01,
            none_at_min: false,
        },
        Parameter {
            name: "length_m",
            unit: "m",
            about: "how long it is",
            neutral: 0.04,
            min: 0.005,
            max: 0.5,
            notable: 0.01,
            none_at_min: false,
        },
    ],
    shape_starts: ShapeStarts::AlongCanal {
        spacing_m: 0.015,
        lengths_m: &[0.02, 0.05],
    },
    sense: Sense::Either,
    care: None,
    may_begin: false,
    apply: Apply::Worm(|physics, _, values| {
        physics.laws.patch = Patch {
            from_m: values[1],
            length_m: values[2],
            friction_factor: values[0],
        };
    }),
};

/// Part of the clamping force is the component of the weight across the canal.
pub(super) static SLOPE_CLAMPING: Effect = Effect {
    name: "slope-clamping",
    sentence: "The clamps press less, or more, where the canal is steep.",
    formula: "μN = μN₀ (1 − s (1 − cos λ))",
    signature: "friction changes with the slope only",
    twins: &[],
    described_twins: &[],
    separated_by: "load cell in a clamp",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "sensitivity",
        unit: "",
        about: "share of the friction lost from the level to the vertical",
        neutral: 0.0,
        min: -2.0,
        max: 3.0,
        notable: 0.05,
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Either,
    care: None,
    may_begin: false,
    apply: Apply::Worm(|physics, _, values| physics.slope_clamping += values[0]),
};
