//! A worm as a watcher knows it: what its relay has sent.

use super::recent::Recent;
use crate::relay::History;
use crate::relay::message_json::Json;
use crate::relay::wire::{Ages, Driver, Event, Frame, Hello, Network, Statistics, Subject};
use worm_estimator::message::{
    Alarm, CommandRecord, Cycle, Estimate, Inferred, Range, RecordingStatus, State, Timing, TripStatus,
};

/// Gait cycles that are kept: an hour and a half of the usual gait, 1.5 MB.
const MAX_CYCLES: usize = 2048;
/// Changes of alarms, commands, and events, that are kept.
const MAX_CHANGES: usize = 1024;

/// So long after the last sample, ns, positions are not measured any more.
const POSITIONS_LAST_NS: u64 = 1_000_000_000;

/// What was seen of a worm, in bounded memory.
#[derive(Debug, Clone)]
pub(crate) struct Picture {
    /// What does not change.
    pub(crate) subject: Subject,
    /// When the newest frame was made, ns of `CLOCK_MONOTONIC`.
    pub(crate) time_ns: u64,
    /// How old the newest messages were then.
    pub(crate) ages: Ages,
    pub(crate) state: Option<State>,
    pub(crate) estimate: Option<Estimate>,
    pub(crate) timing: Option<Timing>,
    pub(crate) statistics: Option<Statistics>,
    pub(crate) recording: Option<RecordingStatus>,
    pub(crate) range: Option<Range>,
    pub(crate) trip: Option<TripStatus>,
    pub(crate) inferred: Option<Inferred>,
    pub(crate) raised: Vec<Alarm>,
    pub(crate) cycles: Recent<Cycle>,
    pub(crate) alarms: Recent<Alarm>,
    pub(crate) commands: Recent<CommandRecord>,
    pub(crate) events: Recent<Event>,
    pub(crate) history: History,
    pub(crate) driver: Option<Driver>,
    pub(crate) watchers: usize,
    /// The network between the worm and here, if there is one.
    pub(crate) network: Option<Network>,
}

impl Picture {
    /// A worm of which nothing was seen yet.
    pub(crate) fn new(subject: Subject) -> Self {
        Self {
            subject,
            time_ns: 0,
            ages: Ages::default(),
            state: None,
            estimate: None,
            timing: None,
            statistics: None,
            recording: None,
            range: None,
            trip: None,
            inferred: None,
            raised: Vec::new(),
            cycles: Recent::with_limit(MAX_CYCLES),
            alarms: Recent::with_limit(MAX_CHANGES),
            commands: Recent::with_limit(MAX_CHANGES),
            events: Recent::with_limit(MAX_CHANGES),
            history: History::default(),
            driver: None,
            watchers: 0,
            network: None,
        }
    }

    /// Takes what a relay says first. What was seen before it began stays.
    pub(crate) fn take_hello(&mut self, hello: Hello) {
        self.subject = hello.worm;
        self.time_ns = hello.time_ns;
        self.history.merge(&hello.samples);
        merge(
            &mut self.cycles,
            hello.cycles.into_iter().map(|Json(cycle)| cycle),
            |cycle| cycle.end_ns,
        );
        merge(
            &mut self.alarms,
            hello.alarms.into_iter().map(|Json(alarm)| alarm),
            |alarm| alarm.time_ns,
        );
        merge(
            &mut self.commands,
            hello.commands.into_iter().map(|Json(record)| record),
            |record| record.time_ns,
        );
        merge(&mut self.events, hello.events.into_iter(), |event| event.time_ns);
    }

    /// Takes a frame.
    pub(crate) fn take_frame(&mut self, frame: Frame) {
        self.time_ns = frame.time_ns;
        self.ages = frame.age_ms;
        self.state = frame.state.map(|Json(state)| state);
        self.estimate = frame.estimate.map(|Json(estimate)| estimate);
        self.timing = frame.timing.map(|Json(timing)| timing);
        self.statistics = frame.statistics;
        self.recording = frame.recording.map(|Json(status)| status);
        self.range = frame.range.map(|Json(range)| range);
        self.trip = frame.trip.map(|Json(trip)| trip);
        self.inferred = frame.inferred.map(|Json(inferred)| inferred);
        self.raised = frame.raised.into_iter().map(|Json(alarm)| alarm).collect();
        frame.cycles.into_iter().for_each(|Json(cycle)| self.cycles.push(cycle));
        frame.alarms.into_iter().for_each(|Json(alarm)| self.alarms.push(alarm));
        let commands = frame.commands.into_iter();
        commands.for_each(|Json(record)| self.commands.push(record));
        frame.events.into_iter().for_each(|event| self.events.push(event));
        self.driver = frame.driver;
        self.watchers = frame.watchers;
        self.network = frame.network;
        if let (Some(state), Some(estimate)) = (&self.state, &self.estimate) {
            self.history.take(state, estimate);
        }
    }

    /// Whether positions are measured at present, as far as was seen. An estimate is repeated while no sample comes, so it may be old.
    pub(crate) fn has_positions(&self) -> bool {
        self.estimate.is_some_and(|estimate| {
            let is_known = estimate.position_m.iter().any(|position_m| position_m.is_finite());
            let now_ns = self.state.map_or(0, |state| state.time_ns);
            is_known && now_ns.saturating_sub(estimate.time_ns) < POSITIONS_LAST_NS
        })
    }

    /// The phase of the newest state, cycles.
    pub(crate) fn phase(&self) -> f64 {
        self.state.map_or(f64::NAN, |state| state.phase)
    }

    /// Ticks that the controller ran.
    pub(crate) fn ticks(&self) -> u64 {
        self.state.map_or(0, |state| state.sequence + 1)
    }
}

/// Appends what somebody else knows; own values of the same time give way.
fn merge<T: Clone>(own: &mut Recent<T>, others: impl Iterator<Item = T>, time_ns: impl Fn(&T) -> u64) {
    let mut others = others.peekable();
    let Some(first_ns) = others.peek().map(&time_ns) else {
        return;
    };
    let older: Vec<T> = own.iter().filter(|value| time_ns(value) < first_ns).cloned().collect();
    own.clear();
    older.into_iter().chain(others).for_each(|value| own.push(value));
}
