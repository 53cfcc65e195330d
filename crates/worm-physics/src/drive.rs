//! What a crawl asks of the drive, and what a motor needs to give it.
//!
//! One turn of the cam is one gait cycle. The cam carries the actuator work (13): its torque is the work per cycle of phase over 2π. A DC
//! motor gives that torque and its own friction with the current I = (torque + friction)/k, and takes R I² + k ω I from its supply. Its
//! friction is that of the bench, [`ServoLaws::friction_n_m`]: it may depend on the torque that the motor gives, so it is solved for.
//!
//! The exact motion has no clock, so one [`DriveLoad`] serves every speed: over a turn only how often which torque occurs counts.

use super::cycle::{Cycle, crawl_until_periodic};
use super::physics::Physics;
use super::servo::physics::COPPER_PER_K;
use super::servo::{Ripple, ServoLaws, ServoMotor};
use super::worm::SlidesDown;
use std::f64::consts::TAU;

/// Places in each step at which the torque is taken. The work comes from the exact motion; only the mean square and friction by the load
/// depend on them.
const PLACES_PER_STEP: usize = 16;
/// Parts of the turn, sorted by their torque, of which [`DriveLoad`] has the mean.
const PARTS: usize = PLACES_PER_STEP;
/// Most rounds of the search for a motor's friction, and when it has converged, N m.
const FRICTION_ROUNDS: u32 = 30;
const FRICTION_ERROR_N_M: f64 = 1e-10;

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
    /// Mean torque in each sixteenth of the turn, N m, sorted: what friction by the load is taken from.
    pub parts_n_m: [f64; PARTS],
}

impl DriveLoad {
    /// The same torque all the time.
    pub const fn constant(torque_n_m: f64) -> Self {
        Self {
            work_j: TAU * torque_n_m,
            mean_square_n2_m2: torque_n_m * torque_n_m,
            max_torque_n_m: torque_n_m,
            min_torque_n_m: torque_n_m,
            parts_n_m: [torque_n_m; PARTS],
        }
    }

    /// From the torques at places all over the turn, in any order, as many in each part; the work is known better.
    fn of(work_j: f64, mut torques_n_m: Vec<f64>) -> Self {
        let count = torques_n_m.len() as f64;
        torques_n_m.sort_unstable_by(f64::total_cmp);
        let mut parts_n_m = [0.0; PARTS];
        let in_part = torques_n_m.len() / PARTS;
        let off_n_m = torques_n_m.iter().sum::<f64>() / count - work_j / TAU;
        for (part_n_m, torques_n_m) in parts_n_m.iter_mut().zip(torques_n_m.chunks_exact(in_part)) {
            *part_n_m = torques_n_m.iter().sum::<f64>() / in_part as f64 - off_n_m;
        }
        Self {
            work_j,
            mean_square_n2_m2: torques_n_m
                .iter()
                .map(|torque_n_m| torque_n_m * torque_n_m)
                .sum::<f64>()
                / count,
            max_torque_n_m: torques_n_m.last().copied().unwrap_or(0.0),
            min_torque_n_m: torques_n_m.first().copied().unwrap_or(0.0),
            parts_n_m,
        }
    }
}

/// A DC motor with its gear, at the cam.
#[derive(Debug, Clone, PartialEq)]
pub struct Motor {
    /// Winding, torque constant, dry and viscous friction.
    pub servo: ServoMotor,
    /// Everything else about it. What a steady speed does not show (play, delay, dead band, the supply's resistance) is not used here.
    pub laws: ServoLaws,
}

/// What a motor needs for one gait cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorCycle {
    /// Electrical energy, J; never below 0, for the battery gets nothing back.
    pub energy_j: f64,
    /// Part of it that heats the winding, J.
    pub copper_j: f64,
    /// Part of it that friction inside takes, J.
    pub friction_j: f64,
    /// Greatest current, A. Infinite where the gears lock themselves.
    pub peak_current_a: f64,
    /// Voltage at the winding at the greatest torque, V: the bus must have more.
    pub peak_voltage_v: f64,
}

