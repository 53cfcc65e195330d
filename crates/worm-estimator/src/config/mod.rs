//! The configuration: one TOML file, every key with its unit and range, checked once and then trusted.
//!
//! [`Config::load`] reads a file, refuses unknown keys and values out of range (all of them at once, each with its remedy) and returns a
//! [`Config`] that the rest of the program takes for granted. Every key has a default, the worm of Zarrouk, Sharf and Shoham 2016;
//! `config/worm.toml` lists all of them with meaning, unit and range, and a test compares it with the defaults. [`Config::advice`] lists
//! settings that are valid but inadvisable.

mod advice;
mod alarms;
mod battery;
mod black_box;
mod check;
mod drive;
mod effect;
mod effect_table;
mod machine;
mod physics;
mod positions;
mod self_sensing;
mod sensors;
mod trip;
mod virtual_worm;
mod worm;

pub use advice::Advice;
pub use alarms::{AlarmConfig, Alarms, Policy};
pub use battery::{Battery, Chemistry, MAX_CURVE_POINTS};
pub use black_box::BlackBox;
pub use check::{ConfigError, ConfigProblem};
pub use effect::{Effect, EffectTextError};
pub use effect_table::{OneOrTwo, Rows, TableFields};
pub use machine::{
    Control, Estimator, IdleDisarm, Limits, OnLapsedLease, OnStaleTracker, Port, ReadMode, Realtime, Servo, Topics,
};
pub use physics::PhysicsError;
pub use positions::PositionSource;
pub use self_sensing::{Calibrated, CalibrationMode, ReportedCurrent, SelfSensing};
pub use sensors::{EmergencyStop, EmergencyStopSource, InertialSensor, Tracker};
pub use trip::{OnLinkBack, OnLinkLoss, OnStuck, Trip};
pub use virtual_worm::{PresentCurrent, ServoEffect, VirtualWorm};
pub use worm::{Canal, DeformationSource, Direction, Gait, PerCell, Worm};

use serde::Deserialize;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use worm_physics::MAX_TABLES;

/// The whole configuration. Values from [`Config::load`] and [`Config::from_toml`] are checked.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// The robot's body.
    pub worm: Worm,
    /// Effects beyond the paper's theory; [`Effect`] says what uses them.
    pub effect: Vec<Effect>,
    /// The canal that it crawls in.
    pub canal: Canal,
    /// How it crawls.
    pub gait: Gait,
    /// The serial port; absent: the virtual worm.
    pub port: Option<Port>,
    /// The servo that turns the cam.
    pub servo: Servo,
    /// The device that measures cell positions.
    pub tracker: Tracker,
    /// The sensor of the body's pitch, in the tracker's device; absent: there is none.
    pub inertial_sensor: Option<InertialSensor>,
    /// The emergency stop's input; absent: there is none.
    pub emergency_stop: Option<EmergencyStop>,
    /// The control loop.
    pub control: Control,
    /// Limits at which the controller stops by itself.
    pub limits: Limits,
    /// The estimator.
    pub estimator: Estimator,
    /// What is known of the gears, for what follows from the motor's current.
    pub self_sensing: SelfSensing,
    /// The threshold of each alarm, and the controller's reaction to it.
    pub alarms: Alarms,
    /// The battery; absent: its charge is not estimated.
    pub battery: Option<Battery>,
    /// What a trip does on its own.
    pub trip: Trip,
    /// The black box; absent: there is none, unless the command line asks for one.
    pub black_box: Option<BlackBox>,
    /// What the loop requests from the operating system.
    pub realtime: Realtime,
    /// Where the shared-memory topics live.
    pub topics: Topics,
    /// The simulated devices.
    pub virtual_worm: VirtualWorm,
}

/// Longest configuration or campaign that is read, bytes: one that names every key and a thousand runs is far shorter.
const MAX_TEXT_LEN: u64 = 1 << 20;

/// Reads a text file of at most a megabyte, as configurations and campaigns are.
///
/// # Errors
/// When it cannot be read, is no text, or is longer: a device such as `/dev/zero` has no end.
pub fn read_text(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    let length = File::open(path)?.take(MAX_TEXT_LEN + 1).read_to_string(&mut text)?;
    if length as u64 > MAX_TEXT_LEN {
        let problem = format!("longer than {MAX_TEXT_LEN} bytes");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, problem));
    }
    Ok(text)
}

impl Config {
    /// `config/worm.toml`: every key with its meaning, and the defaults as values.
    pub const COMMENTED: &'static str = include_str!("../../../../config/worm.toml");

