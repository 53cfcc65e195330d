//! The worm before it changed, set aside until cycles are like it again.
//!
//! A fit that begins anew from the first cycle of a worm that is as before may end at another answer than the fit then. Profiles have no such
//! doubt: a cycle that is much nearer to the mean of before than the changed one was belongs to the worm of before, and its fit goes on.

use super::{COMMON_FRICTION_SIGMAS, Fit};
use crate::self_sensing::parameters::Parameters;
use crate::self_sensing::pitch::MeasuredPull;
use crate::self_sensing::profile::MAX_BINS;

/// Distance from the mean profile of before, as a share of the changed worm's, below which a cycle is one of before.
const NEAR: f64 = 0.5;

#[derive(Debug, Clone)]
pub(super) struct Before {
    at: Parameters,
    other: Option<Parameters>,
    mean_n_m: Box<[f64; MAX_BINS]>,
    cycles: f64,
    squared_cycles: f64,
    velocity_rad_per_s: f64,
    measured: MeasuredPull,
    squared_distance: f64, // of the cycle that showed the change, weighted, N² m²
}

impl Before {
    pub(super) fn new(at: Parameters) -> Self {
        Self {
            at,
            other: None,
            mean_n_m: Box::new([0.0; MAX_BINS]),
            cycles: 0.0,
            squared_cycles: 0.0,
            velocity_rad_per_s: 0.0,
            measured: MeasuredPull::default(),
            squared_distance: 0.0,
        }
    }
}

impl Fit {
    /// Sets aside what is known, because the worm has become another, as a cycle's profile shows.
    pub(in super::super) fn set_aside(&mut self, torque_n_m: &[f64]) {
        let before = &mut self.before;
        (before.at, before.other, before.measured) = (self.at, self.other, self.measured);
        (before.cycles, before.squared_cycles) = (self.cycles, self.squared_cycles);
        before.velocity_rad_per_s = self.velocity_rad_per_s;
        *before.mean_n_m = *self.mean_n_m;
        self.before.squared_distance = self.squared_distance(torque_n_m);
        self.free_common_friction(COMMON_FRICTION_SIGMAS[1]);
    }

    /// Mean profile of the worm that was set aside, N m at the cam.
    pub(in super::super) fn before_n_m(&self) -> &[f64] {
        &self.before.mean_n_m[..self.bins]
    }

    /// Whether a cycle is one of the worm that was set aside.
    pub(in super::super) fn is_as_before(&self, torque_n_m: &[f64]) -> bool {
        self.squared_distance(torque_n_m) < NEAR * NEAR * self.before.squared_distance
    }

    /// Goes on with the worm that was set aside.
    pub(in super::super) fn go_on_as_before(&mut self) {
        let before = &self.before;
        (self.at, self.other, self.measured) = (before.at, before.other, before.measured);
        (self.cycles, self.squared_cycles) = (before.cycles, before.squared_cycles);
        self.velocity_rad_per_s = before.velocity_rad_per_s;
        *self.mean_n_m = *before.mean_n_m;
        self.first_answer = None;
        self.free_common_friction(COMMON_FRICTION_SIGMAS[0]);
    }

    /// Weighted distance of a profile from the mean of the worm that was set aside, squared, N² m².
    fn squared_distance(&self, torque_n_m: &[f64]) -> f64 {
        let bins = torque_n_m.iter().zip(&*self.before.mean_n_m).enumerate();
        bins.map(|(bin, (torque, mean))| Self::bin_weight(bin) * (torque - mean).powi(2))
            .sum()
    }
}
