//! `breakaway-friction`: A resting tip holds more than a sliding one; the force drops when sliding begins.
//!
//! What it holds beyond its kinetic friction is lost by slip and won back by rest (rate and state: Dieterich 1979, Ruina 1983):
//! at a steady speed v it is the share 1/(1 + v t/d) of what it is at rest, as in Stribeck's curve at the speed d/t.
//!
//! Source: section 2 of the paper measures 0.7 against 0.5.

use super::super::physics::Physics;
use super::{Effect, Parameter, Scope, Visible};

pub(super) static EFFECT: Effect = Effect {
    name: "breakaway-friction",
    sentence: "A resting tip holds more than a sliding one; the force drops when sliding begins.",
    formula: "limit = μN (1 + (r − 1) θ), θ′ = (1 − θ)/t − θ |v|/d",
    signature: "a jump when sliding starts",
    twins: &[],
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
        },
        Parameter {
            name: "slip_m",
            unit: "m",
            about: "slip over which it drops",
            neutral: 1e-4,
            min: 1e-6,
            max: 3e-3,
            notable: 3e-5,
        },
        Parameter {
            name: "grip_s",
            unit: "s",
            about: "rest in which it comes back",
            neutral: 0.1,
            min: 0.005,
            max: 3.0,
            notable: 0.05,
        },
    ],
    apply,
};

fn apply(physics: &mut Physics, _cell: Option<usize>, values: &[f64]) {
    physics.laws.static_over_kinetic *= values[0];
    physics.laws.slip_m = values[1];
    physics.laws.grip_s = values[2];
}
