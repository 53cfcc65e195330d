//! The motor of one machine: how unevenly it turns its cam.
//!
//! What goes with the cam's angle, its load and its eccentricity, is the machine's and the same on every run; how the speed
//! wanders is not.

use super::drive::Drive;
use crate::random::log_uniform;
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;

/// What a motor has of its own.
#[derive(Debug, Clone)]
pub struct Motor {
    /// Share by which its speed swings once for each step.
    swing_per_step: f64,
    /// Share by which it swings once for each turn of the cam.
    swing_per_turn: f64,
    /// Where both swings begin, rad.
    angles_rad: [f64; 2],
    /// Share by which it wanders slowly.
    wander: f64,
    /// Time from rest to full speed, s.
    ramp_s: f64,
}

impl Motor {
    /// A motor that turns evenly.
    pub fn even() -> Self {
        let Drive { ramp_s, .. } = Drive::even(1.0);
        Self {
            swing_per_step: 0.0,
            swing_per_turn: 0.0,
            angles_rad: [0.0; 2],
            wander: 0.0,
            ramp_s,
        }
    }

    /// A motor as uneven as real ones.
    pub fn draw(rng: &mut Xoshiro256PlusPlus) -> Self {
        Self {
            swing_per_step: rng.random_range(0.0..0.15),
            swing_per_turn: rng.random_range(0.0..0.1),
            angles_rad: std::array::from_fn(|_| rng.random_range(0.0..TAU)),
            wander: log_uniform(0.003, 0.02, rng),
            ramp_s: log_uniform(0.05, 0.3, rng),
        }
    }

    /// How it drives one run.
    pub fn drive(&self, cycle_s: f64, rng: &mut Xoshiro256PlusPlus) -> Drive {
        let [by_step, by_turn] = self.angles_rad;
        let mut slow = || rng.random_range(0.0..TAU);
        Drive {
            swing_per_step: self.swing_per_step,
            swing_per_turn: self.swing_per_turn,
            wander: self.wander,
            angles_rad: [by_step, by_turn, slow(), slow(), slow()],
            ramp_s: self.ramp_s,
            ..Drive::even(cycle_s)
        }
    }
}
