//! The messages of one worm, gathered.

use crate::latency::TickStats;
use worm_estimator::message::{Alarm, AlarmKind, Cycle, Estimate, State, Timing};

/// Everything received so far.
#[derive(Debug, Clone, Default)]
pub struct Telemetry {
    /// The first state that was received.
    pub first_state: Option<State>,
    /// The newest state.
    pub state: Option<State>,
    /// The newest estimate.
    pub estimate: Option<Estimate>,
    /// The newest timing.
    pub timing: Option<Timing>,
    /// All cycles.
    pub cycles: Vec<Cycle>,
    /// All alarm changes.
    pub alarms: Vec<Alarm>,
    /// Where the ticks' time went, and what made late ones late.
    pub tick_stats: TickStats,
}

impl Telemetry {
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

    /// Takes an alarm change.
    pub fn take_alarm(&mut self, alarm: &Alarm) {
        self.alarms.push(*alarm);
    }

    /// Ticks that the controller ran.
    pub fn ticks(&self) -> u64 {
        self.state.map_or(0, |state| state.sequence + 1)
    }

    /// Alarms that are raised now, by the newest change of each.
    pub fn raised(&self) -> Vec<Alarm> {
        AlarmKind::ALL
            .iter()
            .filter_map(|kind| self.alarms.iter().rev().find(|alarm| alarm.kind == kind.code()))
            .filter(|alarm| alarm.raised != 0)
            .copied()
            .collect()
    }
}
