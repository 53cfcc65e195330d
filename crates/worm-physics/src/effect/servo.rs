//! Effects of a servo: gears, bridge, supply, and its mounting.

use super::definition::{Apply, Effect, Parameter, Scope, Sense, ShapeStarts, Visible};

/// Adds a severity to a law, and gives it the shape that comes with it. At a severity of 0 the law stays as it is.
fn add<const SHAPES: usize>(values: &[f64], severity: &mut f64, shapes: [&mut f64; SHAPES]) {
    if values[0] == 0.0 {
        return;
    }
    *severity += values[0];
    for (shape, value) in shapes.into_iter().zip(&values[1..]) {
        *shape = *value;
    }
}

/// Lubricant squeezed out at rest.
pub(super) static STRIBECK: Effect = Effect {
    name: "stribeck-friction",
    sentence: "Friction is larger at rest and falls as the gears begin to turn.",
    formula: "F = F_dry + F_s exp(−(ω/ω_s)²)",
    signature: "slow motion goes in jumps; little changes in fast motion",
    twins: &[],
    described_twins: &[],
    separated_by: "a slow ramp",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[
        Parameter {
            name: "extra_n_m",
            unit: "N m",
            about: "friction at rest beyond that of motion",
            neutral: 0.0,
            min: 0.0,
            max: 0.2,
            notable: 0.002,
            none_at_min: false,
        },
        Parameter {
            name: "speed_rad_s",
            unit: "rad/s",
            about: "speed at which that has fallen to 1/e",
            neutral: 0.3,
            min: 0.02,
            max: 8.0,
            notable: 0.05,
            none_at_min: false,
        },
    ],
    shape_starts: ShapeStarts::Grid(&[&[0.05, 0.3, 1.5]]),
    sense: Sense::Positive,
    care: None,
    may_begin: false,
    apply: Apply::Servo(|physics, values| {
        let laws = &mut physics.laws;
        add(values, &mut laws.stribeck_n_m, [&mut laws.stribeck_rad_s]);
    }),
};

/// Teeth that slide on each other under load.
pub(super) static LOAD: Effect = Effect {
    name: "load-friction",
    sentence: "Friction grows in proportion to the torque on the gears.",
    formula: "F = F_dry + c |s τ_motor + (1 − s) τ_arm|",
    signature: "an arm under load needs more torque to be lifted than to be held, in proportion",
    twins: &[],
    described_twins: &[],
    separated_by: "another mass on the arm",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[
        Parameter {
            name: "coefficient",
            unit: "",
            about: "friction per torque on the gears",
            neutral: 0.0,
            min: 0.0,
            max: 1.5,
            notable: 0.02,
            none_at_min: false,
        },
        Parameter {
            name: "motor_share",
            unit: "",
            about: "which end of the gear train presses the gears: 1 the motor's torque, 0 the arm's",
            neutral: 0.5,
            min: 0.0,
            max: 1.0,
            notable: 0.05,
            none_at_min: false,
        },
    ],
    shape_starts: ShapeStarts::Grid(&[&[0.0, 0.5, 1.0]]),
    sense: Sense::Positive,
    care: None,
    may_begin: false,
    apply: Apply::Servo(|physics, values| {
        let laws = &mut physics.laws;
        add(values, &mut laws.load_friction, [&mut laws.load_share]);
    }),
};

