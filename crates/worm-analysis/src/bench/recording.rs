//! What a servo reported while it moved an arm.

use std::path::PathBuf;

/// A recording of a servo: a value for each reading.
#[derive(Debug, Clone, PartialEq)]
pub struct ServoRecording {
    /// Where it comes from.
    pub source: PathBuf,
    /// Time, s.
    pub time_s: Vec<f64>,
    /// Goal that holds from then on, rad.
    pub goal_rad: Vec<f64>,
    /// Position as read, rad.
    pub position_rad: Vec<f64>,
    /// Velocity as read, rad/s.
    pub velocity_rad_s: Vec<f64>,
    /// Current as read, A.
    pub current_a: Vec<f64>,
    /// Voltage at the servo as read, V; empty where it was not recorded.
    pub input_v: Vec<f64>,
    /// Temperature as read, °C; empty where it was not recorded.
    pub temperature_c: Vec<f64>,
    /// Whether the torque is on from then on.
    pub torque_enabled: Vec<bool>,
}

impl ServoRecording {
    /// Number of readings.
    pub fn readings(&self) -> usize {
        self.time_s.len()
    }

    /// Time from the first reading to the last, s.
    pub fn duration_s(&self) -> f64 {
        match (self.time_s.first(), self.time_s.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }
}
