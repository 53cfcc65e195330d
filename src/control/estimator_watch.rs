//! Whether the estimator is alive and keeps up: crawling without it is crawling without alarms.
//!
//! Estimates that come are not enough. An estimator that receives no states repeats its last estimate as a heartbeat, and one that
//! is far behind reports alarms too late. So the newest state that the estimator must answer is marked.
//! The mark's age shows how far the estimator is behind; an answer moves the mark to the newest such state. Ages are of the loop's own
//! clock, so a pause of the computer is no lag.
//!
//! Where the worm crawls only with positions, the estimator must answer the states with a tracker sample. Without samples no
//! answer is due: that silence is the tracker's. Where positions may be missing, it makes estimates without them at a steady pace,
//! and an answer is due to every state.

use super::interface::EstimateSeen;
use worm_estimator::config::Config;
use worm_estimator::message::State;

/// Follows the estimates.
#[derive(Debug, Clone, Copy)]
pub(super) struct EstimatorWatch {
    /// Whether states without a sample are answered, too.
    answers_every_state: bool,
    seen_ns: Option<u64>,
    /// Tick and time of the state that the estimator has to answer next.
    due: Option<(u64, u64)>,
    /// Tick and time of the newest state that has to be answered.
    newest: Option<(u64, u64)>,
    /// How long the last answer took, ns.
    last_lag_ns: u64,
}

impl EstimatorWatch {
    pub(super) const fn new(config: &Config) -> Self {
        Self {
            answers_every_state: config.position_source().may_be_missing(),
            seen_ns: None,
            due: None,
            newest: None,
            last_lag_ns: 0,
        }
    }

    /// Takes an estimate that arrived before the state of tick `sequence` is published. False for one that cannot belong to this
    /// controller's states: the estimator has not noticed yet that the controller was started anew.
    pub(super) fn take(&mut self, estimate: EstimateSeen, sequence: u64, now_ns: u64) -> bool {
        if estimate.state_sequence >= sequence {
            return false;
        }
        self.seen_ns = Some(now_ns);
        if let Some((due_sequence, due_ns)) = self.due
            && estimate.state_sequence >= due_sequence
        {
            self.last_lag_ns = now_ns.saturating_sub(due_ns);
            self.due = self.newest.filter(|(newest, _)| *newest > estimate.state_sequence);
        }
        true
    }

    /// A state is published. The estimator makes nothing of one without a phase.
    pub(super) fn note_state(&mut self, state: &State, now_ns: u64) {
        if state.phase.is_finite() && (self.answers_every_state || state.sample_is_new == 1) {
            self.newest = Some((state.sequence, now_ns));
            self.due = self.due.or(self.newest);
        }
    }

    /// How long the estimator has been silent or behind, counted from `since_ns` on, ns.
    pub(super) fn silent_ns(&self, now_ns: u64, since_ns: u64) -> u64 {
        let age_ns = |then_ns: u64| now_ns.saturating_sub(then_ns.max(since_ns));
        age_ns(self.seen_ns.unwrap_or(0)).max(self.due.map_or(0, |(_, due_ns)| age_ns(due_ns)))
    }

    /// Whether an estimate came within `timeout_ns` that was no further behind than that.
    pub(super) fn keeps_up(&self, now_ns: u64, timeout_ns: u64) -> bool {
        self.seen_ns.is_some() && self.silent_ns(now_ns, 0) <= timeout_ns && self.last_lag_ns <= timeout_ns
    }
}
