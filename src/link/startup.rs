//! From a port to a worm that is ready to tick: which devices answer, are they the configured ones, are they set up, can wrong
//! settings be corrected.
//!
//! 1. **Who answers?** Servo and tracker are pinged. When the servo is silent, the usual baud rates are tried and the bus is
//!    scanned, so that the error names the cause.
//! 2. **Is the motor at rest?** Torque goes off before anything else is checked or refused; it would lock the settings, too. During the
//!    checks the servo answers writes (status return level 2), so that a refusal has a reason.
//! 3. **Are they the right ones, and set up?** Model numbers; no hardware error; a watchdog that works; cells of the tracker; direction
//!    of counting, modes, gains, limits, profiles, shutdown, return delay. A setting that is right is not written: EEPROM wears.
//! 4. **Ready to tick:** status return level 1 (answer reads only, see the exchange), goal zero, watchdog cleared and set.
//! 5. **How are they read?** The read mode is tried with real requests, and the first reading is kept.

mod find_tracker;
mod identify;
mod set_up;

use std::ops::RangeInclusive;
use std::time::{Duration, Instant};

use super::operations::{OperationError, REPLY_TIME};
use super::packet::DeviceId;
use super::servo::{HardwareErrors, WATCHDOG_LATCHED, register};
use find_tracker::find_tracker;
use identify::identify_servo;
pub(crate) use set_up::limit_duty_to;
use set_up::{LEAST_VOLTAGE_V, limit_duty, set_up};

use super::{
    ExchangeOutcome, ExchangePlan, Finding, Identity, Port, PortError, ReadMode, ReadPlan, Register, ServoReading,
    TrackerQuery, TrackerReading, WormBus, tracker,
};

/// What errors call the tracker.
const TRACKER: &str = "tracker";
/// Status return level at which only pings and reads are answered.
const ANSWER_READS: u32 = 1;
/// Status return level at which everything is answered.
const ANSWER_ALL: u32 = 2;
/// Time for an answer that may or may not come.
const QUIET_TIME: Duration = Duration::from_millis(20);
/// How often the status return level is written before it counts as refused.
const STATUS_LEVEL_ATTEMPTS: usize = 3;
/// Exchanges in which a read mode may show that it works.
const READ_ATTEMPTS: usize = 5;
/// Servos of the 330 size, whose firmware up to 51 latches the bus watchdog without stopping the motor (ROBOTIS forum, topic
/// 4814): XL330-M077 and -M288, XC330-T181, -T288, -M181, -M288.
const MODELS_OF_SIZE_330: [u16; 6] = [1190, 1200, 1210, 1220, 1230, 1240];
const LAST_FIRMWARE_WITH_WATCHDOG_DEFECT: u8 = 51;
/// Model numbers of the X series: their register 64 switches torque.
const X_SERIES: RangeInclusive<u16> = 1000..=1999;

/// What the link has to know of a worm. The config fills it in.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkSettings {
    /// Baud rate in bit/s, one of [`BAUD_RATES`](crate::link::servo::BAUD_RATES); 1,000,000 is usual.
    pub baud: u32,
    /// The servo's ID.
    pub servo_id: DeviceId,
    /// The servo's model number, [`XL330_M288_MODEL`](crate::link::servo::XL330_M288_MODEL) by default.
    pub servo_model: u16,
    /// What has to be known of the tracker; none on a worm without one.
    pub tracker: Option<TrackerSettings>,
    /// How the devices are read in each tick. Without a tracker there is but one way.
    pub read: ReadMode,
    /// Silence in ms after which the motor stops by itself, rounded up to 20 ms; 20 to 2540.
    pub watchdog_ms: u32,
    /// Greatest current of the motor, that of one that is blocked, in A; XL330: up to 1.75. The servo gets it as a limit of its duty.
    pub current_limit_a: f64,
    /// Resistance of the winding at 25 °C in ohm.
    pub winding_resistance_ohm: f64,
    /// The servo's velocity limit in rad/s; XL330: up to 49.
    pub velocity_limit_rad_s: f64,
    /// Temperature in °C at which the servo shuts down; XL330: up to 100, 70 by default.
    pub temperature_limit_c: f64,
    /// Whether a servo is used whose firmware is known not to stop the motor when its bus watchdog acts.
    pub accept_unsafe_watchdog: bool,
}

/// What the link has to know of a tracker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TrackerSettings {
    /// Its ID, [`tracker::DEFAULT_ID`] by default.
    pub id: DeviceId,
    /// Its model number, [`tracker::MODEL`] by default.
    pub model: u16,
    /// Cells of the worm, 1 to [`MAX_CELLS`](worm_physics::MAX_CELLS); 0 for a device that only has an inertial sensor.
    pub cells: usize,
    /// Bits of its switches of which each means that the emergency stop is pressed; without it they are not read.
    pub emergency_stop_mask: Option<u8>,
    /// Whether its inertial sensor's pitch is read.
    pub pitch: bool,
    /// Whether a worm is prepared though its tracker is silent: it is asked in every exchange all the same.
    pub may_be_silent: bool,
}

