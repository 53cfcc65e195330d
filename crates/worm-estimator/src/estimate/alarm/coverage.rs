//! What each alarm can watch on a worm with these sensors: so that nobody relies on an alarm that cannot speak.

use crate::config::{Config, PositionSource};
use crate::estimate::prediction::Predictor;
use crate::message::AlarmKind;

/// How far an alarm watches what it is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coverage {
    /// As it is described.
    Full,
    /// Only in part: by what.
    Partial(&'static str),
    /// Not at all: why.
    Off(&'static str),
}

impl Coverage {
    /// What an alarm watches on the configured worm. While the worm runs, [`AlarmMonitor::armed_mask`](super::AlarmMonitor::armed_mask)
    /// says which of them are armed at the moment.
    pub fn of(kind: AlarmKind, config: &Config) -> Self {
        let has_positions = config.position_source() != PositionSource::Nothing;
        match kind {
            AlarmKind::FrictionLoss | AlarmKind::InferredJam | AlarmKind::MoreLoad if !config.self_sensing.enabled => {
                Self::Off("`self_sensing.enabled` is false")
            }
            AlarmKind::BatteryLow if config.battery.is_none() => Self::Off("no [battery] is configured"),
            AlarmKind::BatteryLow if !has_positions => Self::Partial("by the reserve: how far it is home is not known"),
            AlarmKind::ModelMismatch if has_positions && has_more_effects_than_the_exact_motion(config) => Self::Off(
                "an [[effect]] of the configuration is beyond the exact motion, with which this alarm compares",
            ),
            _ if has_positions => Self::Full,
            AlarmKind::JammedCell => {
                Self::Off("it needs cell positions; `inferred-jam` watches by the motor's current")
            }
            AlarmKind::NoProgress | AlarmKind::SlidingDown | AlarmKind::ModelMismatch => {
                Self::Off("it needs cell positions; `friction-loss` and `more-load` watch by the motor's current")
            }
            AlarmKind::TrackerFault => Self::Off("there is no tracker"),
            AlarmKind::EnergyOverBudget => Self::Partial("by the electrical energy alone"),
            _ => Self::Full,
        }
    }

    /// As a word: `full`, `partial` or `off`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Partial(_) => "partial",
            Self::Off(_) => "off",
        }
    }

    /// By what it watches, or why it does not; none where there is nothing to say.
    pub const fn reason(self) -> Option<&'static str> {
        match self {
            Self::Full => None,
            Self::Partial(reason) | Self::Off(reason) => Some(reason),
        }
    }
}

fn has_more_effects_than_the_exact_motion(config: &Config) -> bool {
    Predictor::new(config).is_ok_and(|predictor| predictor.exact_worm().is_none())
}
