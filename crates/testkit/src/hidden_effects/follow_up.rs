//! A follow-up run of the same worm under another condition: the experiment that an answer proposes.

use super::body::Placement;
use super::campaign::HiddenCampaign;
use super::crawling::crawl;
use super::scene::{CrawlFailed, Scene};
use super::setting::SLOPE_SIGMA_DEG;
use crate::random::truncated_normal;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use worm_analysis::recording::Recording;

/// What is different on the run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Condition {
    /// Slope as stated, degrees.
    pub slope_deg: f64,
    /// Time of a gait cycle, s.
    pub cycle_s: f64,
    /// Extra mass, weighed, kg.
    pub payload_kg: f64,
    /// How much further up the canal the worm starts, m.
    pub start_shift_m: f64,
    /// Gait cycles.
    pub cycles: f64,
    /// Rest after each cycle, s.
    pub dwell_s: f64,
}

/// A run under a condition.
#[derive(Debug, Clone)]
pub struct ExtraRun {
    pub recording: Recording,
    pub condition: Condition,
}

impl HiddenCampaign {
    /// The condition of the campaign's own runs, on a slope.
    pub fn usual(&self, slope_deg: f64) -> Condition {
        Condition {
            slope_deg,
            cycle_s: self.cycle_s,
            payload_kg: 0.0,
            start_shift_m: 0.0,
            cycles: self.scenes[0].cycles,
            dwell_s: 0.0,
        }
    }

    /// One more run of the same worm, what is hidden in it included, from rest, with random draws of its own.
    ///
    /// # Errors
    /// [`CrawlFailed`] when the worm does not crawl under the condition.
    pub fn follow_up(&self, condition: Condition, seed: u64) -> Result<ExtraRun, CrawlFailed> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(self.truth.seed ^ seed.rotate_left(24));
        let model = &self.scenes[self.scenes.len() - 1];
        let scene = Scene {
            placement: Placement {
                slope_deg: condition.slope_deg + SLOPE_SIGMA_DEG * truncated_normal(&mut rng),
                payload_kg: condition.payload_kg,
                start_m: condition.start_shift_m,
            },
            drive: self.worm.parameters.motor.drive(condition.cycle_s, &mut rng),
            warm_up_cycles: 0.0,
            cycles: condition.cycles,
            dwell_s: condition.dwell_s,
            seed: rng.random(),
            ..model.clone()
        };
        Ok(ExtraRun {
            recording: crawl(&self.worm, &scene)?.recording,
            condition,
        })
    }
}
