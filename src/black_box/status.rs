//! Reports how the black box is doing, so that the estimator raises an alarm when it cannot write or was killed.

use super::keeper::Figures;
use crate::realtime::monotonic_ns;
use crate::topics::{BlackBox as Role, Hub, PortError, Publisher, RoleLock};
use std::time::{Duration, Instant};
use worm_estimator::message::{BlackBoxStatus, RecordingProblem, RecordingState};

/// Time between two reports while nothing changes.
const INTERVAL: Duration = Duration::from_secs(1);

/// Publishes the state of a black box, which never fails because of it.
pub(super) struct Reporter {
    // Before the role, which the next black box may take only when this is gone.
    publisher: Publisher<BlackBoxStatus>,
    _role: RoleLock<Role>,
    next_sequence: u64,
    last: Option<(Instant, Option<RecordingProblem>, u64)>,
}

/// How many messages came, and how many did not.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Received {
    pub messages: u64,
    pub lost: u64,
}

impl Reporter {
    /// The reporter of the one black box of a worm.
    ///
    /// # Errors
    /// [`PortError`] when the topic cannot be written.
    pub(super) fn open(hub: &Hub, role: RoleLock<Role>) -> Result<Self, PortError> {
        Ok(Self {
            publisher: hub.publisher(&role)?,
            _role: role,
            next_sequence: 0,
            last: None,
        })
    }

    /// Reports how it stands, if a report is due or something has changed.
    pub(super) fn report(&mut self, figures: Figures, received: Received) {
        let now = (figures.problem, figures.boxes);
        let is_due = self
            .last
            .is_none_or(|(sent, problem, boxes)| sent.elapsed() >= INTERVAL || (problem, boxes) != now);
        if is_due {
            let state = match figures.problem {
                None => RecordingState::Recording,
                Some(_) => RecordingState::Stopped,
            };
            self.publish(figures, received, state);
        }
    }

    /// Reports that it has ended.
    pub(super) fn report_end(mut self, figures: Figures, received: Received) {
        let state = match figures.problem {
            None => RecordingState::Ended,
            Some(_) => RecordingState::Stopped,
        };
        self.publish(figures, received, state);
    }

    fn publish(&mut self, figures: Figures, received: Received, state: RecordingState) {
        let status = BlackBoxStatus {
            sequence: self.next_sequence,
            time_ns: monotonic_ns(),
            memory_bytes: figures.memory_bytes,
            written_bytes: figures.written_bytes,
            boxes: figures.boxes,
            messages: received.messages,
            messages_lost: received.lost,
            state: state.code(),
            problem: figures.problem.unwrap_or(RecordingProblem::None).code(),
        };
        if let Err(error) = self.publisher.publish(&status) {
            tracing::debug!("{error}");
        }
        self.next_sequence += 1;
        self.last = Some((Instant::now(), figures.problem, figures.boxes));
    }
}
