//! The servo that turns the cam: what it reports while it bears the cam's torque.
//!
//! Its gears rub as those of a real XL330 do (`docs/servo-bench.md` in the repository), each machine's by a little more or less than is
//! known of the kind: dry, viscous, in proportion to the load and by its square, with a ripple that returns with the angle. Friction falls
//! while it warms up. What it reports is rounded as its registers round.

use crate::random::normal;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;
use worm_analysis::recording::Motor as Reported;

/// Torque per current, N m/A, and the inertia of the rotor at the cam, kg m².
const TORQUE_CONSTANT: f64 = 0.372;
const INERTIA_KG_M2: f64 = 1.9e-3;
const RESISTANCE_OHM: f64 = 3.32;
const SUPPLY_V: f64 = 5.0;
/// Dry and viscous friction, N m and N m s/rad; friction by the load, by how much the motor's end of the gears counts for it, and by its square, 1/(N m).
const DRY_N_M: f64 = 9.2e-3;
const VISCOUS: f64 = 6.4e-3;
const BY_LOAD: f64 = 0.316;
const MOTOR_SHARE: f64 = 0.81;
const BY_SQUARE: f64 = 0.276;
/// Counts of the registers: A, rad/s, rad.
const CURRENT_COUNT: f64 = 1e-3;
const VELOCITY_COUNT: f64 = 0.229 * TAU / 60.0;
const ANGLE_COUNT: f64 = TAU / 4096.0;
/// Time in which it warms up, s.
const WARMS_UP_S: f64 = 120.0;

/// What is true of one servo.
#[derive(Debug, Clone)]
pub struct Servo {
    constant: f64,
    friction: f64,
    by_load: f64,
    ripple_n_m: [(f64, f64, f64); 2],
    warmer_k: f64,
    friction_per_k: f64,
    noise_a: f64,
}

impl Servo {
    /// A servo of the kind.
    pub fn draw(seed: u64) -> Self {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x5e60);
        let mut about = |sigma: f64| sigma * normal(&mut rng).clamp(-2.5, 2.5);
        Self {
            constant: TORQUE_CONSTANT * (1.0 + about(0.02)),
            friction: 1.0 + about(0.15),
            by_load: BY_LOAD + about(0.02),
            ripple_n_m: [(7.0, about(3e-4), about(3e-4)), (18.0, about(3e-4), about(3e-4))],
            warmer_k: rng.random_range(3.0..15.0),
            friction_per_k: rng.random_range(0.0..0.006),
            noise_a: rng.random_range(0.5e-3..3e-3),
        }
    }

    /// What it reports at every sample of a run, of which phases, in cycles, and torques on the cam are known.
    pub fn report(&self, rate_hz: f64, phase: &[f64], cam_n_m: &[f64], seed: u64) -> Reported {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed.rotate_left(17));
        let last = phase.len() - 1;
        let velocity = |sample: usize| {
            let (before, after) = (sample.saturating_sub(1), (sample + 1).min(last));
            TAU * (phase[after] - phase[before]) * rate_hz / (after - before).max(1) as f64
        };
        let rounded = |value: f64, count: f64| (value / count).round() * count;
        let mut reported = Reported::default();
        for sample in 0..phase.len() {
            let (before, after) = (sample.saturating_sub(1), (sample + 1).min(last));
            let acceleration = (velocity(after) - velocity(before)) * rate_hz / (after - before).max(1) as f64;
            let warmer_k = self.warmer_k * (1.0 - (-(sample as f64 / rate_hz) / WARMS_UP_S).exp());
            let angle_rad = TAU * phase[sample];
            let speed = velocity(sample);
            let motor_n_m = self.motor_n_m(
                cam_n_m[sample] + INERTIA_KG_M2 * acceleration + self.ripple_n_m(angle_rad),
                speed,
                1.0 - self.friction_per_k * warmer_k,
            );
            let current_a = motor_n_m / (self.constant * (1.0 - 1e-3 * warmer_k));
            reported.angle_rad.push((angle_rad / ANGLE_COUNT).floor() * ANGLE_COUNT);
            reported
                .velocity_rad_s
                .push(rounded(speed + 0.3 * VELOCITY_COUNT * normal(&mut rng), VELOCITY_COUNT));
            reported
                .current_a
                .push(rounded(current_a + self.noise_a * normal(&mut rng), CURRENT_COUNT));
            reported.voltage_v.push(SUPPLY_V);
            let winding_v = RESISTANCE_OHM * current_a + self.constant * speed;
            reported.duty.push(winding_v / SUPPLY_V);
            reported.temperature_c.push((25.0 + warmer_k).floor());
        }
        reported
    }

    /// Torque of the motor for one on the gears' output; a motor at rest holds it.
    fn motor_n_m(&self, out_n_m: f64, speed: f64, warm: f64) -> f64 {
        let turning = if speed == 0.0 { 0.0 } else { speed.signum() };
        let mut motor_n_m = out_n_m;
        for _ in 0..40 {
            let on_gears = MOTOR_SHARE * motor_n_m + (1.0 - MOTOR_SHARE) * out_n_m;
            let against =
                warm * self.friction * DRY_N_M + self.by_load * on_gears.abs() + BY_SQUARE * motor_n_m * motor_n_m;
            motor_n_m = out_n_m + turning * against + warm * self.friction * VISCOUS * speed;
        }
        motor_n_m
    }

    fn ripple_n_m(&self, angle_rad: f64) -> f64 {
        let waves = self.ripple_n_m.iter();
        waves
            .map(|(waves, sine, cosine)| sine * (waves * angle_rad).sin() + cosine * (waves * angle_rad).cos())
            .sum()
    }
}
