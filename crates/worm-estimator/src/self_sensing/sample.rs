//! A reading of the motor, as self-sensing needs it.

use crate::message::State;
use crate::winding::Reported;

/// A reading of the motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorSample {
    /// When it was taken, s, by any clock that runs evenly.
    pub time_s: f64,
    /// Gait phase, cycles, unwrapped.
    pub phase: f64,
    /// Angle of the servo's shaft, rad: what ripple returns with.
    pub angle_rad: f64,
    /// Velocity of the cam, rad/s.
    pub velocity_rad_per_s: f64,
    /// Reported current, A.
    pub current_a: f64,
    /// Voltage on the bus, V.
    pub bus_voltage_v: f64,
    /// Duty of the bridge, −1 to 1.
    pub duty: f64,
    /// Temperature of the servo, °C; `NaN` where unknown.
    pub temperature_c: f64,
    /// Pitch of the body, rad, growing up the canal; `NaN` where nothing measures it.
    pub pitch_rad: f64,
    /// By which its taker knows it again, ns: [`SelfSensed::end_ns`](super::SelfSensed::end_ns) is that of the reading that ended the cycle.
    pub stamp_ns: u64,
}

impl From<&State> for MotorSample {
    /// The motor's part of a state; its time is that of the motor's own clock.
    fn from(state: &State) -> Self {
        Self {
            time_s: state.motor_time_s,
            phase: state.phase,
            angle_rad: state.motor_angle_rad,
            velocity_rad_per_s: state.motor_velocity_rad_s,
            current_a: state.motor_current_a,
            bus_voltage_v: state.bus_voltage_v,
            duty: state.motor_duty,
            temperature_c: state.motor_temperature_c,
            pitch_rad: state.pitch_rad,
            stamp_ns: state.time_ns,
        }
    }
}

impl From<&MotorSample> for Reported {
    fn from(sample: &MotorSample) -> Self {
        Self {
            current_a: sample.current_a,
            bus_voltage_v: sample.bus_voltage_v,
            duty: sample.duty,
            velocity_rad_per_s: sample.velocity_rad_per_s,
            temperature_c: sample.temperature_c,
        }
    }
}
