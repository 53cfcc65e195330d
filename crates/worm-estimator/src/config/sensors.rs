//! What the worm is watched with: tracker, inertial sensor, emergency stop.

use super::check::Checker;
use serde::Deserialize;

/// The device that measures cell positions.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Tracker {
    /// Whether there is one. Without it the worm crawls without positions, and no other key here counts but `rate_hz`, at which
    /// estimates are made then.
    pub present: bool,
    /// Device ID on the bus.
    pub id: u8,
    /// Required model number.
    pub model_number: u16,
    /// Samples per second.
    pub rate_hz: f64,
    /// Standard deviation of one position, m, as far as known.
    pub noise_m: f64,
}

impl Default for Tracker {
    fn default() -> Self {
        Self {
            present: true,
            id: 100,
            model_number: 0x574D,
            rate_hz: 120.0,
            noise_m: 1e-4,
        }
    }
}

impl Tracker {
    /// `is_used` is whether there is such a device.
    pub(super) fn check(&self, servo_id: u8, is_used: bool, checker: &mut Checker) {
        checker.range("tracker.id", self.id, 0..=252, "");
        let is_own_id = !is_used || self.id != servo_id;
        checker.require(is_own_id, "tracker.id", self.id, "must differ from servo.id");
        checker.range("tracker.rate_hz", self.rate_hz, 20.0..=2000.0, "Hz");
        checker.range("tracker.noise_m", self.noise_m, 1e-7..=5e-3, "m");
    }
}

/// An inertial sensor in the tracker's device, or in a device of its kind that tracks no cells: it measures the pitch of the body.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct InertialSensor {
    /// Standard deviation of a cycle's mean pitch about the slope, degrees: offset, mounting, how the body lies in the canal.
    pub sigma_deg: f64,
    /// Standard deviation of the pull on the body about the weight of the stated mass on that slope, N: payload and drag.
    pub load_sigma_n: f64,
}

impl Default for InertialSensor {
    fn default() -> Self {
        Self {
            sigma_deg: 0.5,
            load_sigma_n: 0.3,
        }
    }
}

impl InertialSensor {
    pub(super) fn check(&self, checker: &mut Checker) {
        checker.range("inertial_sensor.sigma_deg", self.sigma_deg, 0.01..=30.0, "degrees");
        checker.range("inertial_sensor.load_sigma_n", self.load_sigma_n, 1e-3..=100.0, "N");
    }
}

/// Where the emergency stop is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EmergencyStopSource {
    /// Register 127 of the tracker, in the same read as the samples.
    Tracker,
    /// A GPIO line of this computer.
    Gpio,
}

/// The emergency stop's input.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EmergencyStop {
    /// Where it is read.
    pub source: EmergencyStopSource,
    /// Bits of the tracker's register of which each means pressed.
    #[serde(default = "default_emergency_mask")]
    pub mask: u8,
    /// Device file of the GPIO chip.
    #[serde(default = "default_gpio_chip")]
    pub chip: String,
    /// Line of the chip.
    pub line: Option<u32>,
    /// Whether a low level means pressed.
    #[serde(default)]
    pub active_low: bool,
    /// Time without a reading after which it counts as pressed, s.
    #[serde(default = "default_emergency_timeout_s")]
    pub timeout_s: f64,
}

fn default_emergency_mask() -> u8 {
    1
}

fn default_gpio_chip() -> String {
    "/dev/gpiochip0".to_owned()
}

fn default_emergency_timeout_s() -> f64 {
    0.1
}

impl EmergencyStop {
    pub(super) fn check(&self, has_tracker: bool, checker: &mut Checker) {
        checker.require(
            has_tracker || self.source != EmergencyStopSource::Tracker,
            "emergency_stop.source",
            "\"tracker\"",
            "needs the tracker, and tracker.present = false: give \"gpio\", or leave the section out and keep a hand on the supply's switch",
        );
        checker.range("emergency_stop.mask", self.mask, 1..=255, "");
        checker.range("emergency_stop.timeout_s", self.timeout_s, 0.005..=5.0, "s");
        if self.source == EmergencyStopSource::Gpio {
            checker.require(
                self.chip.starts_with('/'),
                "emergency_stop.chip",
                format!("\"{}\"", self.chip),
                "name the device file of the chip, such as \"/dev/gpiochip0\"",
            );
            checker.require(
                self.line.is_some(),
                "emergency_stop.line",
                "none",
                "name the line of the chip; `gpioinfo` lists them",
            );
        }
    }
}
