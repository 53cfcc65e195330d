//! Feeding a log's states to the estimator again.

use super::log::Log;
use worm_estimator::config::Config;
use worm_estimator::estimate::{EstimatorError, Observer};
use worm_estimator::message::{Alarm, Cycle, Estimate, JsonMessage, State};

/// So many recorded estimates must be reproduced to identify the estimator's first state.
const FIRST_ESTIMATES: usize = 20;

/// The estimator's results on a log's states.
#[derive(Debug, Clone)]
pub struct Replay {
    /// Index of the first state that the estimator got.
    pub first: usize,
    /// Whether that is the first state of the recorded estimator.
    pub first_is_known: bool,
    /// One for each new sample.
    pub estimates: Vec<Estimate>,
    /// The gait cycles that ended.
    pub cycles: Vec<Cycle>,
    /// Alarms raised and cleared.
    pub alarms: Vec<Alarm>,
}

/// Feeds a log's states to the estimator, in their order.
///
/// An estimator that was started after the controller has not seen the first states. Its sums depend on where it started, and no
/// message says where. So every start that the first recorded estimate allows is tried, and the one that reproduces the first
/// estimates is used; if there is none, the first state.
///
/// # Errors
/// [`EstimatorError`] for a configuration that is not valid, or is of a worm with another number of cells.
pub fn replay(log: &Log, config: &Config) -> Result<Replay, EstimatorError> {
    let recorded: Vec<_> = fresh(&log.estimates).take(FIRST_ESTIMATES).copied().collect();
    for first in possible_starts(&log.states, recorded.first()) {
        let mut found = run(&log.states[first..], config, recorded.len())?;
        let is_same = found.estimates.len() == recorded.len()
            && found
                .estimates
                .iter()
                .zip(&recorded)
                .all(|(ours, theirs)| same(ours, theirs));
        if is_same {
            found = run(&log.states[first..], config, usize::MAX)?;
            (found.first, found.first_is_known) = (first, true);
            return Ok(found);
        }
    }
    run(&log.states, config, usize::MAX)
}

/// Indices of the states at which an estimator with this first estimate can have started.
fn possible_starts(states: &[State], first_estimate: Option<&Estimate>) -> std::ops::Range<usize> {
    let Some(estimate) = first_estimate else { return 0..0 };
    let Some(last) = states.iter().position(|state| is_of(estimate, state)) else {
        return 0..0;
    };
    // An earlier state with a sample would have given an earlier estimate.
    let sample_before = states[..last]
        .iter()
        .rposition(|state| state.sample_is_new == 1 && state.phase.is_finite());
    sample_before.map_or(0, |index| index + 1)..last + 1
}

/// Runs the estimator until it has made so many estimates.
fn run(states: &[State], config: &Config, enough: usize) -> Result<Replay, EstimatorError> {
    let mut observer = Observer::new(config)?;
    let mut replay = Replay {
        first: 0,
        first_is_known: false,
        estimates: Vec::new(),
        cycles: Vec::new(),
        alarms: Vec::new(),
    };
    for state in states {
        observer.check(state)?;
        let report = observer.update(state);
        replay.alarms.extend(report.alarms.iter());
        replay.estimates.extend(report.estimate);
        replay.cycles.extend(report.cycle);
        if replay.estimates.len() >= enough {
            break;
        }
    }
    Ok(replay)
}

/// The estimates without heartbeats, which repeat the last estimate with the present alarms, or are sent before the first.
pub(super) fn fresh(estimates: &[Estimate]) -> impl Iterator<Item = &Estimate> {
    let mut last = (0, 0);
    estimates.iter().filter(move |estimate| {
        let this = (estimate.time_ns, estimate.state_sequence);
        let is_fresh = this != last && estimate.time_ns != 0;
        last = this;
        is_fresh
    })
}

/// Whether two messages are the same in every field, to the last bit.
pub(super) fn same<T: JsonMessage>(ours: &T, theirs: &T) -> bool {
    let text = |message: &T| {
        let mut text = Vec::new();
        message.write_json(&mut text).ok().map(|()| text)
    };
    text(ours) == text(theirs)
}

fn is_of(estimate: &Estimate, state: &State) -> bool {
    (estimate.time_ns, estimate.state_sequence) == (state.time_ns, state.sequence)
}
