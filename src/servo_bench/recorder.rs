//! Tells a servo with an arm its goals in position mode, and notes what it reports.
//!
//! The arm hangs still when it begins: that is angle 0. Torque is on only during a run, and goes off at its end, on every error, on a signal,
//! and when this is dropped; when the process is killed, the servo's bus watchdog holds the arm where it is. Limits of the servo and of the
//! configuration are honoured, never changed: goals stay within its position limits, its duty within its PWM limit and within what makes a
//! blocked motor draw `servo.current_limit_a`.

use super::trajectory::{DURATION_S, Goal, Trajectory};
use crate::link::packet::DeviceId;
use crate::link::servo::{BLOCK_ADDRESS, BLOCK_LEN, FULL_PWM, HardwareErrors, POSITION_MODE, register, scale};
use crate::link::{
    Finding, LinkSettings, OperationError, Port, PortError, Register, ServoReading, StartupError, StopInputs,
    TransactionError, TrialError, WormBus, find_servo, limit_duty_to,
};
use std::f64::consts::PI;
use std::time::{Duration, Instant};
use worm_estimator::config::Config;

/// How long a request may wait for its answer.
const REPLY_TIME: Duration = Duration::from_millis(30);
/// Failed exchanges in a row that end a run.
const MAX_FAILURES: u32 = 3;
/// Time for which the arm must not move before a run, and for how long that is waited for.
const STILL: Duration = Duration::from_millis(500);
const SETTLING: Duration = Duration::from_secs(20);
/// How often a hanging arm is looked at, and by how many counts it may seem to move.
const LOOK: Duration = Duration::from_millis(20);
const STILL_COUNTS: i32 = 2;
/// How long the arm is let down at the end of a run, s.
const LET_DOWN_S: f64 = 0.8;
/// How far beyond its amplitude the arm may swing, rad.
const BEYOND_RAD: f64 = 0.8;
/// Readings over which the voltage is averaged.
const VOLTAGE_READINGS: f64 = 20.0;

/// How recordings are made.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchSettings {
    /// Servo, watchdog and limits.
    pub link: LinkSettings,
    /// Greatest angle of a goal, rad.
    pub amplitude_rad: f64,
    /// Readings a second; the bus may allow fewer.
    pub rate_hz: f64,
    /// Temperature that ends a run, °C.
    pub max_temperature_c: f64,
    /// Voltage, averaged, that ends a run, V.
    pub min_voltage_v: f64,
}

impl BenchSettings {
    /// With the servo and the limits of a configuration.
    pub fn new(config: &Config, link: LinkSettings, amplitude_rad: f64, rate_hz: f64) -> Self {
        Self {
            link,
            amplitude_rad,
            rate_hz,
            max_temperature_c: config.limits.temperature_c,
            min_voltage_v: config.limits.voltage_v,
        }
    }
}

/// What was read at one moment. Angle 0 hangs down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Since the run began, s.
    pub time_s: f64,
    /// Goal position that was written just before, rad.
    pub goal_rad: f64,
    /// As read, rad.
    pub position_rad: f64,
    /// As read, rad/s.
    pub velocity_rad_s: f64,
    /// Present current as read, mA, signed.
    pub current_ma: f64,
    /// Voltage as read, V.
    pub input_v: f64,
    /// Temperature as read, °C.
    pub temperature_c: f64,
    /// Whether the torque was on.
    pub torque_enabled: bool,
}

