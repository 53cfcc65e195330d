//! The elasto-plastic friction of Dupont et al. (2002): a bristle that springs back wholly until it breaks away.
//!
//! It is LuGre's law with its yielding times α: 0 up to the breakaway displacement and whenever the bristle unbends, from
//! there rising along a sine, and 1 at the bend at which the tip slides. A tip below breakaway does not drift.

use super::bristle::{TipLoad, TipStep, yield_at};
use std::f64::consts::PI;

/// Figures of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElastoPlastic {
    /// Breakaway displacement over the bend at which the tip slides.
    pub breakaway_fraction: f64,
    /// Micro-damping over stiffness, s.
    pub damping_s: f64,
    /// Viscous part over the limit, s/m.
    pub drag_s_per_m: f64,
}

impl ElastoPlastic {
    pub fn solve(&self, load: &TipLoad) -> TipStep {
        let yielding = load.bristle_n_per_m / load.limit_n;
        let elastic = yield_at(load, 0.0, self.damping_s, self.drag_s_per_m);
        let bent = yielding * elastic.bristle_m;
        if bent <= self.breakaway_fraction {
            return elastic;
        }
        // α is taken where an elastic bristle would stand amid that part of the step that is plastic.
        let amid = 0.5 * (bent + self.breakaway_fraction.max(yielding * load.bristle_m));
        yield_at(load, self.plastic(amid) * yielding, self.damping_s, self.drag_s_per_m)
    }

    /// α at a bend over the one at which the tip slides.
    fn plastic(&self, bent: f64) -> f64 {
        let fraction = (bent - self.breakaway_fraction) / (1.0 - self.breakaway_fraction);
        if fraction < 1.0 {
            0.5 - 0.5 * (PI * fraction).cos()
        } else {
            1.0
        }
    }
}