impl TrackerSettings {
    const fn query(&self) -> TrackerQuery {
        TrackerQuery {
            id: self.id,
            cells: self.cells,
            emergency_stop_mask: self.emergency_stop_mask,
            pitch: self.pitch,
        }
    }
}

/// A worm that is ready to tick. Torque is off, the goal is zero, the watchdog is set.
#[derive(Debug, Clone, PartialEq)]
pub struct Prepared {
    /// How to exchange.
    pub plan: ExchangePlan,
    /// Who the servo is.
    pub servo: Identity,
    /// The tracker; none where there is none, or a silent one is accepted.
    pub tracker: Option<PreparedTracker>,
    /// Greatest duty of the motor, in (0, 1].
    pub duty_limit: f64,
    /// The servo as it stands.
    pub servo_reading: ServoReading,
}

/// A tracker that answers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PreparedTracker {
    /// Who it is.
    pub identity: Identity,
    /// Cells that it tracks.
    pub cells: u8,
    /// The cells as they lie.
    pub reading: TrackerReading,
}

/// Why a worm cannot be run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StartupError {
    /// Nobody answers, or others.
    #[error(
        "{device} (ID {id}) does not answer at {baud} baud: check power, cable and the ID in the config; {present}{}",
        without(device)
    )]
    Silent {
        /// "servo" or "tracker".
        device: &'static str,
        /// Who was asked.
        id: DeviceId,
        /// In bit/s.
        baud: u32,
        /// Who is there instead.
        present: String,
    },
    /// The servo answers at another baud rate.
    #[error(
        "servo answers at {found} baud, the config says {configured}: set port.baud to {found}, or register 8 of the servo"
    )]
    OtherBaudRate {
        /// In bit/s.
        found: u32,
        /// In bit/s.
        configured: u32,
    },
    /// The device is not the one configured.
    #[error(
        "{device} (ID {id}) is of model {found}, the config says {expected}: correct {device}.id or {device}.model_number"
    )]
    WrongModel {
        /// "servo" or "tracker".
        device: &'static str,
        /// Who was asked.
        id: DeviceId,
        /// Model number found.
        found: u16,
        /// Model number configured.
        expected: u16,
    },
    /// The servo has shut down.
    #[error("the servo reports a hardware error: {0}; remove the cause, then reboot the servo (a reset does so)")]
    HardwareError(HardwareErrors),
    /// Nothing would stop the motor when the computer falls silent.
    #[error(
        "the servo's firmware {firmware} is known not to stop the motor when its bus watchdog acts: update it with DYNAMIXEL \
         Wizard 2.0 and try `wormd check --try-watchdog`, or set servo.accept_unsafe_watchdog = true and keep a hand on the supply's \
         switch"
    )]
    UnsafeWatchdog {
        /// Version of the firmware.
        firmware: u8,
    },
    /// The tracker sees too few cells.
    #[error(
        "the tracker tracks {found} cells, the config says {configured}: correct worm.cells, or set up the tracker"
    )]
    TooFewCells {
        /// Cells that it tracks.
        found: u8,
        /// Cells configured.
        configured: usize,
    },
    /// The tracker does not have the emergency stop's register.
    #[error(
        "the tracker has no {}: set emergency_stop.source = \"gpio\", or give the tracker that register",
        tracker::register::SWITCHES
    )]
    NoEmergencyStop,
    /// The device does not have the pitch's register.
    #[error(
        "the tracker has no {}: give it an inertial sensor, or leave [inertial_sensor] out",
        tracker::register::PITCH
    )]
    NoInertialSensor,
    /// The supply is not one that a servo can work with, so no duty can be derived from it.
    #[error(
        "the servo reads a supply of {voltage_v:.1} V, less than {LEAST_VOLTAGE_V} V: look at the supply and its cable, and try again"
    )]
    NoSupply {
        /// The voltage, V.
        voltage_v: f64,
    },
    /// A limit that the register cannot hold.
    #[error("{value} is no {register} that the servo can hold: correct it in the config")]
    Limit {
        /// Which.
        register: Register,
        /// What the config asks for, in SI units.
        value: f64,
    },
    /// No way of reading brought both devices' data.
    #[error(
        "reading both devices at once brings nothing whole: servo {servo}, tracker {tracker}; try read mode `separate`"
    )]
    Unreadable {
        /// How the servo fared.
        servo: String,
        /// How the tracker fared.
        tracker: String,
    },
    /// A register could not be read or set.
    #[error(transparent)]
    Operation(#[from] OperationError),
    /// The port failed.
    #[error(transparent)]
    Port(#[from] PortError),
}

/// What else a user can do about a device that is not there.
fn without(device: &str) -> &'static str {
    match device {
        TRACKER => "; a worm that has none needs tracker.present = false",
        _ => "",
    }
}

