//! How much an effect changes of what anybody asks.

use super::normal_probability::normal_probability;

/// What an effect changes, each over its limit: above 1 it matters.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::explain) struct Impact {
    pub outcome: f64,
    pub energy: f64,
    pub position: f64,
}

impl Impact {
    /// Probability that it is beyond a limit, by the severity's change from neutral and its standard error.
    pub fn matters(&self, change: f64, sigma: f64) -> f64 {
        let largest = self.outcome.max(self.energy).max(self.position);
        if largest <= 1.0 || !sigma.is_finite() {
            return 0.0;
        }
        let limit = change.abs() / largest;
        normal_probability((change.abs() - limit) / sigma)
    }
}
