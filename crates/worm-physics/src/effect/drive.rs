//! Effects of motor, cam and transmission.

use super::definition::{Apply, Effect, Parameter, Scope, Sense, ShapeStarts, Visible};

/// A worn cam, a slipping belt. A negative value is a longer stroke.
pub(super) static LOST_STROKE: Effect = Effect {
    name: "lost-stroke",
    sentence: "Cells step by less than the stroke.",
    formula: "Lsᵢ = (1 − l) Ls",
    signature: "in every step; one cell falls behind the others cycle by cycle",
    twins: &["sensor-scale"],
    described_twins: &["sensor-scale, where all cells lose alike"],
    separated_by: "caliper",
    scope: Scope::AnyCells,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "lost_share",
        unit: "",
        about: "share of the stroke that is lost",
        neutral: 0.0,
        min: -0.3,
        max: 0.7,
        notable: 0.005,
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Positive,
    care: Some(0.075),
    may_begin: true,
    apply: Apply::Worm(|physics, cell, values| physics.worm.scale_stroke(cell, 1.0 - values[0])),
};

/// A spring between drive and cell; it shows in the distances between cells.
pub(super) static ACTUATOR_COMPLIANCE: Effect = Effect {
    name: "actuator-compliance",
    sentence: "The drive gives way under load: each cell stands off from where the drive has it.",
    formula: "Xᵢ = drive − C Fᵢ",
    signature: "the stepping cell lags under load",
    twins: &[],
    described_twins: &[],
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
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Either,
    care: None,
    may_begin: true,
    apply: Apply::Worm(|physics, _, values| physics.laws.compliance_m_per_n += values[0]),
};

/// Without a recorded phase it looks like a motor that pauses between steps.
pub(super) static BACKLASH: Effect = Effect {
    name: "backlash",
    sentence: "Play between the drive and a cell must be run through before the cell follows.",
    formula: "Xᵢ = drive − z, |z| ≤ ½ p, between the flanks Xᵢ′ = body − Fᵢ / c",
    signature: "each step starts late and ends short; the cell comes forward again when its load turns",
    twins: &[],
    described_twins: &[],
    separated_by: "encoder",
    scope: Scope::Worm,
    visible: Visible::RecordedPhase,
    parameters: &[
        Parameter {
            name: "play_m",
            unit: "m",
            about: "play",
            neutral: 0.0,
            min: 0.0,
            max: 0.005,
            notable: 2e-5,
            none_at_min: false,
        },
        Parameter {
            name: "damping_n_s_per_m",
            unit: "N s/m",
            about: "c, damping of a cell against the body while it crosses the play",
            neutral: 20.0,
            min: 1.0,
            max: 300.0,
            notable: 10.0,
            none_at_min: true,
        },
    ],
    shape_starts: ShapeStarts::Grid(&[&[10.0, 60.0]]),
    sense: Sense::Either,
    care: None,
    may_begin: true,
    apply: Apply::Worm(|physics, _, values| {
        physics.laws.play_m += values[0];
        physics.laws.play_damping_n_s_per_m = values[1];
    }),
};

/// A cam whose ramps overlap.
pub(super) static STEP_OVERLAP: Effect = Effect {
    name: "step-overlap",
    sentence: "The next cell starts before the last one ends.",
    formula: "step k runs from k − o to k + 1, in steps",
    signature: "two cells move together",
    twins: &[],
    described_twins: &[],
    separated_by: "encoder",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "overlap",
        unit: "",
        about: "share of a step by which it begins early",
        neutral: 0.0,
        min: 0.0,
        max: 0.5,
        notable: 0.005,
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Either,
    care: None,
    may_begin: false,
    apply: Apply::Worm(|physics, _, values| physics.laws.overlap = (physics.laws.overlap + values[0]).min(0.5)),
};

/// It changes when things happen and not where.
pub(super) static MOTOR_DROOP: Effect = Effect {
    name: "motor-droop",
    sentence: "The motor turns more slowly under load.",
    formula: "speed = speed₀ / (1 + d F)",
    signature: "steps take longer on steeper slopes",
    twins: &[],
    described_twins: &[],
    separated_by: "encoder",
    scope: Scope::Worm,
    visible: Visible::PhaseTime,
    parameters: &[Parameter {
        name: "slowdown_per_n",
        unit: "1/N",
        about: "share of its speed that the motor loses for each newton of the stepping cell",
        neutral: 0.0,
        min: 0.0,
        max: 2.0,
        notable: 0.01,
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Either,
    care: None,
    may_begin: true,
    apply: Apply::Worm(|physics, _, values| physics.slowdown_per_n += values[0]),
};
