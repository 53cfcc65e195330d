//! `slick-patch`: A stretch of the canal has less friction.
//!
//! A wet spot, a polished tile.

use super::super::physics::{Patch, Physics};
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "slick-patch",
    sentence: "A stretch of the canal has less friction.",
    formula: "μN = f · μN for tips within [a, a + l]",
    signature: "fixed in space",
    twins: &[],
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
        },
        Parameter {
            name: "from_m",
            unit: "m",
            about: "where the stretch begins along the canal",
            neutral: 0.0,
            min: -10.0,
            max: 10.0,
            notable: 0.01,
        },
        Parameter {
            name: "length_m",
            unit: "m",
            about: "how long it is",
            neutral: 0.04,
            min: 0.005,
            max: 0.5,
            notable: 0.01,
        },
    ],
    apply,
};

fn apply(physics: &mut Physics, _cell: Option<usize>, values: &[f64]) {
    physics.laws.patch = Patch {
        from_m: values[1],
        length_m: values[2],
        friction_factor: values[0],
    };
}