/// Plastic teeth and axles that bend under load.
pub(super) static LOAD_SQUARED: Effect = Effect {
    name: "load-squared-friction",
    sentence: "Friction grows with the square of the torque on the gears.",
    formula: "F = F_dry + q (s τ_motor + (1 − s) τ_arm)²",
    signature: "as load-friction, and the more the heavier the load",
    twins: &[],
    described_twins: &[],
    separated_by: "two more masses on the arm",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[
        Parameter {
            name: "coefficient_per_n_m",
            unit: "1/(N m)",
            about: "friction per square of the torque on the gears",
            neutral: 0.0,
            min: 0.0,
            max: 5.0,
            notable: 0.05,
            none_at_min: false,
        },
        Parameter {
            name: "motor_share",
            unit: "",
            about: "which end of the gear train presses the gears: 1 the motor's torque, 0 the arm's",
            neutral: 0.5,
            min: 0.0,
            max: 1.0,
            notable: 0.05,
            none_at_min: false,
        },
    ],
    shape_starts: ShapeStarts::Grid(&[&[0.0, 0.5, 1.0]]),
    sense: Sense::Positive,
    care: None,
    may_begin: false,
    apply: Apply::Servo(|physics, values| {
        let laws = &mut physics.laws;
        add(values, &mut laws.load_squared_per_n_m, [&mut laws.load_squared_share]);
    }),
};

/// Gears that are less efficient one way.
pub(super) static BACK_DRIVING: Effect = Effect {
    name: "back-driving-friction",
    sentence: "Friction differs where the load drives the motor.",
    formula: "F · r where the arm drives",
    signature: "lowering differs from lifting",
    twins: &[],
    described_twins: &[],
    separated_by: "lift and lower slowly, each at several loads",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "ratio",
        unit: "",
        about: "friction where the arm drives, over that where the motor does",
        neutral: 1.0,
        min: 0.0,
        max: 4.0,
        notable: 0.1,
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Either,
    care: None,
    may_begin: false,
    apply: Apply::Servo(|physics, values| physics.laws.back_driving *= values[0]),
};

/// Worn or loose gears.
pub(super) static PLAY: Effect = Effect {
    name: "gear-backlash",
    sentence: "Play in the gears must be run through before the arm follows.",
    formula: "rotor − arm within ± p/2",
    signature: "the arm is loose where its torque changes sign",
    twins: &[],
    described_twins: &[],
    separated_by: "move the arm by hand with the torque on",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "play_rad",
        unit: "rad",
        about: "play between gears and arm",
        neutral: 0.0,
        min: 0.0,
        max: 0.15,
        notable: 0.002,
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Positive,
    care: None,
    may_begin: false,
    apply: Apply::Servo(|physics, values| physics.laws.play_rad += values[0]),
};

/// Teeth, and the magnets of the motor.
pub(super) static RIPPLE: Effect = Effect {
    name: "gear-ripple",
    sentence: "A torque returns with the angle, as teeth and magnets pass each other.",
    formula: "τ = a sin(w θ + 2π φ)",
    signature: "the gap returns at the same angles",
    twins: &[],
    described_twins: &[],
    separated_by: "a slow turn without the arm",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[
        Parameter {
            name: "amplitude_n_m",
            unit: "N m",
            about: "amplitude of the torque",
            neutral: 0.0,
            min: -0.2,
            max: 0.2,
            notable: 0.002,
            none_at_min: false,
        },
        Parameter {
            name: "waves_per_turn",
            unit: "",
            about: "how often it returns in a turn of the output",
            neutral: 12.0,
            min: 2.0,
            max: 90.0,
            notable: 0.3,
            none_at_min: false,
        },
        Parameter {
            name: "phase",
            unit: "",
            about: "where the wave is at angle 0, turns of its own",
            neutral: 0.0,
            min: 0.0,
            max: 1.0,
            notable: 0.02,
            none_at_min: false,
        },
    ],
    shape_starts: ShapeStarts::Grid(&[&[5.0, 8.0, 12.0, 18.0, 27.0, 40.0], &[0.0, 0.25]]),
    sense: Sense::Either,
    care: None,
    may_begin: false,
    apply: Apply::Servo(|physics, values| {
        let laws = &mut physics.laws;
        add(
            values,
            &mut laws.ripple_n_m,
            [&mut laws.ripple_waves, &mut laws.ripple_phase],
        );
    }),
};

