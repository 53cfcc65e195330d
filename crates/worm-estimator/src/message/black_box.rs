//! The `black_box` topic: whether the black box can write, and how much it holds.

use super::ZeroCopySend;
use super::json::Name;
use super::message;
use super::recording::{RecordingProblem, RecordingState};

message! {
    /// The state of the worm's black box: once a second and at every change.
    BlackBoxStatus = "wormd_black_box_v1", made: time_ns, cells: |_| 0, {
        /// Number of this message since the black box started.
        sequence: u64,
        /// When it was sent, ns of `CLOCK_MONOTONIC`.
        time_ns: u64,
        /// Compressed messages in memory, bytes.
        memory_bytes: u64,
        /// Written since it started, bytes.
        written_bytes: u64,
        /// Boxes begun since it started.
        boxes: u64,
        /// Messages handed to it.
        messages: u64,
        /// Messages that were published and did not arrive at it.
        messages_lost: u64,
        /// [`RecordingState`] as a code: stopped while it cannot write. It goes on in memory, and tries again.
        state: u32 as Name<RecordingState>,
        /// [`RecordingProblem`] as a code: why it cannot write.
        problem: u32 as Name<RecordingProblem>,
    }
}
