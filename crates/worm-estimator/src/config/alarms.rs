//! The threshold of each alarm, and the controller's reaction to it.

use super::check::Checker;
use crate::message::AlarmKind;
use serde::Deserialize;

/// What the controller does when an alarm is raised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Policy {
    /// Goes on, and reports the alarm.
    Warn,
    /// Keeps the cam where it is.
    Hold,
    /// Goes back by `control.back_off_cycles`, then holds.
    BackOff,
    /// Stops and latches a fault.
    Stop,
}

/// One alarm.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AlarmConfig {
    /// What the controller does.
    pub policy: Policy,
    /// The threshold; [`Alarms`] gives its meaning and unit for each alarm.
    pub threshold: f64,
}

/// All alarms.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Alarms {
    /// The cam lags behind its command by more than this fraction of a turn.
    pub motor_stall: AlarmConfig,
    /// A cell's extension in its step falls short by more than this fraction of its usual stroke.
    pub jammed_cell: AlarmConfig,
    /// The advance of a cycle falls below this fraction of the usual one.
    pub no_progress: AlarmConfig,
    /// The worm moves down the canal by more than this distance beyond its usual retraction, m.
    pub sliding_down: AlarmConfig,
    /// Rise of the energy per cycle that is worth an alarm, as a fraction of the usual energy.
    pub energy_over_budget: AlarmConfig,
    /// Ratio of the energy left to the energy needed for the way home, below which the battery counts as low.
    pub battery_low: AlarmConfig,
    /// Fraction of failed exchanges over half a second.
    pub link_fault: AlarmConfig,
    /// Fraction of missed samples, or of samples in which a cell was not seen, over two seconds.
    pub tracker_fault: AlarmConfig,
    /// Servo temperature, °C; hardware errors raise this alarm at once.
    pub device_fault: AlarmConfig,
    /// Displacement in a quarter of a step, or in a whole cycle, that the model does not explain, m.
    pub model_mismatch: AlarmConfig,
    /// Silence of a recorder, s; one that says that it stopped raises this alarm at once.
    pub recording_stopped: AlarmConfig,
    /// Share of a cell's friction that is lost, by the motor's current.
    pub friction_loss: AlarmConfig,
    /// Share of a cell's usual torque late in its step, by the motor's current, below which it counts as jammed.
    pub inferred_jam: AlarmConfig,
    /// Rise of the cam's load, by the motor's current, as a pull on the body, N.
    pub more_load: AlarmConfig,
}

const fn alarm(policy: Policy, threshold: f64) -> AlarmConfig {
    AlarmConfig { policy, threshold }
}

impl Default for Alarms {
    fn default() -> Self {
        Self {
            motor_stall: alarm(Policy::Stop, 0.01),
            jammed_cell: alarm(Policy::Stop, 0.4),
            no_progress: alarm(Policy::Hold, 0.3),
            sliding_down: alarm(Policy::Hold, 0.003),
            energy_over_budget: alarm(Policy::Warn, 0.2),
            battery_low: alarm(Policy::Warn, 1.0),
            link_fault: alarm(Policy::Warn, 0.2),
            tracker_fault: alarm(Policy::Warn, 0.3),
            device_fault: alarm(Policy::Warn, 60.0),
            model_mismatch: alarm(Policy::Warn, 1.6e-4),
            recording_stopped: alarm(Policy::Warn, 5.0),
            friction_loss: alarm(Policy::Warn, 0.25),
            inferred_jam: alarm(Policy::Warn, 0.12),
            more_load: alarm(Policy::Warn, 2.0),
        }
    }
}

impl Alarms {
    /// The configuration of one alarm.
    pub fn of(&self, kind: AlarmKind) -> AlarmConfig {
        match kind {
            AlarmKind::MotorStall => self.motor_stall,
            AlarmKind::JammedCell => self.jammed_cell,
            AlarmKind::NoProgress => self.no_progress,
            AlarmKind::SlidingDown => self.sliding_down,
            AlarmKind::EnergyOverBudget => self.energy_over_budget,
            AlarmKind::BatteryLow => self.battery_low,
            AlarmKind::LinkFault => self.link_fault,
            AlarmKind::TrackerFault => self.tracker_fault,
            AlarmKind::DeviceFault => self.device_fault,
            AlarmKind::ModelMismatch => self.model_mismatch,
            AlarmKind::RecordingStopped => self.recording_stopped,
            AlarmKind::FrictionLoss => self.friction_loss,
            AlarmKind::InferredJam => self.inferred_jam,
            AlarmKind::MoreLoad => self.more_load,
        }
    }

    pub(super) fn check(&self, checker: &mut Checker) {
        for (kind, range, unit) in [
            (AlarmKind::MotorStall, 0.002..=0.25, "turns"),
            (AlarmKind::JammedCell, 0.1..=0.95, "of the stroke"),
            (AlarmKind::NoProgress, 0.0..=0.9, "of the usual advance"),
            (AlarmKind::SlidingDown, 1e-4..=1.0, "m"),
            (AlarmKind::EnergyOverBudget, 0.02..=10.0, "of the usual energy"),
            (AlarmKind::BatteryLow, 0.1..=10.0, "times the way home"),
            (AlarmKind::LinkFault, 0.001..=1.0, "of the exchanges"),
            (AlarmKind::TrackerFault, 0.001..=1.0, "of the samples"),
            (AlarmKind::DeviceFault, 20.0..=120.0, "°C"),
            (AlarmKind::ModelMismatch, 1e-5..=1.0, "m"),
            (AlarmKind::RecordingStopped, 3.0..=600.0, "s"),
            (AlarmKind::FrictionLoss, 0.16..=0.95, "of the friction"),
            (AlarmKind::InferredJam, 0.01..=0.12, "of the usual torque"),
            (AlarmKind::MoreLoad, 0.3..=100.0, "N"),
        ] {
            let key = format!("alarms.{}.threshold", kind.name().replace('-', "_"));
            checker.range(&key, self.of(kind).threshold, range, unit);
        }
    }
}
