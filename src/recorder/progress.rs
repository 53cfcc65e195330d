//! How far the writing thread is, for the thread that reports it.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use worm_estimator::message::RecordingProblem;

/// Counters of one recording, over all its files.
#[derive(Debug, Default)]
pub(super) struct Progress {
    bytes: AtomicU64,
    files: AtomicU64,
    problem: AtomicU32,
}

impl Progress {
    /// Counts bytes that were written.
    pub(super) fn count_bytes(&self, bytes: u64) {
        self.bytes.fetch_add(bytes, Ordering::Relaxed);
    }

    /// Counts a file that was begun.
    pub(super) fn count_file(&self) {
        self.files.fetch_add(1, Ordering::Relaxed);
    }

    /// Notes what stops the recording; the first problem stays.
    pub(super) fn note_problem(&self, problem: RecordingProblem) {
        let none = RecordingProblem::None.code();
        // Fails where there is a problem already.
        let _ = self
            .problem
            .compare_exchange(none, problem.code(), Ordering::Relaxed, Ordering::Relaxed);
    }

    /// Bytes written.
    pub(super) fn bytes(&self) -> u64 {
        self.bytes.load(Ordering::Relaxed)
    }

    /// Files begun.
    pub(super) fn files(&self) -> u64 {
        self.files.load(Ordering::Relaxed)
    }

    /// What stopped the recording, if anything did.
    pub(super) fn problem(&self) -> RecordingProblem {
        RecordingProblem::try_from(self.problem.load(Ordering::Relaxed)).unwrap_or(RecordingProblem::WriteError)
    }
}