/// Checks servo and tracker and makes them ready to tick. What was wrong goes into `findings`, corrected or not, even when
/// an error ends the check.
///
/// # Errors
/// [`StartupError`]: the worm must not be run.
pub fn prepare<P: Port>(
    bus: &mut WormBus<P>,
    settings: &LinkSettings,
    findings: &mut Vec<Finding>,
) -> Result<Prepared, StartupError> {
    let servo_id = settings.servo_id;
    let servo = find_servo(bus, settings, findings)?;
    let tracker = match &settings.tracker {
        Some(tracker) => find_tracker(bus, settings, tracker, findings)?,
        None => None,
    };

    set_up(bus, settings, findings)?;
    let duty_limit = limit_duty(bus, settings)?;
    set_status_level(bus, servo_id, ANSWER_READS)?;
    bus.rearm_watchdog(servo_id, settings.watchdog_ms)?;

    let (plan, outcome) = choose_read_plan(bus, settings, tracker.is_some(), findings)?;
    Ok(Prepared {
        plan,
        servo,
        tracker: tracker
            .zip(outcome.tracker)
            .map(|((identity, cells), reading)| PreparedTracker {
                identity,
                cells,
                reading,
            }),
        duty_limit,
        servo_reading: outcome.servo,
    })
}

/// Finds the configured servo and brings it to rest: torque off and verified, everything answered, no hardware error, a watchdog that works.
///
/// # Errors
/// [`StartupError`]: torque must not come on.
pub(crate) fn find_servo<P: Port>(
    bus: &mut WormBus<P>,
    settings: &LinkSettings,
    findings: &mut Vec<Finding>,
) -> Result<Identity, StartupError> {
    let servo_id = settings.servo_id;
    let servo = identify_servo(bus, settings);
    // The motor comes to rest first, whatever else is wrong.
    let had_torque = match &servo {
        Ok(_) => bring_to_rest(bus, servo_id),
        Err(StartupError::WrongModel { found, .. }) if X_SERIES.contains(found) => bring_to_rest(bus, servo_id),
        Err(_) => false,
    };
    let servo = servo?;
    set_status_level(bus, servo_id, ANSWER_ALL)?;
    unlock(bus, servo_id, had_torque, findings)?;
    let errors = bus.hardware_errors(servo_id)?;
    if !errors.is_none() {
        return Err(StartupError::HardwareError(errors));
    }
    check_watchdog(servo, settings.accept_unsafe_watchdog, findings)?;
    Ok(servo)
}

/// Whether a servo is known to turn on when its bus watchdog has acted.
fn has_watchdog_defect(servo: Identity) -> bool {
    MODELS_OF_SIZE_330.contains(&servo.model) && servo.firmware <= LAST_FIRMWARE_WITH_WATCHDOG_DEFECT
}

fn check_watchdog(servo: Identity, accept_unsafe: bool, findings: &mut Vec<Finding>) -> Result<(), StartupError> {
    let firmware = servo.firmware;
    if !has_watchdog_defect(servo) {
        return Ok(());
    }
    if !accept_unsafe {
        return Err(StartupError::UnsafeWatchdog { firmware });
    }
    findings.push(Finding::open(
        format!("with firmware {firmware} a servo of this size may turn on when its bus watchdog latches"),
        "update it with DYNAMIXEL Wizard 2.0, then try `wormd check --try-watchdog`",
    ));
    Ok(())
}

/// Sets the status return level, whatever it is now.
fn set_status_level<P: Port>(bus: &mut WormBus<P>, servo: DeviceId, level: u32) -> Result<(), StartupError> {
    let register = register::STATUS_RETURN_LEVEL;
    for _ in 0..STATUS_LEVEL_ATTEMPTS {
        // Whether this write is answered depends on the previous level. The pause lets an answer pass, so that it does not collide
        // with the next request.
        bus.set_writes_are_answered(false);
        bus.write_register(servo, register, level, Instant::now() + REPLY_TIME)
            .map_err(|error| OperationError::Transaction { register, error })?;
        bus.settle(Instant::now() + QUIET_TIME)?;
        // At level 0 a read is not answered: then the write got lost.
        if bus.read_register(servo, register, Instant::now() + REPLY_TIME) == Ok(level) {
            bus.set_writes_are_answered(level == ANSWER_ALL);
            return Ok(());
        }
    }
    // Only the answers may have got lost, so it is asked once more, and more persistently.
    let found = bus.register(servo, register)?;
    if found == level {
        bus.set_writes_are_answered(level == ANSWER_ALL);
        return Ok(());
    }
    Err(OperationError::NotKept {
        id: servo,
        register,
        wanted: level,
        found,
    }
    .into())
}

