//! The motor of one machine: how unevenly it turns its cam.
//!
//! Variations with the cam's angle, from load and eccentricity, belong to the machine and are the same on every run; slow
//! variations of the speed are not.

use super::drive::Drive;
use crate::random::log_uniform;
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;

/// The unevenness of one motor.
#[derive(Debug, Clone)]
pub struct Motor {
    /// Fraction by which its speed varies once for each step.
    swing_per_step: f64,
    /// Fraction by which it varies once for each turn of the cam.
    swing_per_turn: f64,
    /// Phase angles of both variations, rad.
    angles_rad: [f64; 2],
    /// Fraction by which it varies slowly.
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
