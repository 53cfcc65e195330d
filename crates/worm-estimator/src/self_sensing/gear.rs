//! From the motor's current to the torque that the cam takes.
//!
//! τ = k I − ripple(θ) − J dω/dt − friction(ω, load), forward positive. The friction of the gears is dry, viscous, and grows with the
//! torque that presses their teeth together, in proportion and with its square, as the recordings of a real XL330 say (`docs/servo-bench.md`
//! in the repository). That torque lies between the motor's and the cam's, so the balance is implicit in τ; a few fixed-point iterations
//! solve it, because friction grows by less than the load.
//!
//! The inertia's part is left to `profile`: averaged over a bin it is a difference of two velocities.

pub use crate::winding::CurrentSource;
use crate::winding::{Reported, Winding};
use std::f64::consts::TAU;

/// Most harmonics of the torque ripple.
pub const MAX_RIPPLES: usize = 4;
/// Iterations of the implicit balance: each leaves at most a fifth of the error, so the last is below a thousandth of the friction by
/// load.
const ITERATIONS: usize = 5;
/// Newton's steps for its inverse: the law is nearly linear, so the third leaves only rounding.
const NEWTON_STEPS: usize = 3;

/// A torque that returns with the angle of the servo.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Ripple {
    /// How often in a turn; a whole number. 0: not in use.
    pub waves: f64,
    /// Amplitude of its sine, N m.
    pub sine_n_m: f64,
    /// Amplitude of its cosine, N m.
    pub cosine_n_m: f64,
}

/// A motor with its gears, at the output shaft, and how well each value is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GearModel {
    /// What the reported current is.
    pub source: CurrentSource,
    /// Torque per current, N m/A, and back EMF per velocity, V s/rad.
    pub torque_constant_n_m_per_a: f64,
    /// Standard deviation of what is known of it, as a share; for [`CurrentSource::Duty`] that of the resistance, too.
    pub torque_constant_sigma: f64,
    /// Resistance of winding and bridge at 25 °C, Ω; used for [`CurrentSource::Duty`] alone.
    pub winding_resistance_ohm: f64,
    /// Inertia of the rotor behind the gears, and of the cam, kg m².
    pub inertia_kg_m2: f64,
    /// Dry friction, N m.
    pub dry_n_m: f64,
    /// Standard deviation of what is known of dry and viscous friction together, N m, at any temperature.
    pub friction_sigma_n_m: f64,
    /// Viscous friction, N m s/rad.
    pub viscous_n_m_s_per_rad: f64,
    /// Friction per torque on the gears.
    pub load_friction: f64,
    /// Standard deviation of what is known of it.
    pub load_friction_sigma: f64,
    /// Which end of the gear train that torque is: 1 the motor's, 0 the cam's.
    pub load_share: f64,
    /// Friction per square of the torque on the gears, 1/(N m).
    pub load_squared_per_n_m: f64,
    /// As [`load_share`](Self::load_share), for the square.
    pub load_squared_share: f64,
    /// Ripple of the torque with the angle. Terms with waves of 0 are not in use.
    pub ripple: [Ripple; MAX_RIPPLES],
    /// Standard deviation of what is known of each amplitude, N m.
    pub ripple_sigma_n_m: f64,
}

impl GearModel {
    /// A motor with dry and viscous friction alone.
    pub fn plain(torque_constant_n_m_per_a: f64, winding_resistance_ohm: f64, inertia_kg_m2: f64) -> Self {
        Self {
            source: CurrentSource::Winding,
            torque_constant_n_m_per_a,
            torque_constant_sigma: 0.02,
            winding_resistance_ohm,
            inertia_kg_m2,
            dry_n_m: 0.0,
            friction_sigma_n_m: 0.02,
            viscous_n_m_s_per_rad: 0.0,
            load_friction: 0.0,
            load_friction_sigma: 0.02,
            load_share: 0.5,
            load_squared_per_n_m: 0.0,
            load_squared_share: 0.5,
            ripple: [Ripple::default(); MAX_RIPPLES],
            ripple_sigma_n_m: 0.002,
        }
    }

    /// The motor's winding, and what is reported of it.
    #[inline]
    pub fn winding(&self) -> Winding {
        Winding {
            source: self.source,
            torque_constant_n_m_per_a: self.torque_constant_n_m_per_a,
            torque_constant_sigma: self.torque_constant_sigma,
            resistance_ohm: self.winding_resistance_ohm,
        }
    }

