//! The slope where a sensor measures the body's pitch, and what it says of the pull.
//!
//! The current alone takes slope, payload and drag for one pull. With the slope measured, the pull is the weight along the canal, give or
//! take what the sensor does not know of the slope, and what payload and drag may add: a far better prior than that of the configured slope.

/// Least part of a cycle in which the pitch must be measured.
const MEASURED_SHARE: f64 = 0.5;

/// How well a measured pitch says the slope, and the slope the pull.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PitchSensor {
    /// Standard deviation of a cycle's mean pitch about the slope, rad: offset, mounting, how the body lies in the canal.
    pub sigma_rad: f64,
    /// Standard deviation of the pull about the stated mass's weight on that slope, N: payload and drag.
    pub load_sigma_n: f64,
}

impl Default for PitchSensor {
    /// Half a degree, and what 100 g pull on 18 degrees.
    fn default() -> Self {
        Self {
            sigma_rad: 0.5f64.to_radians(),
            load_sigma_n: 0.3,
        }
    }
}

impl PitchSensor {
    /// Standard deviation of the pull on a body of some weight, N, on a slope by its sine.
    pub(super) fn pull_sigma_n(&self, weight_n: f64, sine: f64) -> f64 {
        let cosine = (1.0 - sine * sine).max(0.0).sqrt();
        (weight_n * cosine * self.sigma_rad).hypot(self.load_sigma_n)
    }
}

/// Mean over a cycle, by how far the cam turns.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct MeanPitch {
    sine_turned: f64,
    turned: f64,
}

impl MeanPitch {
    /// Adds a reading, `NaN` where there is none, and how far the cam turned up to it, cycles.
    pub(super) fn add(&mut self, pitch_rad: f64, turned: f64) {
        let sine = pitch_rad.sin();
        if sine.is_finite() {
            self.sine_turned += turned * sine;
            self.turned += turned;
        }
    }

    /// Mean of its sine; none where little of a cycle was measured.
    pub(super) fn sine(&self) -> Option<f64> {
        (self.turned > MEASURED_SHARE).then(|| self.sine_turned / self.turned)
    }

    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }
}

/// What the measured slope says of the pull in the mean over the cycles that are fitted together, of which some may have no measurement.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct MeasuredPull {
    /// Of the newest cycle, N.
    pub(super) newest_n: Option<f64>,
    sigma_n: f64,
    sum_n: f64,
    cycles: f64, // that were measured, forgotten ones counted less
}

impl MeasuredPull {
    /// Takes what a cycle says, N, with its standard deviation; older cycles count less by a factor.
    pub(super) fn take(&mut self, pull_n: Option<(f64, f64)>, forgetting: f64) {
        (self.sum_n, self.cycles) = (forgetting * self.sum_n, forgetting * self.cycles);
        self.newest_n = pull_n.map(|(pull_n, _)| pull_n);
        if let Some((pull_n, sigma_n)) = pull_n {
            (self.sum_n, self.cycles, self.sigma_n) = (self.sum_n + pull_n, self.cycles + 1.0, sigma_n);
        }
    }

    /// The cycles before do not count any more.
    pub(super) fn forget(&mut self) {
        (self.sum_n, self.cycles) = (0.0, 0.0);
    }

    /// Mean over the cycles that were measured, N.
    pub(super) fn mean_n(&self) -> Option<f64> {
        (self.cycles > 0.0).then(|| self.sum_n / self.cycles)
    }

    /// What is known of the mean pull of so many cycles, with its standard deviation, N: of those that were not measured no more than is stated.
    pub(super) fn prior_n(&self, cycles: f64, (stated_n, stated_sigma_n): (f64, f64)) -> (f64, f64) {
        let unmeasured = (1.0 - self.cycles / cycles).max(0.0);
        let pull_n = (1.0 - unmeasured) * self.mean_n().unwrap_or(stated_n) + unmeasured * stated_n;
        let sigma_n = (1.0 - unmeasured) * self.sigma_n;
        (pull_n, sigma_n.hypot(unmeasured * stated_sigma_n))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_not_measured_is_no_better_known_than_stated() {
        let stated_n = (0.5, 2.0);
        let mut pull = MeasuredPull::default();
        assert_eq!((pull.prior_n(1.0, stated_n), pull.mean_n()), (stated_n, None));
        let mut cycles = 0.0;
        let mut take = |pull: &mut MeasuredPull, measured: Option<(f64, f64)>| {
            pull.take(measured, 0.9);
            cycles = 0.9 * cycles + 1.0;
            pull.prior_n(cycles, stated_n)
        };
        for _ in 0..50 {
            take(&mut pull, Some((1.0, 0.3)));
        }
        let (pull_n, sigma_n) = take(&mut pull, Some((2.0, 0.3)));
        assert!(
            (pull_n - 1.1).abs() < 0.01 && (sigma_n - 0.3).abs() < 1e-9,
            "{pull_n} ± {sigma_n}"
        );
        assert_eq!(pull.newest_n, Some(2.0));
        // One cycle without costs a tenth, and many everything.
        let (pull_n, sigma_n) = take(&mut pull, None);
        assert!(
            (pull_n - 1.04).abs() < 0.01 && (sigma_n - 0.336).abs() < 0.01,
            "{pull_n} ± {sigma_n}"
        );
        assert_eq!(pull.newest_n, None);
        let mut last = (0.0, 0.0);
        for _ in 0..60 {
            last = take(&mut pull, None);
        }
        assert!((last.0 - 0.5).abs() < 0.01 && (last.1 - 2.0).abs() < 0.01, "{last:?}");
    }
}
