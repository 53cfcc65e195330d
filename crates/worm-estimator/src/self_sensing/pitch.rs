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
