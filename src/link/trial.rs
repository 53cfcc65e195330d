//! Trials that turn the cam a little: does the servo's watchdog stop the motor, and does the motor do what it is told?
//!
//! Both switch torque on, turn the cam slowly, and switch torque off whatever happens: a signal to the process, a pressed emergency
//! stop and a hardware error end them early.

use super::arm::{ArmError, arm};
use super::operations::REPLY_TIME;
use super::servo::{self, ServoReading, register, scale};
use super::{
    ExchangeOutcome, ExchangePlan, LinkSettings, OperationError, Port, Prepared, StartupError, StopInputs,
    TrackerReading, TransactionError, WormBus,
};
use std::f64::consts::TAU;
use std::time::{Duration, Instant};

/// Speed of the trials, rad/s: 6 rev/min.
const SPEED_RAD_S: f64 = 0.1 * TAU;
/// Angle of the motion trial there and back, rad.
const ANGLE_RAD: f64 = TAU / 16.0;
/// Interval of the exchanges.
const INTERVAL: Duration = Duration::from_millis(5);
/// How long the cam may take to turn as far as at [`SPEED_RAD_S`] in a third of the time.
const MOTION_TIME: Duration = Duration::from_secs(2);
/// Time over which the speed is measured before the silence.
const RUN_UP_RAD: f64 = 0.15;
/// Silence beyond the watchdog's time.
const MARGIN: Duration = Duration::from_millis(300);
/// How long a motor is watched that should stand.
const WATCHED: Duration = Duration::from_millis(80);
/// Angle by which a standing cam may seem to move, rad.
const STANDS_WITHIN_RAD: f64 = 4.0 * scale::POSITION_RAD;
/// Share of the usual duty that the motion trial may use.
const DUTY_SHARE: f64 = 0.6;

/// Why a trial could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TrialError {
    /// Torque did not come on.
    #[error(transparent)]
    Arm(#[from] ArmError),
    /// The cam did not turn.
    #[error("the cam did not turn: it moved by {moved_deg:.1} degrees in {MOTION_TIME:?}; is it blocked?")]
    NoMotion {
        /// How far it turned, degrees, in the direction that was asked for.
        moved_deg: f64,
    },
    /// The watchdog acted while the trial was still talking to the servo.
    #[error("the computer paused, and the watchdog acted before the trial began: try again")]
    Paused,
    /// A signal asked the process to end.
    #[error("ended by a signal to this process")]
    Signal,
    /// The emergency stop is pressed, or was not read for its time.
    #[error("the emergency stop is pressed, or cannot be read: release it, or look at its cable, and try again")]
    EmergencyStop,
    /// The servo's answer has its alert bit.
    #[error(
        "the servo reports a hardware error: `wormd check` says which one; remove the cause, then reboot the servo"
    )]
    Alert,
    /// A register could not be read or set.
    #[error(transparent)]
    Operation(#[from] OperationError),
    /// The servo could not be read.
    #[error(transparent)]
    Transaction(#[from] TransactionError),
}

impl From<StartupError> for TrialError {
    fn from(error: StartupError) -> Self {
        Self::Arm(error.into())
    }
}

/// What the silence did to a turning motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WatchdogTrial {
    /// The watchdog says that it has acted.
    pub latched: bool,
    /// The motor stands.
    pub stopped: bool,
    /// How long it turned on after the last packet, s, to about 5 ms; of a motor that did not stop, the silence so far.
    pub turned_for_s: f64,
    /// What the watchdog was set to, s.
    pub watchdog_s: f64,
}

impl WatchdogTrial {
    /// The watchdog stopped the motor, and in time.
    #[must_use]
    pub fn is_passed(&self) -> bool {
        const LATE_S: f64 = 0.06;
        self.latched && self.stopped && self.turned_for_s <= self.watchdog_s + LATE_S
    }
}

/// What a small turn there and back brought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionTrial {
    /// How far the servo's position turned there, rad, positive in the direction of the goal.
    pub there_rad: f64,
    /// How far it turned back, rad, likewise.
    pub back_rad: f64,
    /// Position at which it began, rad.
    pub began_rad: f64,
    /// Greatest current, A.
    pub greatest_a: f64,
    /// Displacement there of the cell that moved most, m, positive forward along the canal; nothing when no cell was seen at both ends.
    pub cell_moved_m: Option<f64>,
}

