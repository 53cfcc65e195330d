//! The messages of one worm, gathered.

use super::recent::Recent;
use crate::latency::TickStats;
use worm_estimator::message::{
    Alarm, AlarmKind, CommandRecord, Cycle, Estimate, Inferred, Range, RecordingStatus, State, Timing, TripStatus,
};

/// How many cycles are kept: nearly two days of the usual gait, 45 MB.
const MAX_CYCLES: usize = 1 << 16;

/// How many ranges are kept: those of the newest cycles, 3 MB.
const MAX_RANGES: usize = 1 << 14;

/// How many changes of alarms are kept, 0.6 MB.
const MAX_ALARMS: usize = 1 << 13;

/// How many commands are kept, 30 kB.
const MAX_COMMANDS: usize = 256;

/// What was received so far, in bounded memory: of cycles and alarms the newest.
#[derive(Debug, Clone)]
pub struct Telemetry {
    /// The first state that was received.
    pub first_state: Option<State>,
    /// The newest state.
    pub state: Option<State>,
    /// The newest estimate.
    pub estimate: Option<Estimate>,
    /// The newest timing.
    pub timing: Option<Timing>,
    /// The newest report of a recorder.
    pub recording: Option<RecordingStatus>,
    /// How the newest trip stands, or stood at its end.
    pub trip: Option<TripStatus>,
    /// What the motor's current alone says; none where self-sensing is off.
    pub inferred: Option<Inferred>,
    /// The newest cycles.
    pub cycles: Recent<Cycle>,
    /// How far the battery lasts, after the newest cycles; empty without a battery.
    pub ranges: Recent<Range>,
    /// The newest changes of alarms.
    pub alarms: Recent<Alarm>,
    /// The newest commands, but for those that only prolonged a crawl.
    pub commands: Recent<CommandRecord>,
    /// Where the ticks' time went, and what made late ones late.
    pub tick_stats: TickStats,
    /// The newest change of each alarm, by its code.
    newest_changes: [Option<Alarm>; AlarmKind::ALL.len()],
}

impl Default for Telemetry {
    fn default() -> Self {
        Self::with_limits(MAX_CYCLES, MAX_ALARMS)
    }
}

impl Telemetry {
    /// Nothing yet; will keep so many cycles and changes of alarms.
    pub fn with_limits(cycles: usize, alarms: usize) -> Self {
        Self {
            first_state: None,
            state: None,
            estimate: None,
            timing: None,
            recording: None,
            trip: None,
            inferred: None,
            cycles: Recent::with_limit(cycles),
            ranges: Recent::with_limit(cycles.min(MAX_RANGES)),
            alarms: Recent::with_limit(alarms),
            commands: Recent::with_limit(MAX_COMMANDS),
            tick_stats: TickStats::default(),
            newest_changes: [None; AlarmKind::ALL.len()],
        }
    }

    /// Takes a state.
    pub fn take_state(&mut self, state: &State) {
        self.first_state.get_or_insert(*state);
        self.state = Some(*state);
    }

    /// Takes a timing.
    pub fn take_timing(&mut self, timing: &Timing) {
        self.tick_stats.take(timing);
        self.timing = Some(*timing);
    }

    /// Takes an estimate.
    pub fn take_estimate(&mut self, estimate: &Estimate) {
        self.estimate = Some(*estimate);
    }

    /// Takes a finished cycle.
    pub fn take_cycle(&mut self, cycle: &Cycle) {
        self.cycles.push(*cycle);
    }

    /// Takes how far the battery lasts.
    pub fn take_range(&mut self, range: &Range) {
        self.ranges.push(*range);
    }

    /// Takes an alarm change.
    pub fn take_alarm(&mut self, alarm: &Alarm) {
        if let Some(newest) = self.newest_changes.get_mut(alarm.kind as usize) {
            *newest = Some(*alarm);
        }
        self.alarms.push(*alarm);
    }

    /// Takes a command that the controller answered.
    pub fn take_command(&mut self, record: &CommandRecord) {
        if !record.is_mere_renewal() {
            self.commands.push(*record);
        }
    }

    /// Takes a recorder's report.
    pub fn take_recording(&mut self, status: &RecordingStatus) {
        self.recording = Some(*status);
    }

    /// Takes how a trip stands.
    pub fn take_trip(&mut self, trip: &TripStatus) {
        self.trip = Some(*trip);
    }

    /// Takes what the motor's current alone says.
    pub fn take_inferred(&mut self, inferred: &Inferred) {
        self.inferred = Some(*inferred);
    }

    /// Ticks that the controller ran.
    pub fn ticks(&self) -> u64 {
        self.state.map_or(0, |state| state.sequence + 1)
    }

    /// Alarms that are raised now, by the newest change of each. One that a newer estimate does not know as raised is not: the
    /// estimator that raised it has been restarted.
    pub fn raised(&self) -> Vec<Alarm> {
        let is_forgotten = |alarm: &Alarm| {
            self.estimate.is_some_and(|estimate| {
                estimate.time_ns > alarm.time_ns && estimate.raised_mask >> (alarm.kind & 31) & 1 == 0
            })
        };
        let newest = self.newest_changes.iter().flatten();
        newest
            .filter(|alarm| alarm.raised != 0 && !is_forgotten(alarm))
            .copied()
            .collect()
    }
}
