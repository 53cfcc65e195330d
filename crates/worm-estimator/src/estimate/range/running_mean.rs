//! A mean that begins with a prediction, follows slow changes, and knows its standard error.
//!
//! A Kalman filter of one state: the mean wanders a little from cycle to cycle, a value scatters about it. The scatter is learned from the
//! innovations, beginning with a guess that counts as some values.

/// How much the mean wanders in one cycle, as a fraction of it.
const WANDER: f64 = 0.002;
/// The guess of the scatter, as a fraction of the mean …
const SCATTER: f64 = 0.03;
/// … counts as so many values.
const SCATTER_VALUES: f64 = 4.0;
/// The scatter is a mean over at most so many values.
const SCATTER_MEMORY: f64 = 50.0;
/// Standard deviation of a mean that nobody predicted, as a fraction of the first value.
const UNKNOWN_SIGMA: f64 = 1.0;

/// The mean of a quantity over gait cycles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RunningMean {
    mean: f64,
    variance: f64,
    scatter_variance: f64,
    scatter_values: f64,
    seen: u32,
}

impl RunningMean {
    /// A mean that is predicted with a standard deviation, as a fraction. A prediction that is no positive number is replaced by the
    /// first value, with one that says nothing.
    pub(super) fn predicted(mean: f64, sigma_fraction: f64, first: f64) -> Self {
        let (mean, sigma_fraction) = if mean > 0.0 && mean.is_finite() {
            (mean, sigma_fraction)
        } else {
            (first, UNKNOWN_SIGMA)
        };
        Self {
            mean,
            variance: (sigma_fraction * mean).powi(2),
            scatter_variance: (SCATTER * mean).powi(2),
            scatter_values: SCATTER_VALUES,
            seen: 0,
        }
    }

    /// Takes a value with its standard error.
    pub(super) fn add(&mut self, value: f64, sigma: f64) {
        self.variance += (WANDER * self.mean).powi(2);
        let noise = self.scatter_variance + sigma * sigma;
        let innovation = value - self.mean;
        let expected = self.variance + noise;
        if expected <= 0.0 {
            return; // Mean and value are 0.
        }
        let gain = self.variance / expected;
        // What of the innovation is scatter, by the variances that were expected.
        let scatter = innovation * innovation * self.scatter_variance / expected;
        self.scatter_values = (self.scatter_values + 1.0).min(SCATTER_MEMORY);
        self.scatter_variance += (scatter - self.scatter_variance) / self.scatter_values;
        self.mean += gain * innovation;
        self.variance *= 1.0 - gain;
        self.seen += 1;
    }

    pub(super) fn mean(&self) -> f64 {
        self.mean
    }

    /// Standard error of the mean.
    pub(super) fn sigma(&self) -> f64 {
        self.variance.sqrt()
    }

    /// Values taken.
    pub(super) fn seen(&self) -> u32 {
        self.seen
    }
}
