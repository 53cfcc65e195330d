//! A worm and its runs before anything is hidden in it.

use super::artefact::Artefact;
use super::body::Placement;
use super::parameters::WormParameters;
use super::scene::{MotionCapture, STEP_S, Scene};
use super::tip::laws::Laws;
use crate::random::truncated_normal;
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use worm_estimator::config::Config;

/// Standard deviation of a slope about what is stated, degrees.
pub const SLOPE_SIGMA_DEG: f64 = 0.1;

/// How much is recorded of a worm: the time of a search is proportional to the number of samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CampaignSize {
    /// Runs, each on a steeper slope than the one before, the first on the level.
    pub runs: usize,
    /// Gait cycles in each run.
    pub cycles: f64,
    /// Samples of the camera per second.
    pub rate_hz: f64,
}

impl CampaignSize {
    /// The size that is scored.
    pub const FULL: Self = Self {
        runs: 3,
        cycles: 12.0,
        rate_hz: 120.0,
    };
    /// The smallest size that the search can use: several slopes, and enough cycles to separate scatter from cause.
    pub const SMALL: Self = Self {
        runs: 2,
        cycles: 6.0,
        rate_hz: 60.0,
    };
}

/// A worm and its runs before anything is hidden in it.
pub struct Setting {
    pub parameters: WormParameters,
    pub scenes: Vec<Scene>,
    /// For each run its slope, degrees, the best first: the first on which the worm crawls is taken.
    pub slopes_deg: Vec<Vec<f64>>,
    pub cycle_s: f64,
    pub laws: Laws,
    pub artefact: Option<Artefact>,
    /// Size of a discrepancy put into all pads, m: about the root mean square that recalibration leaves of it.
    pub discrepancy_m: f64,
}

/// Three runs of four cells at the gait's usual speed.
pub fn usual_setting(size: CampaignSize, rng: &mut Xoshiro256PlusPlus) -> Setting {
    let cycle_s = Config::default().gait.cycle_s;
    let parameters = WormParameters::draw(rng);
    let mut capture = MotionCapture::draw(rng);
    capture.camera.rate_hz = size.rate_hz;
    let under_way = rng.random_range(0..3) == 0;
    let phase_is_recorded = rng.random::<bool>();
    let steepest_deg = if rng.random::<bool>() { 45.0 } else { 40.0 };
    let warm_up_cycles = if under_way { rng.random_range(1.2..2.2) } else { 0.0 };
    let mut scenes: Vec<Scene> = (0..3)
        .map(|run| Scene {
            placement: Placement {
                slope_deg: SLOPE_SIGMA_DEG * truncated_normal(rng),
                payload_kg: 0.0,
                start_m: 0.0,
            },
            drive: parameters.motor.drive(cycle_s, rng),
            capture: capture.clone(),
            warm_up_cycles,
            cycles: size.cycles,
            dwell_s: 0.0,
            jump_at_cycle: [f64::INFINITY, 0.5 * size.cycles, f64::NEG_INFINITY][run],
            begins_at_cycle: f64::NEG_INFINITY,
            ends_at_cycle: f64::INFINITY,
            with_phase: phase_is_recorded,
            servo: 1,
            seed: rng.random(),
            step_s: STEP_S,
        })
        .collect();
    // All three are drawn at any size, so that the hidden effect comes from the same random numbers.
    scenes.truncate(size.runs);
    let steep = [45.0, 40.0, 35.0, 25.0, 18.0];
    let gentle_enough = |deg: &f64| *deg <= steepest_deg;
    Setting {
        parameters,
        scenes,
        slopes_deg: vec![
            vec![0.0],
            vec![30.0, 20.0, 12.0],
            steep.into_iter().filter(gentle_enough).collect(),
        ],
        cycle_s,
        laws: Laws::default(),
        artefact: None,
        discrepancy_m: 0.0,
    }
}