impl Motor {
    /// Friction inside against a load, at a steady velocity above 0, N m: what the motor gives beyond the load. Infinite where the gears
    /// lock themselves.
    pub fn friction_n_m(&self, load_n_m: f64, velocity_rad_per_s: f64) -> f64 {
        let viscous_n_m = self.servo.viscous_n_m_s * velocity_rad_per_s;
        let friction_under = |motor_n_m: f64| {
            viscous_n_m
                + self
                    .laws
                    .friction_n_m(self.servo.dry_n_m, motor_n_m, load_n_m, velocity_rad_per_s)
        };
        let mut friction_n_m = viscous_n_m + self.servo.dry_n_m;
        for _ in 0..FRICTION_ROUNDS {
            let first_n_m = friction_under(load_n_m + friction_n_m);
            let change_n_m = first_n_m - friction_n_m;
            if change_n_m.abs() < FRICTION_ERROR_N_M {
                return first_n_m;
            }
            let second_n_m = friction_under(load_n_m + first_n_m);
            let growth = (second_n_m - first_n_m) / change_n_m;
            if growth >= 1.0 {
                break; // each newton metre of friction brings another one
            }
            friction_n_m = first_n_m + (second_n_m - first_n_m) / (1.0 - growth);
        }
        f64::INFINITY
    }

    /// What a steady cycle of `cycle_s` needs: torque and friction at a constant speed of the cam.
    pub fn cycle(&self, load: &DriveLoad, cycle_s: f64) -> MotorCycle {
        let velocity_rad_per_s = TAU / cycle_s;
        let constant = self.servo.torque_constant;
        // Ripple returns its work but for its mean, which is one of the loads, and heats the winding.
        let Ripple {
            mean_n_m: helps_n_m,
            mean_square_n2_m2: ripple_n2_m2,
            largest_n_m: ripple_n_m,
        } = self.laws.ripple_of_a_turn();
        let work_j = load.work_j - TAU * helps_n_m;
        let mut mean_square = load.mean_square_n2_m2 - 2.0 * helps_n_m * load.work_j / TAU + ripple_n2_m2;
        let mut friction_j = 0.0;
        for torque_n_m in load.parts_n_m.iter().map(|torque_n_m| torque_n_m - helps_n_m) {
            let friction_n_m = self.friction_n_m(torque_n_m, velocity_rad_per_s);
            mean_square += friction_n_m * (2.0 * torque_n_m + friction_n_m) / PARTS as f64;
            friction_j += friction_n_m * TAU / PARTS as f64;
        }
        let cold_copper_j = self.servo.winding_ohm * mean_square / (constant * constant) * cycle_s;
        let warmer_k = self.laws.heat_k_per_j * self.laws.cooling_s * cold_copper_j / cycle_s;
        let winding_ohm = self.servo.winding_ohm * (1.0 + COPPER_PER_K * warmer_k);
        let copper_j = cold_copper_j * (winding_ohm / self.servo.winding_ohm);
        let at = |torque_n_m: f64| {
            let left_n_m = torque_n_m - helps_n_m;
            left_n_m + self.friction_n_m(left_n_m, velocity_rad_per_s)
        };
        let driving_n_m = at(load.max_torque_n_m) + ripple_n_m;
        let strongest_n_m = driving_n_m.max(ripple_n_m - at(load.min_torque_n_m));
        MotorCycle {
            energy_j: (copper_j + work_j + friction_j).max(0.0),
            copper_j,
            friction_j,
            peak_current_a: strongest_n_m / constant,
            peak_voltage_v: winding_ohm * driving_n_m / constant + constant * velocity_rad_per_s,
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
    let mut torques_n_m = Vec::with_capacity(places);
    for place in 0..places {
        // In the middle between two places: there is no doubt which cell steps.
        motion.advance_to(start + (place as f64 + 0.5) / places as f64, place_s)?;
        torques_n_m.push(motion.drive_load_j() / TAU);
    }
    let load = DriveLoad::of(cycle.energy_actuator_net_j, torques_n_m);
    Ok((cycle, load))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ActsOn, Axis, Table, Worm};
    use std::sync::Arc;

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
        let motor = plain();
        let needs = motor.cycle(&load, 2.5);
        let friction_n_m = 0.05 + 0.003 * TAU / 2.5;
        let mechanical_j = load.work_j + TAU * friction_n_m;
        assert!((needs.energy_j - needs.copper_j - mechanical_j).abs() < 1e-12);
        let mean_n_m = load.work_j / TAU;
        let torque_square = load.mean_square_n2_m2 + friction_n_m * (2.0 * mean_n_m + friction_n_m);
        assert!((needs.copper_j / (3.4 * torque_square / (0.39 * 0.39) * 2.5) - 1.0).abs() < 1e-12);
        assert!((needs.peak_current_a - (friction_n * arm_m + friction_n_m) / 0.39).abs() < 1e-9);
        let slow = motor.cycle(&load, 25.0);
        assert!(slow.copper_j > 5.0 * needs.copper_j && slow.peak_voltage_v < needs.peak_voltage_v);
    }

