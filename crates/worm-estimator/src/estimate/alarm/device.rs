//! Device fault: the servo reports a hardware error, heat or low voltage, or the controller stopped because of one.
//!
//! A hardware error bit or a controller fault about the servo raises the alarm at once; value is then the error register
//! (or the fault's code) and threshold 0. Otherwise value and threshold are the temperature, °C: the servo reads it in
//! steps of one degree, so it must be 3 °C below the threshold before it counts as cool.

use super::cam_motion::Tick;
use super::latch::{DetectorOutput, Reading, ReadingState};
use crate::config::Config;
use crate::message::{Fault, Severity, State};

/// How far below the threshold the servo must cool, °C.
const COOL_C: f64 = 3.0;
/// How long the servo must read hot, s: a heat that comes and goes in less is a misreading.
const HOT_S: f64 = 0.5;

#[derive(Debug, Clone)]
pub(super) struct DeviceFault {
    threshold_c: f64,
    limit_c: f64,
    hot_s: f64,
    since_ns: u64,
}

impl DeviceFault {
    pub(super) fn new(config: &Config) -> Self {
        Self {
            threshold_c: config.alarms.device_fault.threshold,
            limit_c: config.limits.temperature_c,
            hot_s: 0.0,
            since_ns: 0,
        }
    }

    pub(super) fn update(&mut self, tick: &Tick, state: &State) -> DetectorOutput {
        let stopped_by = Fault::try_from(state.fault).ok().filter(|fault| {
            matches!(
                fault,
                Fault::OverCurrent
                    | Fault::OverTemperature
                    | Fault::UnderVoltage
                    | Fault::ServoHardware
                    | Fault::WatchdogTripped
                    | Fault::ServoRestarted
            )
        });
        let celsius = state.motor_temperature_c;
        let (value, threshold, verdict, severity) = if state.hardware_error != 0 {
            (
                f64::from(state.hardware_error),
                0.0,
                ReadingState::Bad,
                Severity::Critical,
            )
        } else if let Some(fault) = stopped_by {
            (f64::from(fault.code()), 0.0, ReadingState::Bad, Severity::Critical)
        } else if celsius.is_finite() {
            self.hot_s = if celsius > self.threshold_c {
                self.hot_s + tick.step_s
            } else {
                0.0
            };
            let verdict = if self.hot_s > HOT_S {
                ReadingState::Bad
            } else if celsius < self.threshold_c - COOL_C {
                ReadingState::Good
            } else {
                ReadingState::Between
            };
            let severity = if celsius > self.limit_c {
                Severity::Critical
            } else {
                Severity::Warning
            };
            (celsius, self.threshold_c, verdict, severity)
        } else {
            return DetectorOutput::Unknown;
        };
        if verdict != ReadingState::Bad && self.hot_s == 0.0 {
            self.since_ns = tick.now_ns;
        }
        DetectorOutput::Measured(Reading {
            value,
            threshold,
            verdict,
            since_ns: self.since_ns,
            cell: None,
            severity,
        })
    }
}
