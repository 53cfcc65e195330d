//! The motor that a configuration describes.

use super::Config;
use worm_physics::Motor;

impl Config {
    /// The servo as the model takes it. Nobody has measured the friction inside a servo before its first gait cycle; that of
    /// `[virtual_worm]` stands for it.
    pub fn motor(&self) -> Motor {
        Motor {
            winding_resistance_ohm: self.servo.winding_resistance_ohm,
            torque_constant_n_m_per_a: self.servo.torque_constant_n_m_per_a,
            friction_n_m: self.virtual_worm.inner_friction_n_m,
            viscous_n_m_s_per_rad: self.virtual_worm.inner_viscous_n_m_s_per_rad,
        }
    }
}
