//! A mean that forgets, and how well it is known.

/// What is kept of the weight of the past with each new value: a memory of eight cycles.
const KEPT: f64 = 7.0 / 8.0;
/// Values before which nothing is said.
pub(super) const MIN_VALUES: u32 = 4;
/// How many values the scatter of the whole map counts for in the scatter of one entry.
const POOLED: f64 = 8.0;

/// Weighted sums over the values of one entry.
///
/// The scatter is taken from the differences of successive values, so a step from one level to another, which is what a fault is,
/// hardly widens it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct WeightedMean {
    count: u32,
    weight: f64,
    squared_weight: f64,
    mean: f64,
    last: f64,
    scatter: f64, // weighted sum of half the squared differences
    scatter_weight: f64,
}

/// A mean and its standard error, with the degrees of freedom of that.
#[derive(Debug, Clone, Copy)]
pub(super) struct MeanEstimate {
    pub(super) mean: f64,
    pub(super) sigma: f64,
    degrees: f64,
}

impl WeightedMean {
    pub(super) fn add(&mut self, value: f64) {
        if !value.is_finite() {
            return;
        }
        if self.count > 0 {
            let difference = value - self.last;
            self.scatter = KEPT * self.scatter + 0.5 * difference * difference;
            self.scatter_weight = KEPT * self.scatter_weight + 1.0;
        }
        self.last = value;
        self.count = self.count.saturating_add(1);
        self.weight = KEPT * self.weight + 1.0;
        self.squared_weight = KEPT * KEPT * self.squared_weight + 1.0;
        self.mean += (value - self.mean) / self.weight;
    }

    /// Variance of one value, once there are two.
    pub(super) fn variance(&self) -> Option<f64> {
        (self.count > 1).then(|| self.scatter / self.scatter_weight)
    }

    /// The mean, once there are [`MIN_VALUES`] values; `pooled` is the variance of one value over the whole map.
    pub(super) fn known(&self, pooled: f64) -> Option<MeanEstimate> {
        let variance = self.variance().filter(|_| self.count >= MIN_VALUES)?;
        let values = self.weight * self.weight / self.squared_weight;
        // Differences of successive values are worth two thirds of deviations from a mean.
        let degrees = 2.0 / 3.0 * (values - 1.0);
        let moderated = (POOLED * pooled + degrees * variance) / (POOLED + degrees);
        Some(MeanEstimate {
            mean: self.mean,
            sigma: (moderated / values).sqrt(),
            degrees: POOLED + degrees,
        })
    }
}

impl MeanEstimate {
    /// How far a mean is beyond a bound, in standard deviations of a normal distribution with the same tail as Student's:
    /// Wallace, Annals of Mathematical Statistics 30 (1959) 1124. 0 within the bound.
    pub(super) fn beyond(&self, mean: f64, bound: f64) -> f64 {
        let t = (mean.abs() - bound).max(0.0) / self.sigma;
        let n = self.degrees;
        (8.0 * n + 1.0) / (8.0 * n + 3.0) * (n * (t * t / n).ln_1p()).sqrt()
    }
}
