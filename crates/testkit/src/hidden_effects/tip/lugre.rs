//! LuGre's friction: a bristle that yields from the beginning, its micro-damping, and a viscous part.
//!
//! With z the bristle's bend, v the tip's speed and g the limit: z' = v (1 − σ₀ |z| sgn(v z) / g) and
//! F = σ₀ z + σ₁ z' + σ₂ v. A tip slides at σ₀ z = g.

use super::bristle::{TipLoad, TipStep, yield_at};

/// Figures of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lugre {
    /// σ₁ over σ₀, s.
    pub damping_s: f64,
    /// σ₂ over the limit, s/m.
    pub drag_s_per_m: f64,
}

impl Lugre {
    pub fn solve(&self, load: &TipLoad) -> TipStep {
        let yielding = load.bristle_n_per_m / load.limit_n;
        yield_at(load, yielding, self.damping_s, self.drag_s_per_m)
    }
}
