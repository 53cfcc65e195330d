//! The port and what is on it, as the loop uses it: exchanges, and the services that take longer than a tick.

use super::Service;
use super::replaceable_port::ReplaceablePort;
use crate::link::servo::scale;
use crate::link::{
    ArmError, ExchangeOutcome, ExchangePlan, Finding, LinkCounters, LinkSettings, MotionTrial, OpenError,
    OperationError, Prepared, ReadMode, ReadPlan, StartupError, StopInputs, TrackerSettings, TrialError, Tty,
    WatchdogTrial, WormBus, arm, disarm, prepare,
};
use dynamixel_bus::packet::DeviceId;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::time::Instant;
use worm_estimator::config::{Config, EmergencyStopSource, PositionSource, ReadMode as ConfiguredRead};

/// Why the worm's devices cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum DriveError {
    /// The port cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The devices on it failed the start-up checks.
    #[error("{path}: {source}", path = path.display())]
    Startup {
        /// The port.
        path: PathBuf,
        /// What is wrong.
        source: StartupError,
    },
    /// The port is gone.
    #[error("{path}: the port is gone: plug it in again; it is opened as soon as it is back", path = path.display())]
    Gone {
        /// The port.
        path: PathBuf,
    },
    /// The thread that opens a port again cannot be started.
    #[error("{path}: a thread cannot be started: {source}", path = path.display())]
    Thread {
        /// The port.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// Torque was asked for, and may be on although arming failed.
    #[error("{path}: {source}", path = path.display())]
    TorqueUnknown {
        /// The port.
        path: PathBuf,
        /// What went wrong.
        source: Box<ArmError>,
    },
    /// A trial could not be made.
    #[error("{path}: {source}", path = path.display())]
    Trial {
        /// The port.
        path: PathBuf,
        /// What went wrong.
        source: Box<TrialError>,
    },
    /// A device did not obey.
    #[error("{path}: {source}", path = path.display())]
    Operation {
        /// The port.
        path: PathBuf,
        /// What is wrong.
        source: OperationError,
    },
    /// The configuration names an invalid device ID.
    #[error("device ID {0} is not from 0 to 252: correct servo.id or tracker.id")]
    BadId(u8),
}

/// The link settings of the worm in `config`.
///
/// # Errors
/// [`DriveError::BadId`] for an ID that no device can have.
pub fn link_settings(config: &Config, baud: u32) -> Result<LinkSettings, DriveError> {
    let read = config.port.as_ref().map_or(ConfiguredRead::Auto, |port| port.read);
    Ok(LinkSettings {
        baud,
        servo_id: device_id(config.servo.id)?,
        servo_model: config.servo.model_number,
        tracker: tracker_settings(config)?,
        read: match read {
            ConfiguredRead::Auto => ReadMode::Auto,
            ConfiguredRead::FastBulk => ReadMode::Always(ReadPlan::FastBulk),
            ConfiguredRead::Bulk => ReadMode::Always(ReadPlan::Bulk),
            ConfiguredRead::Separate => ReadMode::Always(ReadPlan::Separate),
        },
        watchdog_ms: config.servo.watchdog_ms,
        current_limit_a: config.servo.current_limit_a,
        winding_resistance_ohm: config.servo.winding_resistance_ohm,
        velocity_limit_rad_s: config.servo.velocity_limit_rev_per_min * TAU / 60.0,
        temperature_limit_c: f64::from(config.servo.temperature_limit_c),
        accept_unsafe_watchdog: config.servo.accept_unsafe_watchdog,
    })
}

fn device_id(id: u8) -> Result<DeviceId, DriveError> {
    DeviceId::new(id).ok_or(DriveError::BadId(id))
}

fn tracker_settings(config: &Config) -> Result<Option<TrackerSettings>, DriveError> {
    let pitch = config.inertial_sensor.is_some();
    let (cells, may_be_silent) = match config.position_source() {
        PositionSource::Nothing if !pitch => return Ok(None),
        PositionSource::Nothing => (0, true),
        PositionSource::Tracker => (config.worm.cells, false),
        PositionSource::TrackerWhileItLasts => (config.worm.cells, true),
    };
    Ok(Some(TrackerSettings {
        id: device_id(config.tracker.id)?,
        model: config.tracker.model_number,
        cells,
        emergency_stop_mask: emergency_stop_mask(config),
        pitch,
        may_be_silent,
    }))
}

/// The tracker's bits that mean a pressed emergency stop, if the tracker reads one.
fn emergency_stop_mask(config: &Config) -> Option<u8> {
    let configured = config.emergency_stop.as_ref();
    let at_tracker = configured.filter(|stop| stop.source == EmergencyStopSource::Tracker);
    at_tracker.map(|stop| stop.mask)
}

/// The open port with a servo and a tracker on it that have passed the start-up checks.
///
/// Dropping it stops the motor, after an orderly end as after an error or a panic. When the process is killed instead, the servo's
/// own watchdog stops the motor.
pub struct Drive {
    path: PathBuf,
    settings: LinkSettings,
    bus: WormBus<ReplaceablePort>,
    plan: ExchangePlan,
}

