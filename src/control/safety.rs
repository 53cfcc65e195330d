//! Limits and patience: which readings, or whose silence, stop the worm.
//!
//! Every time here is of the loop's own clock (`presence`): a pause of the computer is nobody's silence.

use super::state_assembler::StateAssembler;
use crate::link::ServoReading;
use worm_estimator::config::{Config, Limits};
use worm_estimator::message::Fault;

/// What the bus watchdog register reads after it has stopped the motor (XL330-M288 e-manual, register 98).
const WATCHDOG_TRIPPED: u8 = 0xFF;

/// Time over which the bus voltage is averaged, s: motor current steps pull it down for milliseconds.
const VOLTAGE_AVERAGING_S: f64 = 0.1;

/// Watches the limits while the motor has torque. It only finds reasons; latching the first is the state machine's work.
#[derive(Debug, Clone)]
pub(super) struct Safety {
    limits: Limits,
    link_timeout_ns: u64,
    tracker_timeout_ns: u64,
    estimator_timeout_ns: u64,
    watchdog_ns: u64,
    require_estimator: bool,
    over_current_since_ns: Option<u64>,
    voltage_v: Option<f64>,
}

/// What the limits are held against in one tick.
pub(super) struct Watched<'a> {
    pub(super) now_ns: u64,
    pub(super) dt_s: f64,
    pub(super) servo: Option<&'a ServoReading>,
    pub(super) assembler: &'a StateAssembler,
    pub(super) estimate_seen_ns: Option<u64>,
    /// How long the computer paused since the servo answered before, ns.
    pub(super) paused_ns: u64,
    /// When torque came on: silences are counted from then at the earliest.
    pub(super) armed_ns: u64,
    /// When crawling began, while the worm crawls.
    pub(super) crawling_since_ns: Option<u64>,
}

fn seconds_to_ns(seconds: f64) -> u64 {
    (seconds * 1e9) as u64
}

impl Safety {
    pub(super) fn new(config: &Config) -> Self {
        Self {
            limits: config.limits.clone(),
            link_timeout_ns: seconds_to_ns(config.control.link_timeout_s),
            tracker_timeout_ns: seconds_to_ns(config.control.tracker_timeout_s),
            estimator_timeout_ns: seconds_to_ns(config.control.estimator_timeout_s),
            watchdog_ns: u64::from(config.servo.watchdog_ms) * 1_000_000,
            require_estimator: config.control.require_estimator,
            over_current_since_ns: None,
            voltage_v: None,
        }
    }

    /// Forgets what earlier readings have built up: torque comes on anew.
    pub(super) fn rearm(&mut self) {
        self.over_current_since_ns = None;
        self.voltage_v = None;
    }

    /// The first reason to stop, if any, the most telling one first.
    pub(super) fn check(&mut self, watched: &Watched<'_>) -> Option<Fault> {
        if let Some(servo) = watched.servo
            && let Some(fault) = self.check_servo(servo, watched)
        {
            return Some(fault);
        }
        let silent_for = |seen_ns: Option<u64>, since_ns: u64| {
            watched.now_ns.saturating_sub(seen_ns.unwrap_or(since_ns).max(since_ns))
        };
        if silent_for(watched.assembler.servo_seen_ns, watched.armed_ns) > self.link_timeout_ns {
            return Some(Fault::LinkLost);
        }
        let since_ns = watched.crawling_since_ns?;
        if silent_for(watched.assembler.sample_seen_ns, since_ns) > self.tracker_timeout_ns {
            return Some(Fault::TrackerStale);
        }
        let estimator_is_silent = silent_for(watched.estimate_seen_ns, since_ns) > self.estimator_timeout_ns;
        (self.require_estimator && estimator_is_silent).then_some(Fault::EstimatorSilent)
    }

    fn check_servo(&mut self, servo: &ServoReading, watched: &Watched<'_>) -> Option<Fault> {
        if servo.alert {
            return Some(Fault::ServoHardware);
        }
        if servo.watchdog == WATCHDOG_TRIPPED {
            // The silence that tripped it was the computer's own where most of it was a pause.
            let by_pause = 2 * watched.paused_ns >= self.watchdog_ns;
            return Some(if by_pause {
                Fault::HostPaused
            } else {
                Fault::WatchdogTripped
            });
        }
        // The watchdog was set when torque came on; zero is what a servo reads that has started anew since.
        if servo.watchdog == 0 {
            return Some(Fault::ServoRestarted);
        }
        if servo.temperature_c > self.limits.temperature_c {
            return Some(Fault::OverTemperature);
        }
        let voltage_v = match self.voltage_v {
            None => servo.voltage_v,
            Some(mean_v) => mean_v + (servo.voltage_v - mean_v) * (watched.dt_s / VOLTAGE_AVERAGING_S).min(1.0),
        };
        self.voltage_v = Some(voltage_v);
        if voltage_v < self.limits.voltage_v {
            return Some(Fault::UnderVoltage);
        }
        if servo.current_a.abs() <= self.limits.current_a {
            self.over_current_since_ns = None;
            return None;
        }
        let since_ns = *self.over_current_since_ns.get_or_insert(watched.now_ns);
        let too_long = watched.now_ns.saturating_sub(since_ns) > seconds_to_ns(self.limits.current_time_s);
        too_long.then_some(Fault::OverCurrent)
    }

    /// Whether `fault`'s cause is still there, so that a reset would be in vain.
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
            Fault::TrackerStale => age_ns(assembler.sample_seen_ns) > self.tracker_timeout_ns,
            // A lost link may need the port to be opened again, which is what a reset does; the rest is past by nature.
            _ => false,
        }
    }
}