/// Why no recording was made, or not to its end. Torque is off, as far as it can be switched off.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The servo is not there, not the right one, or not in order.
    #[error(transparent)]
    Startup(#[from] StartupError),
    /// The arm does not come to rest.
    #[error(
        "the arm does not hang still: it moved by {moved_deg:.1} degrees within half a second; let it hang freely, and \
         hold the bench"
    )]
    NotStill {
        /// Last motion, degrees.
        moved_deg: f64,
    },
    /// The goals do not fit into the servo's position limits.
    #[error(
        "goals from {low} to {high} counts leave the servo's position limits, {min} to {max}: put the horn on so that the \
         arm hangs near {} counts (it does at {hanging}), or give a smaller --amplitude-deg", f64::midpoint(f64::from(*min), f64::from(*max)).round()
    )]
    Limits {
        /// Least goal, counts.
        low: i32,
        /// Greatest goal, counts.
        high: i32,
        /// The servo's least position, counts.
        min: i32,
        /// The servo's greatest position, counts.
        max: i32,
        /// Where the arm hangs, counts.
        hanging: i32,
    },
    /// The arm swings beyond what was asked for.
    #[error("the arm is at {angle_deg:.0} degrees, far beyond its goals: is it on tight, and does it hang at angle 0?")]
    Range {
        /// Where it is, degrees.
        angle_deg: f64,
    },
    /// Too hot.
    #[error("the servo is at {found_c:.0} °C, and limits.temperature_c is {limit_c:.0}: let it cool, or lift less")]
    Hot {
        /// Temperature, °C.
        found_c: f64,
        /// The limit, °C.
        limit_c: f64,
    },
    /// The supply is too weak.
    #[error(
        "the supply is at {found_v:.1} V, and limits.voltage_v is {limit_v:.1}: use a stronger supply, or lift less"
    )]
    Weak {
        /// Voltage, V.
        found_v: f64,
        /// The limit, V.
        limit_v: f64,
    },
    /// The servo found an error.
    #[error("the servo reports a hardware error ({0}): remove the cause, then reboot the servo")]
    Hardware(HardwareErrors),
    /// The computer, or the bus, was silent for too long.
    #[error("nothing was sent for {0:.0} ms, and the watchdog stopped the servo: is the computer busy? Try again")]
    Paused(f64),
    /// A signal, or the emergency stop.
    #[error(transparent)]
    Stopped(TrialError),
    /// A register could not be read or set.
    #[error(transparent)]
    Operation(#[from] OperationError),
    /// The servo could not be read or told.
    #[error(transparent)]
    Transaction(#[from] TransactionError),
    /// The port failed.
    #[error(transparent)]
    Port(#[from] PortError),
}

/// A servo with an arm that hangs still, ready to record.
#[derive(Debug)]
pub struct BenchServo<'b, P: Port> {
    bus: &'b mut WormBus<P>,
    settings: BenchSettings,
    hanging_counts: i32,
    duty_limit: f64,
    supply_v: f64,
    restored: Vec<(Register, u32)>,
    torque_is_on: bool,
}

impl<'b, P: Port> BenchServo<'b, P> {
    /// Finds the servo, waits for the arm to hang still, and sets position mode. What was wrong and has been corrected goes into `findings`.
    ///
    /// # Errors
    /// [`RecordingError`]; nothing has moved.
    pub fn prepare(
        bus: &'b mut WormBus<P>,
        settings: BenchSettings,
        findings: &mut Vec<Finding>,
        stops: &mut StopInputs<'_>,
    ) -> Result<Self, RecordingError> {
        let id = settings.link.servo_id;
        find_servo(bus, &settings.link, findings)?;
        let mut servo = Self {
            bus,
            settings,
            hanging_counts: 0,
            duty_limit: 1.0,
            supply_v: 0.0,
            restored: Vec::new(),
            torque_is_on: false,
        };
        // Its mode and the way it counts belong to whoever uses it next.
        for (register, wanted) in [
            (register::OPERATING_MODE, u32::from(POSITION_MODE)),
            (register::DRIVE_MODE, 0),
            (register::RETURN_DELAY, 0),
        ] {
            let found = servo.bus.register(id, register)?;
            if found != wanted {
                servo.bus.set_register(id, register, wanted)?;
                servo.restored.push((register, found));
            }
        }
        for register in [
            register::POSITION_I_GAIN,
            register::POSITION_D_GAIN,
            register::FEEDFORWARD_1ST_GAIN,
            register::FEEDFORWARD_2ND_GAIN,
            register::PROFILE_ACCELERATION,
            register::PROFILE_VELOCITY,
        ] {
            servo.bus.set_register(id, register, 0)?;
        }
        let most = servo.bus.register(id, register::PWM_LIMIT)?.min(u32::from(FULL_PWM)) as u16;
        servo.duty_limit = limit_duty_to(servo.bus, &servo.settings.link, most.max(1))?;
        servo.hanging_counts = servo.wait_until_still(stops)?;
        servo.supply_v = servo.read()?.voltage_v;
        servo.check_position_limits()?;
        Ok(servo)
    }

    /// Voltage of the supply without load, V.
    pub fn supply_v(&self) -> f64 {
        self.supply_v
    }

    /// Greatest duty, in (0, 1].
    pub fn duty_limit(&self) -> f64 {
        self.duty_limit
    }

    /// One run of a trajectory. The arm is let down at its end, and the torque goes off.
    ///
    /// # Errors
    /// [`RecordingError`]; torque is off, as far as it can be switched off.
    pub fn record(
        &mut self,
        trajectory: Trajectory,
        gain: u16,
        stops: &mut StopInputs<'_>,
    ) -> Result<Vec<Reading>, RecordingError> {
        self.wait_until_still(stops)?;
        let id = self.settings.link.servo_id;
        self.bus.set_register(id, register::POSITION_P_GAIN, u32::from(gain))?;
        let outcome = self.run(trajectory, stops);
        let off = self.switch_off();
        let readings = outcome?;
        off?;
        Ok(readings)
    }

    /// Gives the servo its mode back.
    ///
    /// # Errors
    /// [`OperationError`] where it does not take it.
    pub fn finish(mut self) -> Result<(), OperationError> {
        self.switch_off()?;
        self.restore()
    }

    fn restore(&mut self) -> Result<(), OperationError> {
        let id = self.settings.link.servo_id;
        for (register, found) in std::mem::take(&mut self.restored) {
            self.bus.set_register(id, register, found)?;
        }
        Ok(())
    }

    fn switch_off(&mut self) -> Result<(), OperationError> {
        let id = self.settings.link.servo_id;
        self.bus.set_torque(id, false)?;
        self.torque_is_on = false;
        self.bus.set_register(id, register::BUS_WATCHDOG, 0)
    }

    fn run(&mut self, trajectory: Trajectory, stops: &mut StopInputs<'_>) -> Result<Vec<Reading>, RecordingError> {
        let id = self.settings.link.servo_id;
        let watchdog = scale::watchdog_counts(self.settings.link.watchdog_ms);
        self.bus.set_register(id, register::BUS_WATCHDOG, u32::from(watchdog))?;
        self.torque_is_on = true;
        self.bus.set_torque(id, true)?;
        let mut readings = Vec::with_capacity((DURATION_S * self.settings.rate_hz) as usize + 1);
        let mut voltage_v = self.supply_v;
        self.follow(
            DURATION_S,
            |time_s| trajectory.at(time_s),
            stops,
            |reading| {
                voltage_v += (reading.input_v - voltage_v) / VOLTAGE_READINGS;
                readings.push(reading);
                voltage_v
            },
        )?;
        if self.torque_is_on {
            let from = readings
                .last()
                .map_or(0.0, |reading| reading.position_rad / self.settings.amplitude_rad);
            let down = |time_s: f64| Goal {
                share: from * (0.5 + 0.5 * (PI * (time_s / LET_DOWN_S).min(1.0)).cos()),
                torque: true,
            };
            self.follow(LET_DOWN_S, down, stops, |reading| reading.input_v)?;
        }
        Ok(readings)
    }

    /// Writes goals and reads back. `note` takes each reading and gives the voltage that counts.
    fn follow(
        &mut self,
        duration_s: f64,
        goal_at: impl Fn(f64) -> Goal,
        stops: &mut StopInputs<'_>,
        mut note: impl FnMut(Reading) -> f64,
    ) -> Result<(), RecordingError> {
        let period = Duration::from_secs_f64(1.0 / self.settings.rate_hz);
        let watchdog = Duration::from_millis(u64::from(self.settings.link.watchdog_ms));
        let began = self.bus.port_mut().now();
        let (mut due, mut last, mut failures) = (began, began, 0);
        loop {
            let now = self.bus.port_mut().now();
            if now < due {
                self.bus.port_mut().pass_time(due - now)?;
            }
            due = due.max(now) + period;
            stops.check_silently().map_err(RecordingError::Stopped)?;
            let before = self.bus.port_mut().now();
            let time_s = (before - began).as_secs_f64();
            if time_s >= duration_s {
                return Ok(());
            }
            if before - last > watchdog {
                return Err(RecordingError::Paused(1e3 * (before - last).as_secs_f64()));
            }
            let goal = goal_at(time_s);
            let outcome = self.tell(goal).and_then(|goal_rad| Ok((goal_rad, self.read()?)));
            last = self.bus.port_mut().now();
            let (goal_rad, read) = match outcome {
                Ok(both) => both,
                Err(RecordingError::Transaction(TransactionError::Silent(_) | TransactionError::Damaged(_)))
                    if failures + 1 < MAX_FAILURES =>
                {
                    failures += 1;
                    continue;
                }
                Err(error) => return Err(error),
            };
            failures = 0;
            let reading = Reading {
                time_s: (before - began + (last - before) / 2).as_secs_f64(),
                goal_rad,
                position_rad: read.position_rad - f64::from(self.hanging_counts) * scale::POSITION_RAD,
                velocity_rad_s: read.velocity_rad_s,
                current_ma: 1e3 * read.current_a,
                input_v: read.voltage_v,
                temperature_c: read.temperature_c,
                torque_enabled: self.torque_is_on,
            };
            self.check(&read, &reading, note(reading))?;
        }
    }

    /// Whether a run may go on.
    fn check(&mut self, read: &ServoReading, reading: &Reading, voltage_v: f64) -> Result<(), RecordingError> {
        let id: DeviceId = self.settings.link.servo_id;
        if read.alert {
            return Err(RecordingError::Hardware(self.bus.hardware_errors(id)?));
        }
        if read.watchdog_latched() {
            return Err(RecordingError::Paused(f64::from(self.settings.link.watchdog_ms)));
        }
        if reading.position_rad.abs() > self.settings.amplitude_rad + BEYOND_RAD {
            let angle_deg = reading.position_rad.to_degrees();
            return Err(RecordingError::Range { angle_deg });
        }
        if reading.temperature_c > self.settings.max_temperature_c {
            return Err(RecordingError::Hot {
                found_c: reading.temperature_c,
                limit_c: self.settings.max_temperature_c,
            });
        }
        if voltage_v < self.settings.min_voltage_v {
            return Err(RecordingError::Weak {
                found_v: voltage_v,
                limit_v: self.settings.min_voltage_v,
            });
        }
        Ok(())
    }

    /// Writes a goal, and switches the torque off where that is the goal. Returns the goal as written, rad.
    fn tell(&mut self, goal: Goal) -> Result<f64, RecordingError> {
        let id = self.settings.link.servo_id;
        let counts = self.counts(goal.share);
        if !goal.torque && self.torque_is_on {
            self.bus.set_torque(id, false)?;
            self.torque_is_on = false;
        }
        let deadline = Instant::now() + REPLY_TIME;
        self.bus
            .write_register(id, register::GOAL_POSITION, counts as u32, deadline)?;
        Ok(f64::from(counts - self.hanging_counts) * scale::POSITION_RAD)
    }

    fn counts(&self, share: f64) -> i32 {
        self.hanging_counts + (share * self.settings.amplitude_rad / scale::POSITION_RAD).round() as i32
    }

    fn read(&mut self) -> Result<ServoReading, RecordingError> {
        let mut block = [0; BLOCK_LEN];
        let deadline = Instant::now() + REPLY_TIME;
        let flags = self
            .bus
            .read(self.settings.link.servo_id, BLOCK_ADDRESS, &mut block, deadline)?;
        Ok(ServoReading::from_block(&block, flags.alert))
    }

    /// Waits until the arm hangs still; returns where.
    fn wait_until_still(&mut self, stops: &mut StopInputs<'_>) -> Result<i32, RecordingError> {
        let id = self.settings.link.servo_id;
        let position =
            |bus: &mut WormBus<P>| Ok::<_, OperationError>(bus.register(id, register::PRESENT_POSITION)? as i32);
        let give_up = self.bus.port_mut().now() + SETTLING;
        let mut from = position(self.bus)?;
        let mut since = self.bus.port_mut().now();
        loop {
            stops.check_silently().map_err(RecordingError::Stopped)?;
            self.bus.port_mut().pass_time(LOOK)?;
            let (at, now) = (position(self.bus)?, self.bus.port_mut().now());
            let moved = at - from;
            if moved.abs() > STILL_COUNTS {
                if now > give_up {
                    let moved_deg = (f64::from(moved) * scale::POSITION_RAD).to_degrees();
                    return Err(RecordingError::NotStill { moved_deg });
                }
                (from, since) = (at, now);
            } else if now - since >= STILL {
                return Ok(at);
            }
        }
    }

    fn check_position_limits(&mut self) -> Result<(), RecordingError> {
        let id = self.settings.link.servo_id;
        let min = self.bus.register(id, register::MIN_POSITION_LIMIT)? as i32;
        let max = self.bus.register(id, register::MAX_POSITION_LIMIT)? as i32;
        let (low, high) = (self.counts(-1.0), self.counts(1.0));
        if low < min || high > max {
            return Err(RecordingError::Limits {
                low,
                high,
                min,
                max,
                hanging: self.hanging_counts,
            });
        }
        Ok(())
    }
}

impl<P: Port> Drop for BenchServo<'_, P> {
    fn drop(&mut self) {
        // Whatever ended it: torque off first. Nobody is left to hear of a failure; the watchdog is set then.
        if self.torque_is_on {
            let _ = self.switch_off();
        }
        if !self.torque_is_on {
            let _ = self.restore();
        }
    }
}
