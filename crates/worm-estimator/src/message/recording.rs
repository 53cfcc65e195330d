//! The `recording` topic: whether a recorder writes the log, and how far it is.

use super::ZeroCopySend;
use super::json::Name;
use super::{coded_enum, message};

coded_enum! {
    /// What a recorder does.
    RecordingState, "recording state" {
        /// It records.
        Recording = 0 => "recording",
        /// It has ended in order; its files are complete.
        Ended = 1 => "ended",
        /// It has stopped because of a [`RecordingProblem`]. What was written until then can be read.
        Stopped = 2 => "stopped",
    }
}

coded_enum! {
    /// Why a recorder stopped. The code is the value of the alarm `recording-stopped`.
    RecordingProblem, "recording problem" {
        /// It has not stopped, or has ended in order.
        None = 0 => "none",
        /// No room: the disk is full, or a quota or a size limit is reached.
        DiskFull = 1 => "disk-full",
        /// The file may not be written (any more).
        ReadOnly = 2 => "read-only",
        /// The file was removed while it was written.
        FileRemoved = 3 => "file-removed",
        /// Another write error, such as a disk that failed or was pulled out.
        WriteError = 4 => "write-error",
        /// The topics could not be read.
        TopicsUnreadable = 5 => "topics-unreadable",
    }
}

message! {
    /// The state of the worm's recorder: once a second and at every change.
    RecordingStatus = "wormd_recording_v1", made: time_ns, cells: |_| 0, {
        /// Number of this message since the recorder started.
        sequence: u64,
        /// When it was sent, ns of `CLOCK_MONOTONIC`.
        time_ns: u64,
        /// Bytes written, in all files of this recording together.
        bytes: u64,
        /// Messages handed to the log.
        messages: u64,
        /// Messages that were published and did not arrive at the recorder.
        messages_lost: u64,
        /// Files begun.
        files: u64,
        /// [`RecordingState`] as a code.
        state: u32 as Name<RecordingState>,
        /// [`RecordingProblem`] as a code: why it stopped.
        problem: u32 as Name<RecordingProblem>,
    }
}
