//! The topics of a worm, gathered into frames.

use super::history::History;
use super::message_json::Json;
use super::wire::{Ages, Driver, Event, Frame, Hello, Statistics, Subject, VERSION};
use crate::failure::Failure;
use crate::latency::TickStats;
use crate::supervisor::telemetry_receiver::TelemetryReceiver;
use crate::topics::Hub;
use crate::watch::{Recent, Telemetry};
use worm_estimator::config::Config;
use worm_estimator::message::JsonMessage;

/// Gait cycles that are kept: ten minutes of the usual gait, 0.2 MB.
const MAX_CYCLES: usize = 240;
/// Changes of alarms that are kept, 20 kB.
const MAX_ALARMS: usize = 256;
/// Events that are kept, some 50 kB.
const MAX_EVENTS: usize = 256;
/// How often the percentiles are computed anew, ns: that takes longer than a frame should.
const STATISTICS_INTERVAL_NS: u64 = 1_000_000_000;

/// What there was of a worm when a watcher got its last frame: the next one has the rest.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Seen {
    pub(crate) cycles: u64,
    pub(crate) alarms: u64,
    pub(crate) commands: u64,
    pub(crate) events: u64,
}

/// The worm as the relay knows it.
pub(super) struct Source {
    receiver: TelemetryReceiver,
    pub(super) worm: Worm,
}

impl Source {
    /// Subscribes to all topics. `text` is that of the configuration, for watchers that record.
    pub(super) fn open(hub: &Hub, config: &Config, text: Option<String>) -> Result<Self, Failure> {
        Ok(Self {
            receiver: TelemetryReceiver::open(hub)?,
            worm: Worm {
                config: text,
                ..Worm::new(Subject::of(config))
            },
        })
    }

    /// Reads everything new.
    pub(super) fn poll(&mut self, now_ns: u64) {
        self.receiver.poll(&mut self.worm.telemetry);
        self.worm.update(now_ns);
    }
}

/// A worm's telemetry and history, without the topics.
pub(crate) struct Worm {
    subject: Subject,
    /// The configuration's text.
    config: Option<String>,
    boot_id: String,
    pub(crate) telemetry: Telemetry,
    history: History,
    events: Recent<Event>,
    statistics: Option<Statistics>,
    statistics_due_ns: u64,
}

impl Worm {
    pub(crate) fn new(subject: Subject) -> Self {
        let boot_id = std::fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default();
        Self {
            subject,
            config: None,
            boot_id: boot_id.trim().to_owned(),
            telemetry: Telemetry::with_limits(MAX_CYCLES, MAX_ALARMS),
            history: History::default(),
            events: Recent::with_limit(MAX_EVENTS),
            statistics: None,
            statistics_due_ns: 0,
        }
    }

    /// Keeps what the newest messages say.
    pub(crate) fn update(&mut self, now_ns: u64) {
        if let (Some(state), Some(estimate)) = (&self.telemetry.state, &self.telemetry.estimate) {
            self.history.take(state, estimate);
        }
        if now_ns >= self.statistics_due_ns {
            self.statistics_due_ns = now_ns.saturating_add(STATISTICS_INTERVAL_NS);
            self.statistics = Statistics::of(&self.telemetry.tick_stats);
        }
    }

    /// Notes an event.
    pub(crate) fn note(&mut self, time_ns: u64, text: String) {
        self.events.push(Event { time_ns, text });
    }

    /// What there is now.
    pub(crate) fn seen(&self) -> Seen {
        Seen {
            cycles: self.telemetry.cycles.total(),
            alarms: self.telemetry.alarms.total(),
            commands: self.telemetry.commands.total(),
            events: self.events.total(),
        }
    }

    /// The first line for a watcher.
    pub(crate) fn hello(&self, now_ns: u64) -> Hello {
        Hello {
            version: VERSION,
            wormd: env!("CARGO_PKG_VERSION").to_owned(),
            pid: std::process::id(),
            boot_id: self.boot_id.clone(),
            time_ns: now_ns,
            robot: None,
            worm: self.subject.clone(),
            config: self.config.clone(),
            samples: self.history.samples(),
            cycles: self.telemetry.cycles.iter().copied().map(Json).collect(),
            alarms: self.telemetry.alarms.iter().copied().map(Json).collect(),
            commands: self.telemetry.commands.iter().copied().map(Json).collect(),
            events: self.events.iter().cloned().collect(),
        }
    }

    /// The newest of everything, and what came since `seen`.
    pub(crate) fn frame(&self, number: u64, now_ns: u64, seen: Seen, watchers: usize, driver: Option<Driver>) -> Frame {
        let telemetry = &self.telemetry;
        Frame {
            number,
            time_ns: now_ns,
            watchers,
            age_ms: Ages {
                state: age_ms(telemetry.state, now_ns),
                estimate: age_ms(telemetry.estimate, now_ns),
                timing: age_ms(telemetry.timing, now_ns),
                recording: age_ms(telemetry.recording, now_ns),
                trip: age_ms(telemetry.trip, now_ns),
            },
            state: telemetry.state.map(Json),
            estimate: telemetry.estimate.map(Json),
            timing: telemetry.timing.map(Json),
            statistics: self.statistics,
            recording: telemetry.recording.map(Json),
            range: telemetry.ranges.last().copied().map(Json),
            trip: telemetry.trip.map(Json),
            inferred: telemetry.inferred.map(Json),
            raised: telemetry.raised().into_iter().map(Json).collect(),
            cycles: telemetry.cycles.since(seen.cycles).copied().map(Json).collect(),
            alarms: telemetry.alarms.since(seen.alarms).copied().map(Json).collect(),
            commands: telemetry.commands.since(seen.commands).copied().map(Json).collect(),
            events: self.events.since(seen.events).cloned().collect(),
            driver,
            network: None,
        }
    }
}

/// How long ago a message was made, by the clock that its maker used, ms. None for an estimate before the first state.
fn age_ms(message: Option<impl JsonMessage>, now_ns: u64) -> Option<u64> {
    let made_ns = message?.made_ns();
    (made_ns != 0).then(|| now_ns.saturating_sub(made_ns) / 1_000_000)
}

impl Statistics {
    fn of(stats: &TickStats) -> Option<Self> {
        Some(Self {
            wake_us: stats.wake.measured()?,
            bus_us: stats.bus.measured()?,
            compute_us: stats.compute.measured()?,
            host_pauses: stats.host_pauses.count,
            host_paused_s: stats.host_pauses.total_s,
        })
    }
}
