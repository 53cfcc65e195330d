//! A few ticks a second, and everything that changes: for logs and viewers that need no more. Pure.

use super::recorded_topics::Batch;
use worm_estimator::message::State;

/// Picks what is kept.
#[derive(Debug)]
pub(crate) struct Thinner {
    interval_ns: u64,
    state: Option<State>,
    /// When a state, a timing and an estimate were kept last, ns.
    state_ns: u64,
    timing_ns: u64,
    estimate_ns: u64,
}

impl Thinner {
    /// Keeps this many a second.
    pub(crate) fn new(rate_hz: f64) -> Self {
        Self {
            interval_ns: (1e9 / rate_hz) as u64,
            state: None,
            state_ns: 0,
            timing_ns: 0,
            estimate_ns: 0,
        }
    }

    /// The part of a batch that is kept: ticks and estimates at the rate, ticks of a pause of the computer or a new rate, and of the
    /// rest all.
    pub(crate) fn thin(&mut self, batch: &Batch) -> Batch {
        let interval_ns = self.interval_ns;
        let is_due = |last_ns: &mut u64, now_ns: u64| {
            // A clock that goes back is that of another start.
            let is_due = now_ns < *last_ns || now_ns - *last_ns >= interval_ns;
            if is_due {
                *last_ns = now_ns;
            }
            is_due
        };
        let mut states = Vec::new();
        for state in &batch.states {
            let has_changed = self.state.replace(*state).is_none_or(|last| differs(&last, state));
            if is_due(&mut self.state_ns, state.time_ns) || has_changed {
                states.push(*state);
            }
        }
        let timings = batch.timings.iter().filter(|timing| {
            let is_due = is_due(&mut self.timing_ns, timing.deadline_ns);
            is_due || timing.host_paused_ns > 0
        });
        Batch {
            states,
            timings: timings.copied().collect(),
            estimates: batch
                .estimates
                .iter()
                .filter(|estimate| is_due(&mut self.estimate_ns, estimate.time_ns))
                .copied()
                .collect(),
            cycles: batch.cycles.clone(),
            alarms: batch.alarms.clone(),
            ranges: batch.ranges.clone(),
            commands: batch.commands.clone(),
            trips: batch.trips.clone(),
            inferred: batch.inferred.clone(),
        }
    }
}

/// Whether anything has happened between two ticks.
fn differs(last: &State, state: &State) -> bool {
    let events = |state: &State| {
        [
            state.mode,
            state.fault,
            state.fault_alarm,
            state.hold_reason,
            state.hardware_error,
            state.emergency_stop,
            state.acknowledged_mask,
        ]
    };
    state.sequence < last.sequence || events(last) != events(state)
}

#[cfg(test)]
mod tests {
    use super::*;
    use worm_estimator::message::Mode;

    #[test]
    fn ten_ticks_a_second_and_every_change() {
        let mut thinner = Thinner::new(10.0);
        let tick = |sequence: u64, mode: Mode| State {
            sequence,
            time_ns: 1 + sequence * 1_000_000,
            mode: mode.code(),
            ..State::unknown(4)
        };
        let mut kept = Vec::new();
        for sequence in 0..1000 {
            let mode = if sequence < 555 { Mode::Crawling } else { Mode::Fault };
            let batch = Batch {
                states: vec![tick(sequence, mode)],
                ..Batch::default()
            };
            kept.extend(thinner.thin(&batch).states.iter().map(|state| state.sequence));
        }
        assert_eq!(kept, [0, 100, 200, 300, 400, 500, 555, 600, 700, 800, 900]);
    }
}
