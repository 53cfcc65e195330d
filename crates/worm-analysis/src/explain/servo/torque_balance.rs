//! The torques of a recorded servo, reading by reading.
//!
//! The duty follows from goal, gain and position, the motor's torque from that and from the velocity; what neither the arm's weight nor
//! the inertia takes is friction. It is seen where the arm moves; a resting arm only bounds it.

use super::recorded_servo::RecordedServo;
use worm_physics::servo::ServoPhysics;

/// Temperature of a servo that does not report it, °C.
const USUAL_C: f64 = 25.0;

/// A reading with its torques.
pub(super) struct Moment {
    /// Number of the second in its run.
    pub second: usize,
    pub velocity_rad_s: f64,
    pub angle_rad: f64,
    /// What the motor gives, and what holds the arm, N m.
    pub motor_n_m: f64,
    pub arm_n_m: f64,
    /// Friction against the motion, N m, that with the viscous part.
    pub friction_n_m: f64,
}

impl Moment {
    /// Torque on the gears, the mean of both their ends, without its sign, N m.
    pub fn on_gears_n_m(&self) -> f64 {
        0.5 * (self.motor_n_m + self.arm_n_m).abs()
    }

    /// The same friction by some physics.
    pub fn friction_of(&self, physics: &ServoPhysics) -> f64 {
        physics.friction_n_m(self.motor_n_m, self.arm_n_m, self.velocity_rad_s)
            + physics.motor.viscous_n_m_s * self.velocity_rad_s.abs()
    }

    /// Torque that holds the arm, N m: below 0 where it drives the motor.
    pub fn against_n_m(&self) -> f64 {
        self.arm_n_m * self.velocity_rad_s.signum()
    }
}

/// Every reading of a run but the first, by some physics.
pub(super) fn moments(servo: &RecordedServo<'_>, run: usize, physics: &ServoPhysics) -> impl Iterator<Item = Moment> {
    let observed = &servo.observed[run];
    let recording = observed.recording;
    let case_c = recording.temperature_c.first().copied().unwrap_or(USUAL_C);
    let inertia = physics.motor.rotor_inertia_kg_m2 + physics.pendulum.inertia_kg_m2();
    let readings = observed.bins.bins.iter().flat_map(|bin| {
        let with_one_before = bin.samples.clone().skip(usize::from(bin.samples.start == 0));
        with_one_before.map(|reading| (bin.cycle, reading))
    });
    readings.map(move |(second, reading)| {
        let velocity_rad_s = observed.velocity_rad_s[reading];
        let command = observed.command(reading - 1);
        let angle_rad = recording.position_rad[reading];
        let motor_n_m = if command.torque_enabled {
            let duty = physics.duty(command.gain, command.goal_rad, angle_rad);
            physics.motor.torque_constant * physics.current_a(duty, velocity_rad_s, case_c)
        } else {
            0.0
        };
        let arm_n_m = physics.pendulum.torque_n_m(angle_rad);
        let balance_n_m = motor_n_m - arm_n_m - inertia * observed.acceleration_rad_s2[reading];
        Moment {
            second,
            velocity_rad_s,
            angle_rad,
            motor_n_m,
            arm_n_m,
            friction_n_m: balance_n_m * velocity_rad_s.signum(),
        }
    })
}
