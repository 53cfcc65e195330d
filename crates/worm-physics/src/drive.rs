//! What a crawl asks of the drive, and what a motor needs to give it.
//!
//! One turn of the cam is one gait cycle. The cam carries the actuator work (13): its torque is the work per cycle of phase over 2π. A DC
//! motor with dry and viscous friction gives it with the current I = (torque + friction)/k, and takes R I² + k ω I from its supply.
//!
//! The exact motion has no clock, so one [`DriveLoad`] serves every speed: over a turn only the mean of the torque and of its square count.

use super::cycle::{Cycle, crawl_until_periodic};
use super::physics::Physics;
use super::worm::SlidesDown;
use std::f64::consts::TAU;

/// Places in each step at which the torque is taken. The work comes from the exact motion; only the mean square depends on them.
const PLACES_PER_STEP: usize = 16;

/// Torque at the cam over one steady gait cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveLoad {
    /// Net actuator work of the cycle (13), J. Its mean torque is this over 2π.
    pub work_j: f64,
    /// Mean over the turn of the squared torque, N² m².
    pub mean_square_n2_m2: f64,
    /// Greatest torque, N m.
    pub max_torque_n_m: f64,
    /// Least torque, N m: negative where the worm turns the cam.
    pub min_torque_n_m: f64,
}

/// A DC motor with its gear, at the cam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motor {
    /// Resistance of the winding, ohm.
    pub winding_resistance_ohm: f64,
    /// Torque constant, N m/A and V s/rad.
    pub torque_constant_n_m_per_a: f64,
    /// Dry friction inside, N m.
    pub friction_n_m: f64,
    /// Friction inside that grows with speed, N m s/rad.
    pub viscous_n_m_s_per_rad: f64,
}

/// What a motor needs for one gait cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorCycle {
    /// Electrical energy, J; never below 0, for the battery gets nothing back.
    pub energy_j: f64,
    /// Part of it that heats the winding, J.
    pub copper_j: f64,
    /// Greatest current, A.
    pub peak_current_a: f64,
    /// Voltage at the winding at the greatest torque, V: the bus must have more.
    pub peak_voltage_v: f64,
}

impl Motor {
    /// What a steady cycle of `cycle_s` needs: torque and friction at a constant speed of the cam.
    pub fn cycle(&self, load: &DriveLoad, cycle_s: f64) -> MotorCycle {
        let velocity_rad_per_s = TAU / cycle_s;
        let friction_n_m = self.friction_n_m + self.viscous_n_m_s_per_rad * velocity_rad_per_s;
        let mean_n_m = load.work_j / TAU;
        let mean_square = load.mean_square_n2_m2 + friction_n_m * (2.0 * mean_n_m + friction_n_m);
        let constant = self.torque_constant_n_m_per_a;
        let copper_j = self.winding_resistance_ohm * mean_square / (constant * constant) * cycle_s;
        let strongest_n_m = (load.max_torque_n_m + friction_n_m).max(-(load.min_torque_n_m + friction_n_m));
        let driving_a = (load.max_torque_n_m + friction_n_m) / constant;
        MotorCycle {
            energy_j: (copper_j + load.work_j + friction_n_m * TAU).max(0.0),
            copper_j,
            peak_current_a: strongest_n_m / constant,
            peak_voltage_v: self.winding_resistance_ohm * driving_a + constant * velocity_rad_per_s,
        }
    }
}

/// The steady cycle as [`steady_cycle_of`](crate::steady_cycle_of) finds it, and what it asks of the drive.
///
/// # Errors
/// [`SlidesDown`] when the tips cannot hold the worm.
pub fn driven_cycle(physics: &Physics, cycle_s: f64) -> Result<(Cycle, DriveLoad), SlidesDown> {
    let (cycle, mut motion) = crawl_until_periodic(physics, cycle_s)?;
    let places = PLACES_PER_STEP * physics.worm.cells();
    let place_s = cycle_s / places as f64;
    let start = motion.phase();
    let mut load = DriveLoad {
        work_j: cycle.energy_actuator_net_j,
        mean_square_n2_m2: 0.0,
        max_torque_n_m: f64::NEG_INFINITY,
        min_torque_n_m: f64::INFINITY,
    };
    for place in 0..places {
        // In the middle between two places: there is no doubt which cell steps.
        motion.advance_to(start + (place as f64 + 0.5) / places as f64, place_s)?;
        let torque_n_m = motion.drive_load_j() / TAU;
        load.mean_square_n2_m2 += torque_n_m * torque_n_m / places as f64;
        load.max_torque_n_m = load.max_torque_n_m.max(torque_n_m);
        load.min_torque_n_m = load.min_torque_n_m.min(torque_n_m);
    }
    Ok((cycle, load))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Worm;

    /// On the level, with equal cells, the force on the stepping cell rises linearly from −F to F while it travels 2 δmax n/(n−1), and stays
    /// at F: mean and mean square are known.
    #[test]
    fn torque_on_the_level_is_as_in_closed_form() {
        let physics = Physics::of(Worm::paper());
        let (cycle, load) = driven_cycle(&physics, 2.5).expect("it holds");
        let (cells, friction_n, bound_m, stroke_m) = (4.0, 980.0 * 1.75e-3, 1.75e-3, 11.5e-3);
        let arm_m = stroke_m * cells / TAU;
        let rising = 2.0 * bound_m * cells / (cells - 1.0) / stroke_m;
        let mean_square = (friction_n * arm_m).powi(2) * (rising / 3.0 + 1.0 - rising);
        assert!((load.mean_square_n2_m2 / mean_square - 1.0).abs() < 3e-3);
        assert!((load.max_torque_n_m / (friction_n * arm_m) - 1.0).abs() < 1e-9);
        assert!((load.work_j - cycle.energy_loss_j).abs() < 1e-12);
        let motor = Motor {
            winding_resistance_ohm: 3.4,
            torque_constant_n_m_per_a: 0.39,
            friction_n_m: 0.05,
            viscous_n_m_s_per_rad: 0.003,
        };
        let needs = motor.cycle(&load, 2.5);
        let friction_n_m = 0.05 + 0.003 * TAU / 2.5;
        let mechanical_j = load.work_j + TAU * friction_n_m;
        assert!((needs.energy_j - needs.copper_j - mechanical_j).abs() < 1e-12);
        assert!((needs.peak_current_a - (friction_n * arm_m + friction_n_m) / 0.39).abs() < 1e-9);
        let slow = motor.cycle(&load, 25.0);
        assert!(slow.copper_j > 5.0 * needs.copper_j && slow.peak_voltage_v < needs.peak_voltage_v);
    }

    #[test]
    fn a_worm_that_cannot_hold_has_no_load() {
        let steep = Worm::paper().with_resisting_force_n(100.0).expect("any force is valid");
        assert!(driven_cycle(&Physics::of(steep), 2.5).is_err());
    }
}
