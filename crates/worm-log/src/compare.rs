//! Whether the estimator came to the same results live and on the recording.

use super::log::Log;
use super::replay::{Replay, fresh, same};
use serde::Serialize;
use std::collections::HashMap;
use std::hash::Hash;
use worm_estimator::message::{Estimate, JsonMessage, State};

/// A log against its replay. As JSON, its names are a contract.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// States in the log.
    pub states: usize,
    /// Recorded estimates that were looked for in the replay, heartbeats not counted.
    pub estimates_compared: usize,
    /// Those that came out the same in every field, to the last bit.
    pub estimates_identical: usize,
    /// Recorded cycles that were looked for.
    pub cycles_compared: usize,
    /// Those that came out the same.
    pub cycles_identical: usize,
    /// Recorded changes of alarms that were looked for.
    pub alarms_compared: usize,
    /// Those that came out the same.
    pub alarms_identical: usize,
    /// The log has every state from the estimator's first on, and all that the estimator made of them.
    pub complete: bool,
    /// What is not complete, and what else is remarkable.
    pub warnings: Vec<String>,
}

impl Comparison {
    /// Whether all that was compared is the same.
    pub fn is_identical(&self) -> bool {
        (self.estimates_compared, self.cycles_compared, self.alarms_compared)
            == (self.estimates_identical, self.cycles_identical, self.alarms_identical)
    }
}

/// Compares what a log holds with what came out of its replay.
pub fn compare(log: &Log, replay: &Replay) -> Comparison {
    let fed = log.states.get(replay.first..).unwrap_or_default();
    let span = Span {
        first_ns: fed.first().map_or(0, |state| state.time_ns),
        last_ns: fed.last().map_or(0, |state| state.time_ns),
        // What the estimator said after the log's last estimate, the log does not know.
        heard_ns: log.estimates.iter().map(|estimate| estimate.time_ns).max().unwrap_or(0),
    };
    let estimates = span.tally("estimates", fresh(&log.estimates), &replay.estimates, |estimate| {
        (estimate.state_sequence, estimate.time_ns)
    });
    let cycles = span.tally("cycles", log.cycles.iter(), &replay.cycles, |cycle| {
        (cycle.index, cycle.end_ns)
    });
    let alarms = span.tally("alarms", log.alarms.iter(), &replay.alarms, |alarm| {
        (alarm.sequence, alarm.time_ns)
    });

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
    let tallies = [estimates, cycles, alarms];
    gaps.extend(tallies.iter().flat_map(|tally| tally.gap.clone()));
    let complete = gaps.is_empty();
    let [estimates, cycles, alarms] = tallies;
    Comparison {
        states: log.states.len(),
        estimates_compared: estimates.compared,
        estimates_identical: estimates.identical,
        cycles_compared: cycles.compared,
        cycles_identical: cycles.identical,
        alarms_compared: alarms.compared,
        alarms_identical: alarms.identical,
        complete,
        warnings: log.warnings.iter().cloned().chain(gaps).collect(),
    }
}

/// Ticks that are missing between the states; a number that goes back is a controller that was started anew.
fn lost_states(states: &[State]) -> u64 {
    let pairs = states.windows(2);
    pairs
        .map(|pair| pair[1].sequence.saturating_sub(pair[0].sequence + 1))
        .sum()
}

/// When the estimator began its sums anew, if it did: energy never falls back so far by itself.
fn restart_ns(estimates: &[Estimate]) -> Option<u64> {
    let mut pairs = estimates.windows(2);
    let restart = pairs.find(|pair| pair[1].energy_electrical_j < 0.5 * pair[0].energy_electrical_j)?;
    Some(restart[1].time_ns)
}

/// The time of which the log knows both the states and what the estimator made of them, ns.
struct Span {
    first_ns: u64,
    last_ns: u64,
    heard_ns: u64,
}

struct Tally {
    compared: usize,
    identical: usize,
    gap: Option<String>,
}

impl Span {
    fn tally<'a, T: JsonMessage + 'a, K: Eq + Hash>(
        &self,
        what: &str,
        recorded: impl Iterator<Item = &'a T>,
        replayed: &[T],
        key: impl Fn(&T) -> K,
    ) -> Tally {
        let known: HashMap<K, &T> = replayed.iter().map(|message| (key(message), message)).collect();
        let (mut compared, mut identical) = (0, 0);
        // History that a late recorder was given is older than the states; the end of a cut-off log can be newer.
        for message in recorded.filter(|message| (self.first_ns..=self.last_ns).contains(&message.made_ns())) {
            compared += 1;
            identical += usize::from(known.get(&key(message)).is_some_and(|ours| same(*ours, message)));
        }
        let expected = replayed
            .iter()
            .filter(|message| message.made_ns() <= self.heard_ns)
            .count();
        let missing = expected.saturating_sub(compared);
        let gap = (missing > 0).then(|| format!("{missing} {what} came out that are not in the log"));
        Tally {
            compared,
            identical,
            gap,
        }
    }
}
