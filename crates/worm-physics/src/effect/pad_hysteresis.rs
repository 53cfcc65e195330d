//! `pad-hysteresis`: Part of the pad yields within itself before the tip slides.
//!
//! Distributed sliders after Iwan.

use super::super::physics::Physics;
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "pad-hysteresis",
    sentence: "Part of the pad yields within itself before the tip slides.",
    formula: "F = (1 − s) k δ + Σⱼ yielding elements, yield deformations even up to μN/k",
    signature: "unloading differs from loading, whatever the rate",
    twins: &[],
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
    }],
    apply,
};

fn apply(physics: &mut Physics, _cell: Option<usize>, values: &[f64]) {
    physics.laws.yielding_share = (physics.laws.yielding_share + values[0]).min(0.8);
}
