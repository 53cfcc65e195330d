//! Feeding a log's states to the estimator again.

use super::log::Log;
use super::recorder_alarm;
use std::borrow::Cow;
use worm_estimator::config::Config;
use worm_estimator::estimate::{EstimatorError, Observer};
use worm_estimator::message::{Alarm, AlarmKind, Cycle, Estimate, Inferred, JsonMessage, Range, State};

/// So many recorded estimates must be reproduced to identify the estimator's first state.
const FIRST_ESTIMATES: usize = 20;

/// The search for the first state ends after so many passes through the log, so that its time grows as the log and not as its square …
const TRIES: usize = 20;
/// … and not before so many states.
const MIN_TRIED_STATES: usize = 100_000;

/// Where states without a sample are answered, the first estimate comes within so many states of the start: silence of the tracker counts
/// from there.
const MAX_UNANSWERED: usize = 500;

/// The estimator's results on a log's states.
#[derive(Debug, Clone)]
pub struct Replay {
    /// Index of the first state that the estimator got.
    pub first: usize,
    /// Whether that is the first state of the recorded estimator.
    pub first_is_known: bool,
    /// One for each new sample, and for each state at which one was due without.
    pub estimates: Vec<Estimate>,
    /// The gait cycles that ended.
    pub cycles: Vec<Cycle>,
    /// Alarms raised and cleared.
    pub alarms: Vec<Alarm>,
    /// How far the battery lasts, after each cycle.
    pub ranges: Vec<Range>,
    /// What the motor's current alone says.
    pub inferred: Vec<Inferred>,
}

/// Feeds a log's states to the estimator, in their order.
///
/// An estimator that was started after the controller has not seen the first states, and its sums depend on where it started. The first message
/// of self-sensing says where, for it is made with the estimator's first state. Without it every start that the first recorded estimate allows
/// is tried, and the one that reproduces the first estimates is used; if there is none, the first state.
///
/// # Errors
/// [`EstimatorError`] for a configuration that is not valid, or is of a worm with another number of cells.
pub fn replay(log: &Log, config: &Config) -> Result<Replay, EstimatorError> {
    let config = &*as_recorded(log, config);
    let mut budget = MIN_TRIED_STATES + TRIES * log.states.len();
    let recorded: Vec<_> = fresh(&log.estimates)
        .take(FIRST_ESTIMATES)
        .map(recorder_alarm::without)
        .collect();
    let sampled_only = !config.position_source().may_be_missing();
    let starts = match first_by_message(log) {
        Some(first) => first..first + 1,
        None => possible_starts(&log.states, recorded.first(), sampled_only),
    };
    for first in starts {
        let (mut found, fed) = run(log, first, config, recorded.len())?;
        let is_same = found.estimates.len() == recorded.len()
            && found
                .estimates
                .iter()
                .zip(&recorded)
                .all(|(ours, theirs)| same(ours, theirs));
        if is_same {
            (found, _) = run(log, first, config, usize::MAX)?;
            (found.first, found.first_is_known) = (first, true);
            return Ok(found);
        }
        let Some(left) = budget.checked_sub(fed) else { break };
        budget = left;
    }
    Ok(run(log, 0, config, usize::MAX)?.0)
}

/// Bits of the alarms that self-sensing raises.
const BY_CURRENT: u32 =
    1 << AlarmKind::FrictionLoss.code() | 1 << AlarmKind::InferredJam.code() | 1 << AlarmKind::MoreLoad.code();

/// The configuration as the estimator had it: that of an older version knew no self-sensing, whatever the defaults of this one say.
fn as_recorded<'c>(log: &Log, config: &'c Config) -> Cow<'c, Config> {
    let was_enabled = !log.inferred.is_empty()
        || log
            .estimates
            .iter()
            .any(|estimate| (estimate.armed_mask | estimate.raised_mask) & BY_CURRENT != 0);
    let mut config = Cow::Borrowed(config);
    if !was_enabled && !log.estimates.is_empty() && config.self_sensing.enabled {
        config.to_mut().self_sensing.enabled = false;
    }
    config
}

/// Index of the estimator's first state, where the log has the message that was made with it.
fn first_by_message(log: &Log) -> Option<usize> {
    let first = log.inferred.iter().find(|inferred| inferred.sequence == 0)?;
    let key = (first.time_ns, first.state_sequence);
    log.states
        .iter()
        .position(|state| (state.time_ns, state.sequence) == key)
}

/// Indices of the states at which an estimator with this first estimate can have started. `sampled_only`: it answers only states with a
/// sample.
fn possible_starts(states: &[State], first_estimate: Option<&Estimate>, sampled_only: bool) -> std::ops::Range<usize> {
    let Some(estimate) = first_estimate else { return 0..0 };
    let Some(last) = states.iter().position(|state| is_of(estimate, state)) else {
        return 0..0;
    };
    // An earlier state that had to be answered would have given an earlier estimate, if only a little later.
    let is_answered = |state: &State| state.phase.is_finite() && (state.sample_is_new == 1 || !sampled_only);
    let reach = if sampled_only {
        last
    } else {
        last.saturating_sub(MAX_UNANSWERED)
    };
    let sample_before = states[..reach].iter().rposition(is_answered);
    sample_before.map_or(0, |index| index + 1)..last + 1
}

/// Runs the estimator until it has made so many estimates, and returns how many states that took.
///
/// The readings of a gauge are no states: they come from the recorded ranges, each of which says what it used. Marks come from the
/// recorded commands.
fn run(log: &Log, first: usize, config: &Config, enough: usize) -> Result<(Replay, usize), EstimatorError> {
    let mut observer = Observer::new(config)?;
    let mut gauged = log.ranges.iter().peekable();
    note_gauge(&mut observer, gauged.peek().copied());
    let mut commands = log.commands.iter().peekable();
    let mut replay = Replay {
        first: 0,
        first_is_known: false,
        estimates: Vec::new(),
        cycles: Vec::new(),
        alarms: Vec::new(),
        ranges: Vec::new(),
        inferred: Vec::new(),
    };
    let mut fed = 0;
    for state in &log.states[first..] {
        fed += 1;
        observer.check(state)?;
        let report = observer.update(state);
        replay.alarms.extend(report.alarms.iter());
        replay.estimates.extend(report.estimate);
        replay.cycles.extend(report.cycle);
        replay.inferred.extend(report.inferred);
        while let Some(record) = commands.next_if(|record| record.time_ns <= state.time_ns) {
            observer.note_command(record);
        }
        if let Some(range) = report.range {
            while gauged.next_if(|recorded| recorded.end_ns <= range.end_ns).is_some() {}
            replay.ranges.push(range);
            note_gauge(&mut observer, gauged.peek().copied());
        }
        if replay.estimates.len() >= enough {
            break;
        }
    }
    Ok((replay, fed))
}

/// What the gauge said in the cycle that this range followed. It counts at the end of the cycle, and so may come early.
fn note_gauge(observer: &mut Observer, recorded: Option<&Range>) {
    if let Some(range) = recorded {
        observer.note_gauge(range.gauge_share);
    }
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
