//! Coulomb's friction made smooth by a steep law of speed: F = g v / (|v| + v₀) + σ v, without any presliding.
//!
//! v₀ is a speed of creep, so low that a loaded tip at rest stays where it is for as long as a run lasts.

use super::bristle::{TipLoad, TipStep, positive_root};

/// Figures of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coulomb {
    /// Speed at which a tip holds half its limit, m/s.
    pub creep_m_s: f64,
    /// Viscous part over the limit, s/m.
    pub drag_s_per_m: f64,
}

impl Coulomb {
    pub fn solve(&self, load: &TipLoad) -> TipStep {
        // With s the way and ε = v₀ Δt: (pull − slack s) (s + ε) = g s.
        let creep_m = self.creep_m_s * load.step_s;
        let slack = load.slack_n_per_m + self.drag_s_per_m * load.limit_n / load.step_s;
        let linear = load.limit_n + slack * creep_m - load.pull_n;
        TipStep {
            displacement_m: positive_root(slack, linear, load.pull_n * creep_m),
            bristle_m: 0.0,
        }
    }
}