    /// Current in the winding, A, from one reading; `NaN` where a value that it needs is.
    #[inline]
    pub fn winding_current_a(&self, reported: &Reported) -> f64 {
        self.winding().current_a(reported)
    }

    /// Torque on the cam, N m, and on the gears, at a current in the winding; inertia is not subtracted.
    #[inline]
    pub fn cam_torque_n_m(&self, winding_a: f64, velocity_rad_per_s: f64, angle_rad: f64) -> f64 {
        let motor_n_m = self.torque_constant_n_m_per_a * winding_a;
        let sign = if velocity_rad_per_s < 0.0 { -1.0 } else { 1.0 };
        let free_n_m = motor_n_m
            - self.ripple_n_m(angle_rad)
            - sign * self.dry_n_m
            - self.viscous_n_m_s_per_rad * velocity_rad_per_s;
        let mut cam_n_m = free_n_m;
        for _ in 0..ITERATIONS {
            cam_n_m = free_n_m - sign * self.load_friction_n_m(motor_n_m, cam_n_m);
        }
        cam_n_m
    }

    /// Torque that the motor must give for a torque on the cam, at a constant velocity and without ripple, N m: the inverse of
    /// [`cam_torque_n_m`](Self::cam_torque_n_m).
    #[inline]
    pub fn motor_torque_n_m(&self, cam_n_m: f64, velocity_rad_per_s: f64) -> f64 {
        let sign = if velocity_rad_per_s < 0.0 { -1.0 } else { 1.0 };
        let without_load_n_m = cam_n_m + sign * self.dry_n_m + self.viscous_n_m_s_per_rad * velocity_rad_per_s;
        let mut motor_n_m = without_load_n_m;
        for _ in 0..NEWTON_STEPS {
            let on_gears = |share: f64| share * motor_n_m + (1.0 - share) * cam_n_m;
            let slope = (self.load_friction * self.load_share).copysign(on_gears(self.load_share))
                + 2.0 * self.load_squared_per_n_m * self.load_squared_share * on_gears(self.load_squared_share);
            let missing_n_m = without_load_n_m + sign * self.load_friction_n_m(motor_n_m, cam_n_m) - motor_n_m;
            motor_n_m += missing_n_m / (1.0 - sign * slope);
        }
        motor_n_m
    }

    /// Friction by the torque on the gears, N m.
    #[inline]
    pub fn load_friction_n_m(&self, motor_n_m: f64, cam_n_m: f64) -> f64 {
        let on_gears = |share: f64| share * motor_n_m + (1.0 - share) * cam_n_m;
        self.load_friction * on_gears(self.load_share).abs()
            + self.load_squared_per_n_m * on_gears(self.load_squared_share).powi(2)
    }

    /// Torque ripple at an angle, N m.
    #[inline]
    pub fn ripple_n_m(&self, angle_rad: f64) -> f64 {
        let mut ripple_n_m = 0.0;
        for term in self
            .ripple
            .iter()
            .filter(|term| term.waves != 0.0 && (term.sine_n_m, term.cosine_n_m) != (0.0, 0.0))
        {
            let (sine, cosine) = (term.waves * angle_rad.rem_euclid(TAU)).sin_cos();
            ripple_n_m += term.sine_n_m * sine + term.cosine_n_m * cosine;
        }
        ripple_n_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What comes out is what the implicit law took in, driving and driven, either way round.
    #[test]
    fn the_balance_is_solved() {
        let gear = GearModel {
            dry_n_m: 0.03,
            viscous_n_m_s_per_rad: 4e-3,
            load_friction: 0.2,
            load_squared_per_n_m: 0.5,
            ripple: [Ripple {
                waves: 7.0,
                sine_n_m: 1e-3,
                cosine_n_m: -2e-3,
            }; MAX_RIPPLES],
            ..GearModel::plain(0.39, 3.4, 2e-4)
        };
        for (current_a, velocity) in [(0.15, 2.5), (0.09, 2.5), (0.6, 2.5), (-0.15, -2.5), (0.09, 0.5)] {
            let cam = gear.cam_torque_n_m(current_a, velocity, 1.0);
            let motor = 0.39 * current_a;
            let friction = velocity.signum() * (0.03 + gear.load_friction_n_m(motor, cam)) + 4e-3 * velocity;
            let left = motor - gear.ripple_n_m(1.0) - friction - cam;
            assert!(left.abs() < 2e-5, "{left} N m are left at {current_a} A");
        }
    }
}
