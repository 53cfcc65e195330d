//! What the answer to "why did it stop?" consists of. The JSON names are a contract.

use super::timeline::MomentKind;
use serde::Serialize;
use worm_estimator::time::seconds;

/// What a box was made of: its first event.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Trigger {
    /// When, ns of `CLOCK_MONOTONIC`.
    pub time_ns: u64,
    /// What, as `fault link-lost`.
    pub event: String,
}

/// Why a worm stopped, or what else its log is about.
#[derive(Debug, Clone, Serialize)]
pub struct Explanation {
    /// Name of the worm.
    pub worm: String,
    /// The log.
    pub log: String,
    /// Whether the worm stopped.
    pub stopped: bool,
    /// When, ns of `CLOCK_MONOTONIC`. All times in s count from it; where the worm did not stop, from the reason.
    pub time_ns: u64,
    /// The same by the wall clock, ns since 1970, as far as the log says.
    pub unix_ns: Option<u64>,
    /// Mode before and after; null after it where the controller was gone.
    pub from: Option<&'static str>,
    /// See `from`.
    pub to: Option<&'static str>,
    /// The first reason.
    pub reason: Reason,
    /// Alarms that stood already, the oldest first: early signs of the same trouble, or of another.
    pub signs: Vec<Sign>,
    /// What happened before and after, in the order of time.
    pub events: Vec<Event>,
    /// What to do.
    pub remedy: String,
    /// Which of how many stops of the log this is, from 1; 0 of 0 where there is none.
    pub stop: usize,
    /// See `stop`.
    pub stops: usize,
    /// What `wormd explain` makes of the gait cycles before it.
    pub last_cycles: LastCycles,
    /// What is missing in the log, and other remarks.
    pub warnings: Vec<String>,
}

/// The first reason.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reason {
    /// `alarm`, `fault`, `command`, `driver-silent`, `lease-lapsed`, `time-limit`, `controller-gone`, `unknown` or `none`.
    pub kind: &'static str,
    /// Its name: of the alarm, the fault or the command.
    pub name: String,
    /// When, s from the stop.
    pub time_s: f64,
    /// When its condition began, s from the stop, as far as known.
    pub since_s: Option<f64>,
    /// The cell concerned, from 1.
    pub cell: Option<u32>,
    /// The watched quantity, of an alarm.
    pub value: Option<f64>,
    /// Its threshold.
    pub threshold: Option<f64>,
    /// Who sent it, of a command and of the hold for a silent driver.
    pub sender: Option<String>,
    /// The sender's user id.
    pub user: Option<u32>,
    /// In a sentence.
    pub sentence: String,
}

/// An alarm that stood already.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sign {
    /// The alarm.
    pub alarm: &'static str,
    /// How serious it is.
    pub severity: &'static str,
    /// When it was raised, s from the stop.
    pub time_s: f64,
}

/// Something that happened.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Event {
    /// When, s from the stop.
    pub time_s: f64,
    /// What kind.
    pub kind: MomentKind,
    /// In words.
    pub text: String,
}

/// What `wormd explain` makes of the last gait cycles.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct LastCycles {
    /// Gait cycles that it looked at.
    pub cycles: f64,
    /// Its verdict in a sentence; null where it was not asked, or could not say.
    pub verdict: Option<String>,
    /// More of it.
    pub details: Option<String>,
    /// Why there is none.
    pub why_not: Option<String>,
}

/// From one moment to another, s; negative before it.
pub(super) fn relative_s(time_ns: u64, zero_ns: u64) -> f64 {
    if time_ns < zero_ns {
        -seconds(zero_ns - time_ns)
    } else {
        seconds(time_ns - zero_ns)
    }
}

/// A meaning within a sentence.
pub(super) fn lower_first(text: &str) -> String {
    let mut letters = text.chars();
    match letters.next() {
        Some(first) => first.to_lowercase().collect::<String>() + letters.as_str(),
        None => String::new(),
    }
}
