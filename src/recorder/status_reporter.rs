//! Reports on the topic `recording` how the recording goes, so that the estimator raises an alarm when it stops.

use crate::realtime::monotonic_ns;
use crate::topics::{Hub, Instance, Publisher, Recorder, RoleError, RoleLock};
use std::time::{Duration, Instant};
use worm_estimator::message::{RecordingProblem, RecordingState, RecordingStatus};

/// Time between two reports while nothing special happens.
const INTERVAL: Duration = Duration::from_secs(1);

/// How often a recorder beside another looks whether it is now the only one.
const RETRY_INTERVAL: Duration = Duration::from_secs(10);

/// How far the recording is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Figures {
    pub bytes: u64,
    pub files: u64,
    pub messages: u64,
    pub messages_lost: u64,
}

/// Publishes the state of one recording. The recording never fails because of it.
pub(super) struct StatusReporter {
    instance: Instance,
    output: Option<Output>,
    tried: Instant,
    next_sequence: u64,
    last: Option<(Instant, Figures)>,
}

/// The topic, for the one recorder that has the role.
struct Output {
    // Before the role, which the next recorder may take only when this is gone.
    publisher: Publisher<RecordingStatus>,
    _role: RoleLock<Recorder>,
}

impl StatusReporter {
    /// A reporter, which reports nothing while another recorder of the worm has the role.
    pub(super) fn open(hub: &Hub, instance: &Instance) -> Self {
        let mut reporter = Self {
            instance: instance.clone(),
            output: None,
            tried: Instant::now(),
            next_sequence: 0,
            last: None,
        };
        reporter.try_to_take_role(hub);
        if reporter.output.is_none() {
            tracing::info!(
                "another recorder of this worm reports already; this one raises no alarm while that one runs"
            );
        }
        reporter
    }

    fn try_to_take_role(&mut self, hub: &Hub) {
        self.tried = Instant::now();
        let role = match RoleLock::take(&self.instance) {
            Ok(role) => role,
            Err(RoleError::AlreadyRunning(_)) => return,
            Err(error) => return tracing::warn!("the recording cannot be reported: {error}"),
        };
        match hub.publisher(&role) {
            Ok(publisher) => self.output = Some(Output { publisher, _role: role }),
            Err(error) => tracing::warn!("the recording cannot be reported: {error}"),
        }
    }

    /// Reports that the recording goes on, if a report is due or the number of files or of lost messages has changed.
    pub(super) fn report(&mut self, hub: &Hub, figures: Figures) {
        if self.output.is_none() && self.tried.elapsed() >= RETRY_INTERVAL {
            self.try_to_take_role(hub);
        }
        let is_due = self.last.is_none_or(|(sent, last)| {
            sent.elapsed() >= INTERVAL || (last.files, last.messages_lost) != (figures.files, figures.messages_lost)
        });
        if is_due {
            self.publish(figures, RecordingState::Recording, RecordingProblem::None);
        }
    }

    /// Reports that the recording is over, and why.
    pub(super) fn report_end(mut self, figures: Figures, problem: RecordingProblem) {
        let state = match problem {
            RecordingProblem::None => RecordingState::Ended,
            _ => RecordingState::Stopped,
        };
        self.publish(figures, state, problem);
    }

    fn publish(&mut self, figures: Figures, state: RecordingState, problem: RecordingProblem) {
        let Some(output) = &self.output else { return };
        let status = RecordingStatus {
            sequence: self.next_sequence,
            time_ns: monotonic_ns(),
            bytes: figures.bytes,
            messages: figures.messages,
            messages_lost: figures.messages_lost,
            files: figures.files,
            state: state.code(),
            problem: problem.code(),
        };
        if let Err(error) = output.publisher.publish(&status) {
            tracing::debug!("{error}");
        }
        self.next_sequence += 1;
        self.last = Some((Instant::now(), figures));
    }
}
