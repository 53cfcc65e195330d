//! The camera that watches the worm, and how poorly it sees.

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// How the worm is watched.
#[derive(Debug, Clone)]
pub struct Camera {
    pub rate_hz: f64,
    /// Share of the sample time by which each sample comes early or late; its time is told truly. Below 0.5.
    pub jitter: f64,
    /// Standard deviation of a position, m.
    pub noise_m: f64,
    /// Share of single positions not seen.
    pub dropout_share: f64,
    /// Share of the time in which a cell is hidden for a while.
    pub hidden_fraction: f64,
    /// For how long, s.
    pub hidden_s: f64,
    /// Share of positions that are far off.
    pub outlier_fraction: f64,
    /// How far, m, either way.
    pub outlier_m: f64,
}

impl Default for Camera {
    /// The camera that the accuracy is promised for.
    fn default() -> Self {
        Self {
            rate_hz: 120.0,
            jitter: 0.0,
            noise_m: 1e-4,
            dropout_share: 0.01,
            hidden_fraction: 0.0,
            hidden_s: 0.15,
            outlier_fraction: 0.0,
            outlier_m: 5e-3,
        }
    }
}

impl Camera {
    /// A camera that sees everything as it is.
    pub fn perfect() -> Self {
        Self {
            noise_m: 0.0,
            dropout_share: 0.0,
            ..Self::default()
        }
    }
}

/// The camera at work.
pub struct CameraSampler {
    camera: Camera,
    rng: Xoshiro256PlusPlus,
    samples: u64,
    hidden_until_s: Vec<f64>,
}

impl CameraSampler {
    pub fn new(camera: Camera, cells: usize, seed: u64) -> Self {
        Self {
            camera,
            rng: Xoshiro256PlusPlus::seed_from_u64(seed),
            samples: 0,
            hidden_until_s: vec![f64::NEG_INFINITY; cells],
        }
    }

    /// Time of the next sample since the first, s.
    pub fn next_s(&mut self) -> f64 {
        let early = if self.samples == 0 || self.camera.jitter == 0.0 {
            0.0
        } else {
            self.rng.random_range(-self.camera.jitter..self.camera.jitter)
        };
        let time_s = (self.samples as f64 + early) / self.camera.rate_hz;
        self.samples += 1;
        time_s
    }

    /// What the camera says of a cell that stands at `position_m`; `NaN` where it does not see it.
    pub fn see(&mut self, cell: usize, time_s: f64, position_m: f64) -> f64 {
        let Camera {
            rate_hz,
            hidden_fraction,
            hidden_s,
            ..
        } = self.camera;
        if hidden_fraction > 0.0 && self.rng.random::<f64>() < hidden_fraction / (hidden_s * rate_hz) {
            self.hidden_until_s[cell] = time_s + hidden_s;
        }
        let normal: f64 = StandardNormal.sample(&mut self.rng);
        let lost = self.rng.random::<f64>() < self.camera.dropout_share;
        if lost || time_s < self.hidden_until_s[cell] {
            return f64::NAN;
        }
        let far_m = if self.rng.random::<f64>() < self.camera.outlier_fraction {
            self.camera.outlier_m * if self.rng.random::<bool>() { 1.0 } else { -1.0 }
        } else {
            0.0
        };
        position_m + self.camera.noise_m * normal + far_m
    }
}