impl Drive {
    /// Opens the port and prepares the devices.
    ///
    /// # Errors
    /// [`DriveError`], whose text names port, device and remedy.
    pub fn open(path: &Path, settings: LinkSettings) -> Result<(Self, Prepared, Vec<Finding>), DriveError> {
        let (port, mut findings) = Tty::open(path, settings.baud)?;
        let port = ReplaceablePort::new(port, path, settings.baud).map_err(|source| DriveError::Thread {
            path: path.to_owned(),
            source,
        })?;
        let mut bus = WormBus::new(port);
        let prepared = prepare(&mut bus, &settings, &mut findings).map_err(|source| DriveError::Startup {
            path: path.to_owned(),
            source,
        })?;
        let plan = prepared.plan;
        Ok((
            Self {
                path: path.to_owned(),
                settings,
                bus,
                plan,
            },
            prepared,
            findings,
        ))
    }

    /// One exchange: sends the goal and receives the readings, until `deadline` at the latest. Allocates nothing.
    ///
    /// A port that turns out to be gone is closed, and used again when it is back.
    pub fn exchange(&mut self, goal_counts: i32, deadline: Instant) -> ExchangeOutcome {
        self.bus.port_mut().take_back();
        let outcome = self
            .bus
            .exchange(&self.plan, f64::from(goal_counts) * scale::VELOCITY_RAD_S, deadline);
        if outcome.is_disconnected() {
            self.bus.port_mut().give_up();
        }
        outcome
    }

    /// Whether the port has gone.
    pub fn is_gone(&self) -> bool {
        self.bus.port().is_gone()
    }

    /// Turns the cam slowly, falls silent, and measures what the servo's watchdog does. Torque is off afterwards.
    ///
    /// # Errors
    /// [`DriveError::Trial`]
    pub fn try_watchdog(&mut self, stops: &mut StopInputs<'_>) -> Result<WatchdogTrial, DriveError> {
        let trial = self.bus.try_watchdog(&self.settings, stops);
        trial.map_err(|source| self.trial(source))
    }

    /// Turns the cam a little there and back, there in the servo's positive direction if `positive`. Torque is off afterwards.
    ///
    /// # Errors
    /// [`DriveError::Trial`]
    pub fn try_motion(&mut self, positive: bool, stops: &mut StopInputs<'_>) -> Result<MotionTrial, DriveError> {
        let sign = if positive { 1.0 } else { -1.0 };
        let trial = self.bus.try_motion(&self.settings, sign, stops);
        trial.map_err(|source| self.trial(source))
    }

    /// The link's counters.
    pub fn counters(&self) -> LinkCounters {
        self.bus.link_counters()
    }

    /// Executes a service. Returns the servo's hardware error status if it was read.
    ///
    /// # Errors
    /// [`DriveError`]; the motor is then off, or cannot be reached.
    pub fn serve(&mut self, service: Service) -> Result<Option<u8>, DriveError> {
        match service {
            Service::Arm => self.arm().map(|()| Some(0)),
            Service::Disarm => self.disarm(),
        }
    }

    fn arm(&mut self) -> Result<(), DriveError> {
        self.bus.port_mut().take_back();
        if self.is_gone() {
            return Err(DriveError::Gone {
                path: self.path.clone(),
            });
        }
        let mut findings = Vec::new();
        let path = || self.path.clone();
        let prepared = arm(&mut self.bus, &self.settings, &mut findings).map_err(|error| match error {
            ArmError::NotArmed(source) => DriveError::Startup { path: path(), source },
            error @ ArmError::TorqueUnknown { .. } => DriveError::TorqueUnknown {
                path: path(),
                source: Box::new(error),
            },
        })?;
        for finding in findings.iter().filter(|finding| finding.corrected) {
            tracing::info!("{}: {} ({})", self.path.display(), finding.what, finding.remedy);
        }
        self.plan = prepared.plan;
        Ok(())
    }

    fn disarm(&mut self) -> Result<Option<u8>, DriveError> {
        let errors = disarm(&mut self.bus, self.settings.servo_id).map_err(|source| DriveError::Operation {
            path: self.path.clone(),
            source,
        })?;
        Ok(errors.map(|errors| errors.0))
    }

    fn trial(&self, source: TrialError) -> DriveError {
        DriveError::Trial {
            path: self.path.clone(),
            source: Box::new(source),
        }
    }
}

impl Drop for Drive {
    fn drop(&mut self) {
        if self.is_gone() {
            return;
        }
        let servo = self.settings.servo_id;
        // Both are tried, even if one fails; if neither arrives, the servo's watchdog stops the motor.
        let stopped = self.bus.stop_motor(servo);
        let torque_off = self.bus.set_torque(servo, false);
        if let Err(error) = stopped.and(torque_off) {
            tracing::error!(
                "{}: {error}: the servo's own watchdog stops the motor",
                self.path.display()
            );
        }
    }
}
