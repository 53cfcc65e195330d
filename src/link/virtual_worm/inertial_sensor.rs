//! The inertial sensor in the tracker's device: the canal's slope, with an error of its own, and the rocking of a body whose cells step.

use super::body::Body;
use super::line::derived_seed;
use crate::link::tracker::pitch_counts;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use std::f64::consts::TAU;
use worm_estimator::config::Config;

/// How far the body rocks in a cycle, degrees: a guess.
const ROCKING_DEG: f64 = 0.5;

/// A sensor that is mounted a little askew.
#[derive(Debug, Clone)]
pub(super) struct InertialSensor {
    offset_rad: f64,
}

impl InertialSensor {
    /// The configured one, if there is one. Its error comes from the seed, and is that of all its time.
    pub(super) fn new(config: &Config, seed: u64) -> Option<Self> {
        let sensor = config.inertial_sensor.as_ref()?;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(derived_seed(seed ^ 0x1e47));
        let error: f64 = StandardNormal.sample(&mut rng);
        Some(Self {
            offset_rad: sensor.sigma_deg.to_radians() * error.clamp(-2.5, 2.5),
        })
    }

    /// What its register says.
    pub(super) fn counts(&self, body: &Body) -> i16 {
        let rocking_rad = ROCKING_DEG.to_radians() * (TAU * body.phase()).sin();
        pitch_counts(body.slope_rad() + self.offset_rad + rocking_rad)
    }
}