    fn plain() -> Motor {
        Motor {
            servo: ServoMotor {
                torque_constant: 0.39,
                winding_ohm: 3.4,
                rotor_inertia_kg_m2: 2e-4,
                dry_n_m: 0.05,
                viscous_n_m_s: 0.003,
            },
            laws: ServoLaws::default(),
        }
    }

    /// Friction by the motor's own torque is solved for: with friction f₀ + c|τ| the motor gives (load + f₀)/(1 − c).
    #[test]
    fn friction_by_the_load_feeds_on_itself() {
        let mut motor = plain();
        motor.laws.load_friction = 0.4;
        motor.laws.load_share = 1.0;
        let velocity_rad_per_s = TAU / 2.5;
        let dry_n_m = 0.05 + 0.003 * velocity_rad_per_s;
        let gives_n_m = 0.012 + motor.friction_n_m(0.012, velocity_rad_per_s);
        assert!((gives_n_m - (0.012 + dry_n_m) / 0.6).abs() < 1e-8, "{gives_n_m}");
        let needs = motor.cycle(&DriveLoad::constant(0.012), 2.5);
        assert!((needs.friction_j - TAU * (gives_n_m - 0.012)).abs() < 1e-7);
        assert!((needs.peak_current_a - gives_n_m / 0.39).abs() < 1e-7);
        motor.laws.load_friction = 1.1;
        assert!(motor.cycle(&DriveLoad::constant(0.012), 2.5).peak_current_a > 1e3);
    }

    /// A table costs what the effect costs that it is read from; and the mean of a torque over the angle, once around, helps.
    #[test]
    fn laws_at_the_points_of_a_grid_cost_what_they_say() {
        let table = |acts_on, axis, grid: Vec<f64>, value: Vec<f64>, period| {
            let table = Table::new(acts_on, &[(axis, grid)], value, period).expect("a table");
            vec![Arc::new(table)]
        };
        let load = DriveLoad::constant(0.2);
        let cycle = |change: &dyn Fn(&mut ServoLaws)| {
            let mut motor = plain();
            change(&mut motor.laws);
            motor.cycle(&load, 2.5)
        };
        let by_law = cycle(&|laws| laws.load_friction = 0.3);
        let by_table = cycle(&|laws| {
            laws.tables = table(
                ActsOn::MotorFriction,
                Axis::GearLoad,
                vec![0.0, 1.0],
                vec![0.0, 0.3],
                None,
            );
        });
        assert!(
            (by_law.energy_j / by_table.energy_j - 1.0).abs() < 1e-6,
            "{by_law:?} {by_table:?}"
        );
        let turn: Vec<f64> = (0..200).map(|at| TAU * f64::from(at) / 200.0).collect();
        let wave = |mean: f64| {
            let value = turn.iter().map(|angle| mean + 0.05 * (3.0 * angle).sin()).collect();
            table(ActsOn::MotorTorque, Axis::MotorAngle, turn.clone(), value, Some(TAU))
        };
        let by_law = cycle(&|laws| (laws.ripple_n_m, laws.ripple_waves) = (0.05, 3.0));
        let by_table = cycle(&|laws| laws.tables = wave(0.0));
        assert!(
            (by_law.energy_j / by_table.energy_j - 1.0).abs() < 1e-3,
            "{by_law:?} {by_table:?}"
        );
        assert!((by_law.peak_current_a / by_table.peak_current_a - 1.0).abs() < 1e-3);
        let helped = cycle(&|laws| laws.tables = wave(0.1));
        let lighter = plain().cycle(&DriveLoad::constant(0.1), 2.5);
        let ripple_j = 3.4 * 0.5 * 0.05 * 0.05 / (0.39 * 0.39) * 2.5;
        assert!(
            (helped.energy_j / (lighter.energy_j + ripple_j) - 1.0).abs() < 1e-3,
            "{helped:?} {lighter:?}"
        );
    }

    #[test]
    fn a_worm_that_cannot_hold_has_no_load() {
        let steep = Worm::paper().with_resisting_force_n(100.0).expect("any force is valid");
        assert!(driven_cycle(&Physics::of(steep), 2.5).is_err());
    }
}