impl<P: Port> WormBus<P> {
    /// Turns the cam slowly, falls silent, and measures what the bus watchdog does.
    ///
    /// # Errors
    /// [`TrialError`]; torque is off, as far as it can be switched off.
    pub fn try_watchdog(
        &mut self,
        settings: &LinkSettings,
        stops: &mut StopInputs<'_>,
    ) -> Result<WatchdogTrial, TrialError> {
        let outcome = self.watchdog_trial(settings, stops);
        self.end_trial(settings, outcome)
    }

    /// Turns the cam a little in the direction of `sign` and back, with little torque.
    ///
    /// # Errors
    /// [`TrialError`]; torque is off, as far as it can be switched off.
    pub fn try_motion(
        &mut self,
        settings: &LinkSettings,
        sign: f64,
        stops: &mut StopInputs<'_>,
    ) -> Result<MotionTrial, TrialError> {
        let outcome = self.motion_trial(settings, sign, stops);
        self.end_trial(settings, outcome)
    }

    /// Torque off first, and then the watchdog as before.
    fn end_trial<T>(&mut self, settings: &LinkSettings, outcome: Result<T, TrialError>) -> Result<T, TrialError> {
        self.set_torque(settings.servo_id, false)?;
        self.rearm_watchdog(settings.servo_id, settings.watchdog_ms)?;
        outcome
    }

    /// Switches torque on, unless something already asks for an end; the cam does not turn yet.
    fn arm_for_trial(&mut self, settings: &LinkSettings, stops: &mut StopInputs<'_>) -> Result<Prepared, TrialError> {
        stops.begin()?;
        let prepared = arm(self, settings, &mut Vec::new())?;
        self.attended_exchange(&prepared.plan, 0.0, stops)?;
        Ok(prepared)
    }

    fn watchdog_trial(
        &mut self,
        settings: &LinkSettings,
        stops: &mut StopInputs<'_>,
    ) -> Result<WatchdogTrial, TrialError> {
        let plan = self.arm_for_trial(settings, stops)?.plan;
        let mut turn = Turn::new(SPEED_RAD_S);
        self.turn_on(&plan, &mut turn, RUN_UP_RAD, stops)?; // until it turns steadily
        let begun = turn.last(self, settings)?;
        self.turn_on(&plan, &mut turn, 2.0 * RUN_UP_RAD, stops)?;
        let last = self.read_servo(settings)?;
        if last.watchdog_latched() {
            return Err(TrialError::Paused);
        }
        let speed_rad_s = (last.position_rad - begun.position_rad) / elapsed_s(&begun, &last);
        stops.wait(Duration::from_millis(u64::from(settings.watchdog_ms)) + MARGIN)?;
        let after = self.read_servo(settings)?;
        stops.wait(WATCHED)?;
        let later = self.read_servo(settings)?;
        let stopped = (later.position_rad - after.position_rad).abs() < STANDS_WITHIN_RAD;
        let turned_rad = after.position_rad - last.position_rad;
        Ok(WatchdogTrial {
            latched: after.watchdog_latched(),
            stopped,
            turned_for_s: if stopped {
                turned_rad / speed_rad_s
            } else {
                elapsed_s(&last, &later)
            },
            watchdog_s: f64::from(settings.watchdog_ms) * 1e-3,
        })
    }

    fn motion_trial(
        &mut self,
        settings: &LinkSettings,
        sign: f64,
        stops: &mut StopInputs<'_>,
    ) -> Result<MotionTrial, TrialError> {
        let prepared = self.arm_for_trial(settings, stops)?;
        let plan = prepared.plan;
        let duty_counts = (DUTY_SHARE * prepared.duty_limit / scale::DUTY).max(1.0) as u32;
        self.set_register(settings.servo_id, register::GOAL_PWM, duty_counts)?;
        let mut there = Turn::new(SPEED_RAD_S * sign);
        self.turn_on(&plan, &mut there, ANGLE_RAD, stops)?;
        let rest = self.rest(&plan, stops)?;
        let mut back = Turn::new(-SPEED_RAD_S * sign);
        self.turn_on(&plan, &mut back, ANGLE_RAD, stops)?;
        let _stands = self.rest(&plan, stops)?;
        let cells = prepared.tracker.map(|tracker| tracker.reading);
        Ok(MotionTrial {
            there_rad: there.moved_rad(),
            back_rad: back.moved_rad(),
            began_rad: prepared.servo_reading.position_rad,
            greatest_a: there.greatest_a.max(back.greatest_a),
            cell_moved_m: cells
                .zip(rest)
                .and_then(|(cells, rest)| greatest_displacement_m(&cells, &rest)),
        })
    }

