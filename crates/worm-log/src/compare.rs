//! Whether the estimator had the same results live and on the recording.

use super::log::Log;
use super::recorder_alarm;
use super::replay::{Replay, fresh, same};
use serde::Serialize;
use std::collections::HashMap;
use std::hash::Hash;
use worm_estimator::message::{Estimate, JsonMessage, State};

/// A log compared with its replay. Its field names are a contract of the JSON output.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// States in the log.
    pub states: usize,
    /// Recorded estimates that were compared, without heartbeats.
    pub estimates_compared: usize,
    /// Those that are identical in every field, to the last bit.
    pub estimates_identical: usize,
    /// Recorded cycles that were compared.
    pub cycles_compared: usize,
    /// Those that are identical.
    pub cycles_identical: usize,
    /// Recorded changes of alarms that were compared.
    pub alarms_compared: usize,
    /// Those that are identical.
    pub alarms_identical: usize,
    /// Recorded ranges that were compared.
    pub ranges_compared: usize,
    /// Those that are identical.
    pub ranges_identical: usize,
    /// Recorded messages of self-sensing that were compared.
    pub inferred_compared: usize,
    /// Those that are identical.
    pub inferred_identical: usize,
    /// The log has every state since the estimator's first, and every result.
    pub complete: bool,
    /// What is missing, and other remarks.
    pub warnings: Vec<String>,
}

impl Comparison {
    /// Whether everything that was compared is identical.
    pub fn is_identical(&self) -> bool {
        self.estimates_compared == self.estimates_identical
            && self.cycles_compared == self.cycles_identical
            && self.alarms_compared == self.alarms_identical
            && self.ranges_compared == self.ranges_identical
            && self.inferred_compared == self.inferred_identical
    }
}

/// Compares the contents of a log with its replay. The alarm `recording-stopped` is left out: it does not follow from the states.
pub fn compare(log: &Log, replay: &Replay) -> Comparison {
    let fed = log.states.get(replay.first..).unwrap_or_default();
    let span = Span {
        first_ns: fed.first().map_or(0, |state| state.time_ns),
        last_ns: fed.last().map_or(0, |state| state.time_ns),
        // The log has no results after its last estimate.
        last_estimate_ns: log.estimates.iter().map(|estimate| estimate.time_ns).max().unwrap_or(0),
    };
    let recorded = fresh(&log.estimates).map(recorder_alarm::without);
    let estimates = span.agreement("estimates", recorded, &replay.estimates, |estimate| {
        (estimate.state_sequence, estimate.time_ns)
    });
    let cycles = span.agreement("cycles", log.cycles.iter().copied(), &replay.cycles, |cycle| {
        (cycle.index, cycle.end_ns)
    });
    let recorded = recorder_alarm::others(&log.alarms);
    let alarms = span.agreement("alarms", recorded, &replay.alarms, |alarm| {
        (alarm.sequence, alarm.time_ns)
    });
    // Logs of older versions have none, and miss nothing.
    let replayed: &[_] = if log.ranges.is_empty() { &[] } else { &replay.ranges };
    let ranges = span.agreement("ranges", log.ranges.iter().copied(), replayed, |range| {
        (range.index, range.end_ns)
    });
    let replayed: &[_] = if log.inferred.is_empty() { &[] } else { &replay.inferred };
    let inferred = span.agreement(
        "messages of self-sensing",
        log.inferred.iter().copied(),
        replayed,
        |inferred| (inferred.sequence, inferred.time_ns),
    );

    let mut gaps = Vec::new();
    if !replay.first_is_known {
        gaps.push(if log.estimates.is_empty() {
            "there are no estimates in the log".to_owned()
        } else {
            "the log begins after the estimator, whose sums are therefore others".to_owned()
        });
    }
    let lost = lost_states(fed);
    if lost > 0 {
        gaps.push(format!("{lost} states are not in the log"));
    }
    let lost_live = log
        .estimates
        .iter()
        .map(|estimate| estimate.states_lost)
        .max()
        .unwrap_or(0);
    if lost_live > lost {
        gaps.push(format!("the estimator had not received {lost_live} states"));
    }
    if let Some(time_ns) = restart_ns(&log.estimates) {
        let time_s = time_ns as f64 * 1e-9;
        gaps.push(format!(
            "the estimator was started anew at t = {time_s:.3} s, and its replay was not"
        ));
    }
    let agreements = [estimates, cycles, alarms, ranges, inferred];
    gaps.extend(agreements.iter().flat_map(|agreement| agreement.gap.clone()));
    let complete = gaps.is_empty();
    let [estimates, cycles, alarms, ranges, inferred] = agreements;
    Comparison {
        states: log.states.len(),
        estimates_compared: estimates.compared,
        estimates_identical: estimates.identical,
        cycles_compared: cycles.compared,
        cycles_identical: cycles.identical,
        alarms_compared: alarms.compared,
        alarms_identical: alarms.identical,
        ranges_compared: ranges.compared,
        ranges_identical: ranges.identical,
        inferred_compared: inferred.compared,
        inferred_identical: inferred.identical,
        complete,
        warnings: log.warnings.iter().cloned().chain(gaps).collect(),
    }
}

/// Ticks that are missing between the states. A number that goes back is a restart of the controller.
fn lost_states(states: &[State]) -> u64 {
    let pairs = states.windows(2);
    pairs
        .map(|pair| pair[1].sequence.saturating_sub(pair[0].sequence + 1))
        .sum()
}

/// When the estimator restarted, if it did: its energy otherwise never falls by that much.
fn restart_ns(estimates: &[Estimate]) -> Option<u64> {
    let mut pairs = estimates.windows(2);
    let restart = pairs.find(|pair| pair[1].energy_electrical_j < 0.5 * pair[0].energy_electrical_j)?;
    Some(restart[1].time_ns)
}

/// The time span for which the log has both states and results, ns.
struct Span {
    first_ns: u64,
    last_ns: u64,
    last_estimate_ns: u64,
}

struct Agreement {
    compared: usize,
    identical: usize,
    gap: Option<String>,
}

impl Span {
    fn agreement<T: JsonMessage, K: Eq + Hash>(
        &self,
        what: &str,
        recorded: impl Iterator<Item = T>,
        replayed: &[T],
        key: impl Fn(&T) -> K,
    ) -> Agreement {
        let known: HashMap<K, &T> = replayed.iter().map(|message| (key(message), message)).collect();
        let (mut compared, mut identical) = (0, 0);
        // History that a recorder received when it joined is older than the states; the end of a truncated log can be newer.
        for message in recorded.filter(|message| (self.first_ns..=self.last_ns).contains(&message.made_ns())) {
            compared += 1;
            identical += usize::from(known.get(&key(&message)).is_some_and(|ours| same(*ours, &message)));
        }
        let expected = replayed
            .iter()
            .filter(|message| message.made_ns() <= self.last_estimate_ns)
            .count();
        let missing = expected.saturating_sub(compared);
        let gap = (missing > 0).then(|| format!("{missing} {what} came out that are not in the log"));
        Agreement {
            compared,
            identical,
            gap,
        }
    }
}