/// Switches torque off, whether or not any answer comes; returns whether it was on, as far as the servo said. What fails here is
/// reported by the steps that follow, which ask again.
fn bring_to_rest<P: Port>(bus: &mut WormBus<P>, servo: DeviceId) -> bool {
    let deadline = |time| Instant::now() + time;
    // Not answered for certain, and nothing waits for the answers: a servo at status return level 0 says nothing to a read either.
    bus.set_writes_are_answered(false);
    let _ = bus.write_register(servo, register::STATUS_RETURN_LEVEL, ANSWER_ALL, deadline(REPLY_TIME));
    let _ = bus.settle(deadline(QUIET_TIME));
    let found = bus.read_register(servo, register::TORQUE_ENABLE, deadline(REPLY_TIME));
    let _ = bus.write_register(servo, register::TORQUE_ENABLE, 0, deadline(REPLY_TIME));
    let _ = bus.settle(deadline(QUIET_TIME));
    found.is_ok_and(|torque| torque != 0)
}

/// Switches torque off, verified this time, and clears the watchdog, which lock settings and goal.
fn unlock<P: Port>(
    bus: &mut WormBus<P>,
    servo: DeviceId,
    had_torque: bool,
    findings: &mut Vec<Finding>,
) -> Result<(), StartupError> {
    if bus.register(servo, register::TORQUE_ENABLE)? != 0 || had_torque {
        findings.push(Finding::corrected(
            "torque was on: an earlier controller ended without an orderly stop",
            "torque off",
        ));
    }
    bus.set_torque(servo, false)?;
    if bus.register(servo, register::BUS_WATCHDOG)? == u32::from(WATCHDOG_LATCHED) {
        findings.push(Finding::corrected(
            "the bus watchdog had stopped the motor: the computer fell silent while torque was on",
            "cleared",
        ));
    }
    bus.set_register(servo, register::BUS_WATCHDOG, 0)?;
    Ok(())
}

/// The first readings, of the devices that answer.
struct FirstReadings {
    servo: ServoReading,
    tracker: Option<TrackerReading>,
}

fn choose_read_plan<P: Port>(
    bus: &mut WormBus<P>,
    settings: &LinkSettings,
    tracker_answers: bool,
    findings: &mut Vec<Finding>,
) -> Result<(ExchangePlan, FirstReadings), StartupError> {
    let candidates: &[ReadPlan] = match settings.read {
        _ if settings.tracker.is_none() => &[ReadPlan::Separate],
        ReadMode::Auto => &[ReadPlan::FastBulk, ReadPlan::Bulk, ReadPlan::Separate],
        ReadMode::Always(ReadPlan::FastBulk) => &[ReadPlan::FastBulk],
        ReadMode::Always(ReadPlan::Bulk) => &[ReadPlan::Bulk],
        ReadMode::Always(ReadPlan::Separate) => &[ReadPlan::Separate],
    };
    let mut last: Option<ExchangeOutcome> = None;
    for &read in candidates {
        let plan = ExchangePlan {
            servo: settings.servo_id,
            tracker: settings.tracker.as_ref().map(TrackerSettings::query),
            read,
        };
        for _ in 0..READ_ATTEMPTS {
            let outcome = bus.exchange(&plan, 0.0, Instant::now() + REPLY_TIME);
            let readings = outcome.servo.ok().map(|servo| FirstReadings {
                servo,
                tracker: outcome.tracker.ok(),
            });
            if let Some(readings) = readings.filter(|readings| readings.tracker.is_some() || !tracker_answers) {
                if candidates.len() > 1 && read != ReadPlan::FastBulk {
                    findings.push(Finding::corrected(
                        "servo and tracker do not both know the fast bulk read, so ticks take longer on the wire",
                        format!("read mode {read:?}"),
                    ));
                }
                return Ok((plan, readings));
            }
            if outcome.is_disconnected() {
                return Err(PortError::Disconnected.into());
            }
            last = Some(outcome);
        }
    }
    let fate =
        |failure: Option<super::ReadFailure>| failure.map_or_else(|| "is read".to_owned(), |why| why.to_string());
    Err(StartupError::Unreadable {
        servo: fate(last.and_then(|outcome| outcome.servo.err())),
        tracker: fate(last.and_then(|outcome| outcome.tracker.err())),
    })
}
