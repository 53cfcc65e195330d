//! LuGre's friction: a bristle that yields from the beginning, its micro-damping, and a viscous part.
//!
//! With z the bristle's bend, v the tip's speed and g the limit: z' = v (1 − σ₀ |z| sgn(v z) / g) and
//! F = σ₀ z + σ₁ z' + σ₂ v. A tip slides at σ₀ z = g.

use super::contact::{Gone, Push};

/// Figures of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lugre {
    /// σ₁ over σ₀, s.
    pub damping_s: f64,
    /// σ₂ over the limit, s/m.
    pub drag_s_per_m: f64,
}

impl Lugre {
    pub fn go(&self, push: &Push) -> Gone {
        let yielding = push.bristle_n_per_m / push.limit_n;
        yield_at(push, yielding, self.damping_s, self.drag_s_per_m)
    }
}

/// The end of a time step with z' = v (1 − `yielding` z), `yielding` in 1/m.
///
/// With s the tip's way, (pull − slack s) = σ₀ z₁ + σ₁ (z₁ − z) / Δt + σ₂ s / Δt and z₁ = (z + s) / (1 + yielding s) are a
/// quadratic equation for s, so neither stiffness nor damping bounds the time step.
pub fn yield_at(push: &Push, yielding: f64, damping_s: f64, drag_s_per_m: f64) -> Gone {
    // Beyond the limit, which has fallen then, a damped unbending would push the tip on: LuGre's known loss of passivity.
    let bends = push.bristle_n_per_m * push.bristle_m < push.limit_n;
    let damping = if bends {
        push.bristle_n_per_m * damping_s / push.step_s
    } else {
        0.0
    };
    let slack = push.slack_n_per_m + drag_s_per_m * push.limit_n / push.step_s;
    let excess_n = push.excess_n();
    if yielding == 0.0 {
        let displacement_m = excess_n / (slack + push.bristle_n_per_m + damping);
        let bristle_m = push.bristle_m + displacement_m;
        return Gone {
            displacement_m,
            bristle_m,
        };
    }
    let linear = slack + push.bristle_n_per_m + damping - yielding * (push.pull_n + damping * push.bristle_m);
    let displacement_m = positive_root(yielding * slack, linear, excess_n);
    Gone {
        displacement_m,
        bristle_m: (push.bristle_m + displacement_m) / (1.0 + yielding * displacement_m),
    }
}

/// The root s of square s² + linear s = rest that is not negative.
pub fn positive_root(square: f64, linear: f64, rest: f64) -> f64 {
    let root = (linear * linear + 4.0 * square * rest).sqrt();
    // Both forms of the same root; each loses digits where the other does not.
    if linear > 0.0 {
        2.0 * rest / (linear + root)
    } else {
        (root - linear) / (2.0 * square)
    }
}