/// Thin leads, a weak battery. Bench leads seldom have more than 0.3 Ω.
pub(super) static SAG: Effect = Effect {
    name: "supply-sag",
    sentence: "The supply's voltage falls under current.",
    formula: "V = V₀ − r D I",
    signature: "large duties give less than in proportion",
    twins: &[],
    described_twins: &[],
    separated_by: "a meter at the servo's plug, or a stiffer supply",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "supply_ohm",
        unit: "Ω",
        about: "resistance between the supply and the servo",
        neutral: 0.0,
        min: 0.0,
        max: 6.0,
        notable: 0.05,
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Positive,
    care: Some(0.3),
    may_begin: false,
    apply: Apply::Servo(|physics, values| physics.laws.supply_ohm += values[0]),
};

/// A winding that gets rid of its heat slowly.
pub(super) static HEAT: Effect = Effect {
    name: "winding-heat",
    sentence: "The winding heats up, and its resistance grows.",
    formula: "R = R₂₅ (1 + 0.0039 ΔT)",
    signature: "the servo grows weaker in the course of a run",
    twins: &[],
    described_twins: &[],
    separated_by: "the same run with a warm servo",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[
        Parameter {
            name: "heat_k_per_j",
            unit: "K/J",
            about: "heating of the winding per joule of copper heat",
            neutral: 0.0,
            min: 0.0,
            max: 10.0,
            notable: 0.15,
            none_at_min: false,
        },
        Parameter {
            name: "cooling_s",
            unit: "s",
            about: "time in which it cools down to the case",
            neutral: 10.0,
            min: 0.5,
            max: 200.0,
            notable: 1.0,
            none_at_min: false,
        },
    ],
    shape_starts: ShapeStarts::Grid(&[&[5.0, 30.0]]),
    sense: Sense::Positive,
    care: None,
    may_begin: false,
    apply: Apply::Servo(|physics, values| {
        let laws = &mut physics.laws;
        add(values, &mut laws.heat_k_per_j, [&mut laws.cooling_s]);
    }),
};

/// Filters and the loop's own period.
pub(super) static DELAY: Effect = Effect {
    name: "loop-delay",
    sentence: "The position loop acts on a position that is some time old.",
    formula: "D(t) of the angle at t − d",
    signature: "it overshoots, and swings with large gains",
    twins: &[],
    described_twins: &[],
    separated_by: "a step at the largest gain",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "delay_s",
        unit: "s",
        about: "age of the position that the loop acts on",
        neutral: 0.0,
        min: 0.0,
        max: 0.03,
        notable: 0.0005,
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Positive,
    care: None,
    may_begin: false,
    apply: Apply::Servo(|physics, values| physics.laws.delay_s += values[0]),
};

/// Dead time of the bridge.
pub(super) static DEAD_DUTY: Effect = Effect {
    name: "duty-dead-band",
    sentence: "The bridge does nothing below some duty.",
    formula: "D = 0 for |D| < d",
    signature: "small errors stay",
    twins: &[],
    described_twins: &[],
    separated_by: "a slow ramp at a small gain",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "dead_duty",
        unit: "",
        about: "duty below which the bridge does nothing",
        neutral: 0.0,
        min: 0.0,
        max: 0.2,
        notable: 0.003,
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Positive,
    care: None,
    may_begin: false,
    apply: Apply::Servo(|physics, values| physics.laws.dead_duty = physics.laws.dead_duty.max(values[0])),
};

/// A horn that was put on by eye.
pub(super) static ZERO: Effect = Effect {
    name: "zero-offset",
    sentence: "The arm does not hang down at angle 0.",
    formula: "sin(θ − θ₀)",
    signature: "one side is lifted further than the other",
    twins: &[],
    described_twins: &[],
    separated_by: "let the arm hang with the torque off",
    scope: Scope::Worm,
    visible: Visible::Positions,
    parameters: &[Parameter {
        name: "zero_rad",
        unit: "rad",
        about: "angle at which the arm hangs down",
        neutral: 0.0,
        min: -0.5,
        max: 0.5,
        notable: 0.002,
        none_at_min: false,
    }],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Either,
    care: Some(0.1),
    may_begin: false,
    apply: Apply::Servo(|physics, values| physics.pendulum.zero_rad += values[0]),
};
