//! The messages of one worm, gathered.

use crate::message::{Alarm, AlarmKind, Culprit, Cycle, Estimate, State, Timing};
use hdrhistogram::Histogram;

/// Longest time that the histograms tell apart, ns: a second. What takes longer counts as a second.
const LONGEST_NS: u64 = 1_000_000_000;

/// Everything that a watcher has heard so far.
#[derive(Debug, Clone)]
pub struct Telemetry {
    /// The first state that was heard.
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
    /// Wake lateness, bus exchange, computation and publishing of every tick heard, ns.
    pub durations: Durations,
    /// Ticks that ended late, by culprit code.
    pub culprits: [u64; Culprit::ALL.len()],
}

/// Histograms of where the ticks' time went.
#[derive(Debug, Clone)]
pub struct Durations {
    /// Wake lateness, ns.
    pub wake: Histogram<u64>,
    /// Bus exchange, ns.
    pub bus: Histogram<u64>,
    /// Computation, ns.
    pub compute: Histogram<u64>,
    /// Publishing, ns.
    pub publish: Histogram<u64>,
}

impl Durations {
    fn new() -> Self {
        // Two significant digits up to a second: a few tens of kilobytes each. The bounds are constants, and valid.
        let empty = Histogram::new_with_max(LONGEST_NS, 2).unwrap_or_else(|error| unreachable!("{error}"));
        Self {
            wake: empty.clone(),
            bus: empty.clone(),
            compute: empty.clone(),
            publish: empty,
        }
    }

    fn record(&mut self, timing: &Timing) {
        self.wake.saturating_record(timing.wake_lateness_ns);
        self.bus.saturating_record(timing.bus_ns);
        self.compute.saturating_record(timing.compute_ns);
        self.publish.saturating_record(timing.publish_ns);
    }
}

impl Default for Telemetry {
    fn default() -> Self {
        Self {
            first_state: None,
            state: None,
            estimate: None,
            timing: None,
            cycles: Vec::new(),
            alarms: Vec::new(),
            durations: Durations::new(),
            culprits: [0; Culprit::ALL.len()],
        }
    }
}

impl Telemetry {
    /// Takes a state.
    pub fn take_state(&mut self, state: &State) {
        self.first_state.get_or_insert(*state);
        self.state = Some(*state);
    }

    /// Takes a timing.
    pub fn take_timing(&mut self, timing: &Timing) {
        self.durations.record(timing);
        if timing.overrun != 0
            && let Some(count) = self.culprits.get_mut(timing.culprit as usize)
        {
            *count += 1;
        }
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
