//! The motor that a configuration describes.

use super::Config;
use worm_physics::Motor;
use worm_physics::effect::SettingError;
use worm_physics::servo::{Pendulum, ServoMotor, ServoPhysics};

impl Config {
    /// The servo as the model takes it: what it costs, and what the virtual worm has. A servo on a bench tells friction inside and inertia;
    /// before anybody had yours there, those of `[virtual_worm]` stand for them.
    ///
    /// # Errors
    /// [`SettingError`] for a servo effect that a checked configuration cannot have.
    pub fn motor(&self) -> Result<Motor, SettingError> {
        let virtual_worm = &self.virtual_worm;
        let servo = ServoMotor {
            torque_constant: self.servo.torque_constant_n_m_per_a,
            winding_ohm: self.servo.winding_resistance_ohm,
            rotor_inertia_kg_m2: virtual_worm.inertia_kg_m2,
            dry_n_m: virtual_worm.inner_friction_n_m,
            viscous_n_m_s: virtual_worm.inner_viscous_n_m_s_per_rad,
        };
        let physics =
            ServoPhysics::new(servo, Pendulum::NONE, virtual_worm.supply_v).with(&virtual_worm.servo_effects()?);
        Ok(Motor {
            servo: physics.motor,
            laws: physics.laws,
        })
    }
}
