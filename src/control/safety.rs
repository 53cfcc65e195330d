//! Limits and time-outs: the readings and silences that stop the worm.
//!
//! All times are of the loop's own clock (`loop_clock`): a pause of the computer does not count as silence.

use super::estimator_watch::EstimatorWatch;
use super::loop_clock::seconds_to_ns;
use super::state_assembler::StateAssembler;
use crate::link::ServoReading;
use worm_estimator::config::{Config, Limits};
use worm_estimator::message::Fault;
use worm_estimator::time::seconds;
use worm_estimator::winding::{Reported, Winding};

/// How much faster the time above the current limit is forgotten than it is counted: a motor that is above it for more than four
/// fifths of the time is stopped, and one that is below it in single readings is not excused.
const CURRENT_FORGETTING: f64 = 4.0;

/// Time over which the bus voltage is averaged, s: motor current steps pull it down for milliseconds.
const VOLTAGE_AVERAGING_S: f64 = 0.1;

/// Checks the limits while the motor has torque. The state machine latches the first fault.
#[derive(Debug, Clone)]
pub(super) struct Safety {
    limits: Limits,
    winding: Winding,
    link_timeout_ns: u64,
    /// None where the worm may crawl without positions.
    tracker_timeout_ns: Option<u64>,
    estimator_timeout_ns: u64,
    watchdog_ns: u64,
    require_estimator: bool,
    /// How long the current was above its limit, less what is forgotten, s.
    over_current_s: f64,
    /// When the current was last read.
    current_read_ns: Option<u64>,
    voltage_v: Option<f64>,
}

/// What the limits are checked against in one tick.
pub(super) struct SafetyInputs<'a> {
    pub(super) now_ns: u64,
    pub(super) dt_s: f64,
    pub(super) servo: Option<&'a ServoReading>,
    pub(super) assembler: &'a StateAssembler,
    pub(super) estimator: &'a EstimatorWatch,
    /// How long the computer paused since the servo answered before, ns.
    pub(super) paused_ns: u64,
    /// When torque came on: silences are counted from then at the earliest.
    pub(super) armed_ns: u64,
    /// When crawling began, while the worm crawls.
    pub(super) crawling_since_ns: Option<u64>,
}

impl Safety {
    pub(super) fn new(config: &Config) -> Self {
        Self {
            limits: config.limits.clone(),
            winding: config.winding(),
            link_timeout_ns: seconds_to_ns(config.control.link_timeout_s),
            tracker_timeout_ns: (!config.position_source().may_be_missing())
                .then(|| seconds_to_ns(config.control.tracker_timeout_s)),
            estimator_timeout_ns: seconds_to_ns(config.control.estimator_timeout_s),
            watchdog_ns: u64::from(config.servo.watchdog_ms) * 1_000_000,
            require_estimator: config.control.require_estimator,
            over_current_s: 0.0,
            current_read_ns: None,
            voltage_v: None,
        }
    }

    /// Resets what earlier readings have accumulated: torque was switched on again.
    pub(super) fn rearm(&mut self) {
        self.over_current_s = 0.0;
        self.current_read_ns = None;
        self.voltage_v = None;
    }

    /// The first reason to stop, if any, the most telling one first.
    pub(super) fn check(&mut self, inputs: &SafetyInputs<'_>) -> Option<Fault> {
        if let Some(servo) = inputs.servo
            && let Some(fault) = self.check_servo(servo, inputs)
        {
            return Some(fault);
        }
        let silent_for = |seen_ns: Option<u64>, since_ns: u64| {
            inputs.now_ns.saturating_sub(seen_ns.unwrap_or(since_ns).max(since_ns))
        };
        if silent_for(inputs.assembler.servo_seen_ns, inputs.armed_ns) > self.link_timeout_ns {
            return Some(Fault::LinkLost);
        }
        let since_ns = inputs.crawling_since_ns?;
        let is_stale = |timeout_ns| silent_for(inputs.assembler.sample_seen_ns, since_ns) > timeout_ns;
        if self.tracker_timeout_ns.is_some_and(is_stale) {
            return Some(Fault::TrackerStale);
        }
        let estimator_is_silent = inputs.estimator.silent_ns(inputs.now_ns, since_ns) > self.estimator_timeout_ns;
        (self.require_estimator && estimator_is_silent).then_some(Fault::EstimatorSilent)
    }

    fn check_servo(&mut self, servo: &ServoReading, inputs: &SafetyInputs<'_>) -> Option<Fault> {
        if servo.alert {
            return Some(Fault::ServoHardware);
        }
        if servo.watchdog_latched() {
            // The computer caused the silence if most of it was a pause.
            let by_pause = 2 * inputs.paused_ns >= self.watchdog_ns;
            return Some(if by_pause {
                Fault::HostPaused
            } else {
                Fault::WatchdogTripped
            });
        }
        // The watchdog was set when torque came on; it reads zero after a restart of the servo.
        if servo.watchdog == 0 {
            return Some(Fault::ServoRestarted);
        }
        if servo.temperature_c > self.limits.temperature_c {
            return Some(Fault::OverTemperature);
        }
        let voltage_v = match self.voltage_v {
            None => servo.voltage_v,
            Some(mean_v) => mean_v + (servo.voltage_v - mean_v) * (inputs.dt_s / VOLTAGE_AVERAGING_S).min(1.0),
        };
        self.voltage_v = Some(voltage_v);
        if voltage_v < self.limits.voltage_v {
            return Some(Fault::UnderVoltage);
        }
        let read_ns = self.current_read_ns.replace(inputs.now_ns).unwrap_or(inputs.now_ns);
        let elapsed_s = seconds(inputs.now_ns.saturating_sub(read_ns));
        let current_a = self.winding.current_a(&Reported {
            current_a: servo.current_a,
            bus_voltage_v: servo.voltage_v,
            duty: servo.duty,
            velocity_rad_per_s: servo.velocity_rad_s,
            temperature_c: servo.temperature_c,
        });
        if current_a.abs() <= self.limits.current_a {
            self.over_current_s = (self.over_current_s - CURRENT_FORGETTING * elapsed_s).max(0.0);
            return None;
        }
        self.over_current_s += elapsed_s;
        (self.over_current_s > self.limits.current_time_s).then_some(Fault::OverCurrent)
    }

    /// Whether the cause of `fault` is still present, so that a reset would fail.
    pub(super) fn persists(
        &self,
        fault: Fault,
        now_ns: u64,
        servo: Option<&ServoReading>,
        assembler: &StateAssembler,
    ) -> bool {
        let age_ns = |seen_ns: Option<u64>| seen_ns.map_or(u64::MAX, |seen_ns| now_ns.saturating_sub(seen_ns));
        match fault {
            Fault::OverTemperature => servo.is_none_or(|servo| servo.temperature_c > self.limits.temperature_c),
            Fault::UnderVoltage => servo.is_none_or(|servo| servo.voltage_v < self.limits.voltage_v),
            Fault::TrackerStale => self
                .tracker_timeout_ns
                .is_some_and(|timeout_ns| age_ns(assembler.sample_seen_ns) > timeout_ns),
            // A lost link may need the port to be reopened, which a reset does; the other causes do not last.
            _ => false,
        }
    }
}