    /// Reads and checks a configuration file.
    ///
    /// # Errors
    /// [`ConfigError`] when the file cannot be read, is not TOML, has an unknown key or a value out of range; its text
    /// names file, line or key, and the remedy.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        Ok(Self::load_with_text(path)?.0)
    }

    /// As [`Config::load`], with the text of the file, for a log.
    ///
    /// # Errors
    /// As [`Config::load`].
    pub fn load_with_text(path: &Path) -> Result<(Self, String), ConfigError> {
        let text = read_text(path).map_err(|source| ConfigError::Read {
            file: path.to_path_buf(),
            source,
        })?;
        Ok((Self::from_toml(&text, path)?, text))
    }

    /// Reads and checks a configuration in memory; errors call it `file`.
    ///
    /// # Errors
    /// As [`Config::load`], except for those of reading the file.
    pub fn from_toml(text: &str, file: &Path) -> Result<Self, ConfigError> {
        let config: Self = toml::from_str(text).map_err(|error| check::syntax(text, file, &error))?;
        let problems = config.problems();
        if problems.is_empty() {
            Ok(config)
        } else {
            Err(ConfigError::Values {
                file: PathBuf::from(file),
                problems,
            })
        }
    }

    /// Every value that is out of range or contradicts another.
    pub fn problems(&self) -> Vec<ConfigProblem> {
        let mut checker = check::Checker::default();
        self.worm.check(&mut checker);
        for effect in &self.effect {
            effect.check(self.worm.cells, &mut checker);
        }
        let tables = self.effect.iter().filter(|effect| effect.is_table()).count();
        checker.require(
            tables <= MAX_TABLES,
            "effect",
            format!("{tables} tables"),
            format!("give at most {MAX_TABLES}: add up those over the same axis"),
        );
        self.canal.check(&mut checker);
        self.gait.check(&mut checker);
        if let Some(port) = &self.port {
            port.check(&mut checker);
        }
        self.servo.check(&mut checker);
        let is_used = self.tracker.present || self.inertial_sensor.is_some();
        self.tracker.check(self.servo.id, is_used, &mut checker);
        if let Some(inertial_sensor) = &self.inertial_sensor {
            inertial_sensor.check(&mut checker);
        }
        if let Some(emergency_stop) = &self.emergency_stop {
            emergency_stop.check(self.tracker.present, &mut checker);
        }
        self.control.check(&mut checker);
        self.limits.check(&mut checker);
        self.estimator.check(&mut checker);
        self.self_sensing.check(&mut checker);
        self.alarms.check(&mut checker);
        if let Some(battery) = &self.battery {
            battery.check(&mut checker);
        }
        self.trip.check(&mut checker);
        if let Some(black_box) = &self.black_box {
            black_box.check(&mut checker);
        }
        self.realtime.check(&mut checker);
        self.topics.check(&self.worm.name, &mut checker);
        self.virtual_worm.check(self.worm.cells, &mut checker);
        if checker.problems.is_empty() {
            self.check_together(&mut checker);
        }
        checker.problems
    }

    /// Values that are each in range, but do not work together.
    fn check_together(&self, checker: &mut check::Checker) {
        let cam_rev_per_min = 60.0 / self.gait.cycle_s;
        checker.require(
            cam_rev_per_min <= self.servo.velocity_limit_rev_per_min,
            "gait.cycle_s",
            self.gait.cycle_s,
            format!(
                "is {cam_rev_per_min:.1} rev/min, beyond servo.velocity_limit_rev_per_min = {}",
                self.servo.velocity_limit_rev_per_min
            ),
        );
        let tick_s = 1.0 / self.control.rate_hz;
        // A tracker that is not there is never stale.
        let sample_s = self.tracker_rate_hz().map_or(0.0, |rate_hz| 1.0 / rate_hz);
        for (key, value, timeout_s, period_s, periods) in [
            (
                "servo.watchdog_ms",
                f64::from(self.servo.watchdog_ms),
                f64::from(self.servo.watchdog_ms) * 1e-3,
                tick_s,
                "ticks at control.rate_hz",
            ),
            (
                "control.link_timeout_s",
                self.control.link_timeout_s,
                self.control.link_timeout_s,
                tick_s,
                "ticks at control.rate_hz",
            ),
            (
                "control.tracker_timeout_s",
                self.control.tracker_timeout_s,
                self.control.tracker_timeout_s,
                sample_s.max(tick_s),
                "samples at tracker.rate_hz",
            ),
        ] {
            let min_s = 2.0 * period_s;
            checker.require(
                timeout_s >= min_s,
                key,
                value,
                format!("must be at least two {periods} ({min_s:.3} s), or the worm stops without need"),
            );
        }
    }

    /// Settings that are valid but inadvisable, each with a better choice.
    pub fn advice(&self) -> Vec<Advice> {
        advice::advise(self)
    }

    /// Cam speed of the configured gait, gait cycles per second, signed by the direction.
    pub fn gait_cycles_per_s(&self) -> f64 {
        self.gait.direction.sign() / self.gait.cycle_s
    }
}

#[cfg(test)]
mod tests;
