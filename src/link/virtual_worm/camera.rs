//! What the tracker captures: positions with noise, now and then a cell unseen or older than its time stamp, on a clock of its own.

use super::conditions::CameraConditions;
use crate::link::TrackerReading;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::Rng;
use std::collections::VecDeque;
use worm_estimator::config::Config;
use worm_physics::MAX_CELLS;

/// The tracker's clock runs fast by this share: an ordinary crystal.
pub(super) const CLOCK_DRIFT: f64 = 30e-6;

/// A camera that takes a capture at fixed intervals of its clock.
#[derive(Debug, Clone)]
pub struct Camera {
    interval_s: f64, // of the plant's time
    noise_m: f64,
    dropout_share: f64,
    clock_offset_us: u32,
    taken: u64,
    /// What was there at the last captures, oldest first, as far back as one may have to be: when, s of the plant's time, and
    /// where the cells were, m.
    past: VecDeque<(f64, Vec<f64>)>,
    conditions: CameraConditions,
    reading: TrackerReading,
}

impl Camera {
    /// With the configured rate and noise; its clock starts anywhere.
    pub fn new(config: &Config, rng: &mut Xoshiro256PlusPlus) -> Self {
        Self {
            interval_s: 1.0 / (config.tracker.rate_hz * (1.0 + CLOCK_DRIFT)),
            noise_m: config.virtual_worm.noise_m,
            dropout_share: config.virtual_worm.dropout_share,
            clock_offset_us: rng.next_u32(),
            taken: 0,
            past: VecDeque::new(),
            conditions: CameraConditions::default(),
            reading: TrackerReading {
                sample: 0,
                capture_time_us: 0,
                // At most MAX_CELLS; a device without a camera tracks none.
                cell_count: if config.tracker.present {
                    config.worm.cells as u8
                } else {
                    0
                },
                valid: 0,
                positions_m: [0.0; MAX_CELLS],
                pitch_rad: None,
            },
        }
    }

    /// Changes what it sees.
    pub fn set_conditions(&mut self, conditions: CameraConditions) {
        self.conditions = conditions;
    }

    /// When the next capture is due, s of the plant's time.
    pub fn due_s(&self) -> f64 {
        self.taken as f64 * self.interval_s
    }

    /// Takes the capture that is due, which shows what was there `latency_s` ago. No camera sees what is still to come: a negative
    /// latency counts as none.
    pub fn capture(&mut self, positions_m: &[f64], latency_s: f64, rng: &mut Xoshiro256PlusPlus) {
        let positions_m = self.as_of_ago(positions_m, latency_s);
        let noise_m = self.conditions.noise_m.unwrap_or(self.noise_m);
        let dropout_share = self.conditions.dropout_share.unwrap_or(self.dropout_share);
        let clock_us = self.due_s() * (1.0 + CLOCK_DRIFT) * 1e6;
        self.reading.capture_time_us = self.clock_offset_us.wrapping_add(clock_us.round() as u64 as u32);
        self.reading.valid = 0;
        for (cell, position_m) in positions_m.into_iter().enumerate() {
            let seen =
                self.conditions.hidden & (1 << cell) == 0 && (dropout_share == 0.0 || draw(rng) >= dropout_share);
            let error: f64 = StandardNormal.sample(rng);
            if seen {
                self.reading.valid |= 1 << cell;
                self.reading.positions_m[cell] = position_m + noise_m * error;
            }
        }
        self.taken += 1;
        self.reading.sample = self.taken as u32; // wraps, as the register does
    }

    /// Where the cells were a while before the capture that is due, at which they are at `now_m`; at the first capture before that.
    fn as_of_ago(&mut self, now_m: &[f64], latency_s: f64) -> Vec<f64> {
        let then_s = self.due_s() - latency_s;
        self.past.push_back((self.due_s(), now_m.to_vec()));
        while self.past.get(1).is_some_and(|(after_s, _)| *after_s <= then_s) {
            self.past.pop_front();
        }
        match (&self.past[0], self.past.get(1)) {
            ((before_s, before_m), Some((after_s, after_m))) if then_s > *before_s => {
                let fraction = (then_s - before_s) / (after_s - before_s);
                let both = before_m.iter().zip(after_m);
                both.map(|(before, after)| before + fraction * (after - before))
                    .collect()
            }
            ((_, before_m), _) => before_m.clone(),
        }
    }

    /// The last capture.
    pub fn reading(&self) -> &TrackerReading {
        &self.reading
    }
}

/// A number in [0, 1).
pub(super) fn draw(rng: &mut Xoshiro256PlusPlus) -> f64 {
    // 53 bits are what a float in [0, 1) can hold.
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}
