//! The residual between theory and a worm: noise, and a slow drift that theory does not explain.
//!
//! No worm repeats its cycles exactly, so the predicted displacement of the body is off by a little after every step, and stays off. The
//! drift is a random walk in the gait phase. It makes the measured displacements far from independent; a scalar Kalman filter turns
//! them into innovations that are, so that least squares on the innovations weights every sample correctly. Run backward as well
//! (Rauch, Tung, Striebel) it gives the drift itself.

/// A random walk under noise, for given samples.
#[derive(Debug, Clone)]
pub(crate) struct Drift {
    per_cycle_m2: f64,
    step_m2: Vec<f64>, // variance that the walk gathers before each sample
    gain: Vec<f64>,    // 0 where nothing was seen
    scale: Vec<f64>,   // one over the standard deviation of each innovation, 0 where there is none
    left_m2: Vec<f64>, // variance of the drift after each sample
}

impl Drift {
    /// A drift whose variance grows by `per_cycle_m2` in each gait cycle, seen at the given phases with noise of the given
    /// variances, `INFINITY` where nothing was seen.
    pub fn new(phase: &[f64], variance_m2: &[f64], per_cycle_m2: f64) -> Self {
        let samples = phase.len();
        let mut drift = Self {
            per_cycle_m2,
            step_m2: vec![0.0; samples],
            gain: vec![0.0; samples],
            scale: vec![0.0; samples],
            left_m2: vec![f64::INFINITY; samples],
        };
        let mut left_m2 = f64::INFINITY;
        for at in 0..samples {
            drift.step_m2[at] = if at == 0 {
                0.0
            } else {
                per_cycle_m2 * (phase[at] - phase[at - 1]).max(0.0)
            };
            left_m2 += drift.step_m2[at];
            if variance_m2[at].is_finite() {
                if left_m2.is_finite() {
                    let spread_m2 = left_m2 + variance_m2[at];
                    drift.gain[at] = left_m2 / spread_m2;
                    drift.scale[at] = 1.0 / spread_m2.sqrt();
                    left_m2 *= 1.0 - drift.gain[at];
                } else {
                    // The start of the walk is unknown: the first sample determines it, and nothing else.
                    (drift.gain[at], left_m2) = (1.0, variance_m2[at]);
                }
            }
            drift.left_m2[at] = left_m2;
        }
        drift
    }

    /// Variance that it gathers in a cycle, m².
    pub fn per_cycle_m2(&self) -> f64 {
        self.per_cycle_m2
    }

    /// The innovations of a series, each with variance 1 if the series is drift and noise; 0 where there is none. Linear.
    pub fn whiten(&self, series: impl IntoIterator<Item = f64>, mut put: impl FnMut(f64)) {
        let mut expected = 0.0;
        for (at, value) in series.into_iter().enumerate() {
            if self.gain[at] == 0.0 {
                put(0.0);
                continue;
            }
            let whitened = value - expected;
            put(whitened * self.scale[at]);
            expected += self.gain[at] * whitened;
        }
    }

    /// Twice the negative logarithm of the likelihood of a series, up to a constant.
    pub fn chi_squared(&self, series: impl IntoIterator<Item = f64>) -> f64 {
        let mut chi_squared = 0.0;
        self.whiten(series, |whitened| chi_squared += whitened * whitened);
        let spreads = self.scale.iter().filter(|&&scale| scale > 0.0);
        chi_squared - 2.0 * spreads.map(|scale| scale.ln()).sum::<f64>()
    }

    /// The drift in a series, without noise, at every sample.
    pub fn smooth(&self, series: &[f64]) -> Vec<f64> {
        let mut drift_m = Vec::with_capacity(series.len());
        let mut expected = 0.0;
        for (at, &value) in series.iter().enumerate() {
            if self.gain[at] > 0.0 {
                expected += self.gain[at] * (value - expected);
            }
            drift_m.push(expected);
        }
        for at in (0..series.len().saturating_sub(1)).rev() {
            let before_m2 = self.left_m2[at];
            let fraction = if before_m2.is_finite() {
                before_m2 / (before_m2 + self.step_m2[at + 1])
            } else {
                1.0
            };
            if fraction.is_finite() {
                drift_m[at] += fraction * (drift_m[at + 1] - drift_m[at]);
            }
        }
        drift_m
    }
}

#[cfg(test)]
mod tests;
