//! What holds at one moment in the world around the devices: the parameters through which faults act.
//!
//! A fault is never an `if` in the plant or in a device. It changes one of these values; plant, devices and wire take them
//! as they take any other parameter, and [`Conditions::default`] is a world without faults.

use worm_physics::MAX_CELLS;

/// Everything that a fault can change.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Conditions {
    /// Body, canal, motor, supply.
    pub plant: PlantConditions,
    /// What the tracker sees.
    pub camera: CameraConditions,
    /// The tracker's switches, one bit each; the emergency stop is one of them.
    pub switches: u8,
    /// The servo's electronics.
    pub servo: ServoConditions,
    /// The cable.
    pub wire: WireConditions,
}

/// Body, canal, motor and supply.
#[derive(Debug, Clone, PartialEq)]
pub struct PlantConditions {
    /// Scale of dry and viscous friction inside; a blocked cam is a very large one.
    pub inner_friction_scale: f64,
    /// What remains of each cell's stroke, in [0, 1].
    pub stroke_scale: [f64; MAX_CELLS],
    /// Scale of each cell's largest tip deformation, that is of friction.
    pub friction_scale: [f64; MAX_CELLS],
    /// Slope, degrees, in place of the configured one.
    pub slope_deg: Option<f64>,
    /// Resisting force besides the weight, N, down the canal.
    pub drag_n: f64,
    /// Velocity at which the worm is dragged down the canal, tips and all, m/s; its crawl goes on beside it.
    pub drag_speed_m_per_s: f64,
    /// What the battery's charge was set to when the fault began, share.
    pub battery_charge: Option<f64>,
    /// Voltage missing from the supply, V.
    pub supply_drop_v: f64,
    /// Resistance added to the supply, ohm.
    pub supply_extra_ohm: f64,
    /// Temperature that the servo's case is heated to, °C.
    pub heated_to_c: Option<f64>,
}

impl Default for PlantConditions {
    fn default() -> Self {
        Self {
            inner_friction_scale: 1.0,
            stroke_scale: [1.0; MAX_CELLS],
            friction_scale: [1.0; MAX_CELLS],
            slope_deg: None,
            drag_n: 0.0,
            drag_speed_m_per_s: 0.0,
            battery_charge: None,
            supply_drop_v: 0.0,
            supply_extra_ohm: 0.0,
            heated_to_c: None,
        }
    }
}

/// What the tracker sees.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CameraConditions {
    /// Bit *i*: cell *i* is hidden.
    pub hidden: u16,
    /// Standard deviation of a position, m, where it is not the configured one.
    pub noise_m: Option<f64>,
    /// Share of positions that are not seen, where it is not the configured one.
    pub dropout_share: Option<f64>,
}

/// The servo's electronics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ServoConditions {
    /// It has no power: silent, without torque, and it will come up as after a reboot.
    pub unpowered: bool,
    /// Hardware errors that it finds.
    pub hardware_errors: u8,
    /// Model number that it says it has.
    pub model_number: Option<u16>,
    /// Version of the firmware that it says it has.
    pub firmware: Option<u8>,
    /// Its bus watchdog latches without stopping the motor.
    pub watchdog_defect: bool,
}

/// The cable.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WireConditions {
    /// Nothing comes from the servo, and nothing reaches it.
    pub servo_silent: bool,
    /// Nothing comes from the tracker, and nothing reaches it.
    pub tracker_silent: bool,
    /// Share of answers that are lost.
    pub drop_fraction: f64,
    /// Share of answers with a flipped bit.
    pub corrupt_fraction: f64,
    /// How much later answers come, s.
    pub delay_s: f64,
}