    /// Turns on until the cam has turned by `angle_rad` since the turn began.
    fn turn_on(
        &mut self,
        plan: &ExchangePlan,
        turn: &mut Turn,
        angle_rad: f64,
        stops: &mut StopInputs<'_>,
    ) -> Result<(), TrialError> {
        let deadline = Instant::now() + MOTION_TIME;
        while turn.moved_rad() < angle_rad {
            let outcome = self.attended_exchange(plan, turn.goal_rad_s, stops)?;
            if let Ok(servo) = outcome.servo {
                turn.take(servo);
            }
            if Instant::now() > deadline {
                let moved_deg = turn.moved_rad().to_degrees();
                return Err(TrialError::NoMotion { moved_deg });
            }
            std::thread::sleep(INTERVAL);
        }
        Ok(())
    }

    /// Brings the cam to rest; where the cells are then.
    fn rest(&mut self, plan: &ExchangePlan, stops: &mut StopInputs<'_>) -> Result<Option<TrackerReading>, TrialError> {
        let deadline = Instant::now() + WATCHED;
        let mut seen = None;
        while Instant::now() < deadline {
            let outcome = self.attended_exchange(plan, 0.0, stops)?;
            seen = outcome.tracker.ok().or(seen);
            std::thread::sleep(INTERVAL);
        }
        Ok(seen)
    }

    /// An exchange that ends the trial where something asks for it.
    fn attended_exchange(
        &mut self,
        plan: &ExchangePlan,
        goal_rad_s: f64,
        stops: &mut StopInputs<'_>,
    ) -> Result<ExchangeOutcome, TrialError> {
        let outcome = self.exchange(plan, goal_rad_s, Instant::now() + REPLY_TIME);
        stops.check(&outcome)?;
        match outcome.servo {
            Ok(servo) if servo.alert => Err(TrialError::Alert),
            _ => Ok(outcome),
        }
    }

    /// Reads the servo and changes nothing, not even the goal.
    fn read_servo(&mut self, settings: &LinkSettings) -> Result<ServoReading, TrialError> {
        let mut block = [0; servo::BLOCK_LEN];
        let servo_id = settings.servo_id;
        let flags = self.ask_again(|bus, deadline| bus.read(servo_id, servo::BLOCK_ADDRESS, &mut block, deadline))?;
        match ServoReading::from_block(&block, flags.alert) {
            ServoReading { alert: true, .. } => Err(TrialError::Alert),
            reading => Ok(reading),
        }
    }
}

/// A turn of the cam under way.
struct Turn {
    goal_rad_s: f64,
    first: Option<ServoReading>,
    last: Option<ServoReading>,
    greatest_a: f64,
}

impl Turn {
    const fn new(goal_rad_s: f64) -> Self {
        Self {
            goal_rad_s,
            first: None,
            last: None,
            greatest_a: 0.0,
        }
    }

    fn take(&mut self, servo: ServoReading) {
        self.first.get_or_insert(servo);
        self.last = Some(servo);
        self.greatest_a = self.greatest_a.max(servo.current_a.abs());
    }

    /// How far the cam has turned, positive in the direction of the goal.
    fn moved_rad(&self) -> f64 {
        let ends = self.first.zip(self.last);
        ends.map_or(0.0, |(first, last)| {
            (last.position_rad - first.position_rad) * self.goal_rad_s.signum()
        })
    }

    /// The newest reading, or one that is taken now.
    fn last<P: Port>(&self, bus: &mut WormBus<P>, settings: &LinkSettings) -> Result<ServoReading, TrialError> {
        self.last.map_or_else(|| bus.read_servo(settings), Ok)
    }
}

/// Time between two readings by the servo's own clock, s.
fn elapsed_s(from: &ServoReading, to: &ServoReading) -> f64 {
    const WRAPS_AT_MS: u16 = 32_768;
    let ms = (to.realtime_tick_ms + WRAPS_AT_MS - from.realtime_tick_ms) % WRAPS_AT_MS;
    f64::from(ms).max(1.0) * 1e-3
}

/// Displacement of the cell that moved most, of those that were seen in both readings.
fn greatest_displacement_m(from: &TrackerReading, to: &TrackerReading) -> Option<f64> {
    let seen = from.valid & to.valid;
    let displacements = from.positions_m.iter().zip(to.positions_m).enumerate();
    displacements
        .filter(|(cell, _)| seen >> cell & 1 != 0)
        .map(|(_, (from_m, to_m))| to_m - from_m)
        .max_by(|a, b| a.abs().total_cmp(&b.abs()))
}
