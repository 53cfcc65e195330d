//! What the page about all worms is told of each, and what became of a hold.

use super::unreached::Unreached;
use crate::relay::message_json::Json;
use crate::relay::wire::{Ages, Frame, Network};
use serde::Serialize;
use std::time::Instant;
use worm_estimator::message::{Alarm, AlarmKind, Fault, Mode, Range, Severity};

/// How one worm stands.
#[derive(Debug, Clone, Serialize)]
pub(super) struct WormView {
    name: String,
    /// The robot, where it is a worm of another computer.
    robot: Option<String>,
    mode: Option<String>,
    fault: Option<String>,
    /// Alarms that are raised; none where nobody serves the worm's watchers.
    raised: Option<Vec<RaisedAlarm>>,
    /// How old what is said here is, ms, by this computer's clock since it came.
    age_ms: Option<u64>,
    estimate_age_ms: Option<u64>,
    driver: Option<String>,
    range: Option<Json<Range>>,
    /// What is between here and the worm; none for a worm of this computer.
    network: Option<Network>,
    /// Why there is nothing newer.
    problem: Option<String>,
}

impl WormView {
    /// Nothing is known of the worm but this.
    pub(super) fn unknown(name: &str, robot: Option<&str>, problem: Option<&str>) -> Self {
        Self {
            name: name.to_owned(),
            robot: robot.map(str::to_owned),
            mode: None,
            fault: None,
            raised: None,
            age_ms: None,
            estimate_age_ms: None,
            driver: None,
            range: None,
            network: None,
            problem: problem.map(str::to_owned),
        }
    }

    pub(super) fn not_reached(it: &Unreached) -> Self {
        Self::unknown(&it.name, Some(&it.robot), Some(&it.problem))
    }

    /// Takes what a relay said, and when that came.
    pub(super) fn take_frame(&mut self, frame: &Frame, came: Instant) {
        let more_ms = elapsed_ms(came);
        let Ages { state, estimate, .. } = frame.age_ms;
        let now = |age: Option<u64>| age.map(|ms| ms.saturating_add(more_ms));
        self.age_ms = now(state);
        self.estimate_age_ms = now(estimate);
        if let Some(Json(state)) = &frame.state {
            self.mode = Mode::try_from(state.mode).ok().map(|mode| mode.name().to_owned());
            self.fault = Fault::try_from(state.fault).ok().map(|fault| fault.name().to_owned());
        }
        let acknowledged_mask = frame.state.as_ref().map_or(0, |Json(state)| state.acknowledged_mask);
        let raised = frame.raised.iter();
        self.raised = Some(
            raised
                .filter_map(|Json(alarm)| RaisedAlarm::of(alarm, acknowledged_mask))
                .collect(),
        );
        self.driver = frame.driver.as_ref().map(|driver| driver.name.clone());
        self.range = frame.range;
        self.network.clone_from(&frame.network);
    }

    /// Takes what a controller said, and when.
    pub(super) fn take_answer(&mut self, mode: Mode, fault: Fault, asked: Instant) {
        self.mode = Some(mode.name().to_owned());
        self.fault = Some(fault.name().to_owned());
        self.age_ms = Some(elapsed_ms(asked));
    }
}

/// An alarm.
#[derive(Debug, Clone, Serialize)]
struct RaisedAlarm {
    name: &'static str,
    is_critical: bool,
    is_acknowledged: bool,
}

/// What became of the hold of one worm.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Held {
    pub(super) name: String,
    /// The robot of a worm that cannot be reached.
    pub(super) robot: Option<String>,
    /// The verdict; `no-answer` where there was none.
    verdict: String,
    refusal: Option<String>,
}

impl Held {
    pub(super) fn new(name: &str, verdict: &str, refusal: Option<String>) -> Self {
        Self {
            name: name.to_owned(),
            robot: None,
            verdict: verdict.to_owned(),
            refusal,
        }
    }

    /// Nobody could be told.
    pub(super) fn not_reached(it: &Unreached) -> Self {
        Self {
            name: it.name.clone(),
            robot: Some(it.robot.clone()),
            verdict: "no-answer".to_owned(),
            refusal: Some(it.problem.clone()),
        }
    }

    /// Whether the worm has answered: then it holds, or has no torque.
    pub(super) fn is_answered(&self) -> bool {
        !matches!(self.verdict.as_str(), "no-answer" | "busy")
    }
}

impl RaisedAlarm {
    fn of(alarm: &Alarm, acknowledged_mask: u32) -> Option<Self> {
        let kind = AlarmKind::try_from(alarm.kind).ok()?;
        Some(Self {
            name: kind.name(),
            is_critical: alarm.severity == Severity::Critical.code(),
            is_acknowledged: acknowledged_mask >> kind.code() & 1 == 1,
        })
    }
}

fn elapsed_ms(since: Instant) -> u64 {
    since.elapsed().as_millis().try_into().unwrap_or(u64::MAX)
}
