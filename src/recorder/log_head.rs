//! What stands at the beginning of each file of a recording, and by whose clocks.

use crate::realtime::monotonic_ns;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use worm_log::{Note, Origin};

/// The clocks by which messages are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LogClock {
    /// Those of this computer.
    Own,
    /// Those of a robot elsewhere.
    Robot {
        /// Its `CLOCK_MONOTONIC` less this computer's, ns; too small by how long frames are under way.
        ahead_ns: i64,
        /// Its wall time (Unix) less its `CLOCK_MONOTONIC`, ns.
        wall_offset_ns: i64,
    },
}

/// The head of a file.
#[derive(Debug, Clone)]
pub(super) struct LogHead {
    /// The worm, and when the first file was begun.
    pub(super) origin: Origin,
    pub(super) clock: LogClock,
    /// What is special about the recording.
    pub(super) notes: Vec<Note>,
}

impl LogClock {
    /// Wall time, and ns of `CLOCK_MONOTONIC`.
    pub(super) fn now(self) -> (SystemTime, u64) {
        match self {
            Self::Own => (SystemTime::now(), monotonic_ns()),
            Self::Robot {
                ahead_ns,
                wall_offset_ns,
            } => {
                let time_ns = monotonic_ns().saturating_add_signed(ahead_ns);
                (wall_time(time_ns, wall_offset_ns), time_ns)
            }
        }
    }
}

impl LogHead {
    /// The head of a file that begins now.
    pub(super) fn of_next(&self) -> Self {
        let (begun, begun_ns) = self.clock.now();
        let mut head = self.clone();
        (head.origin.begun, head.origin.begun_ns) = (begun, begun_ns);
        head
    }
}

/// The wall time at a moment of `CLOCK_MONOTONIC`; that of a clock that was never set is 1970.
pub(super) fn wall_time(time_ns: u64, wall_offset_ns: i64) -> SystemTime {
    UNIX_EPOCH + Duration::from_nanos(time_ns.saturating_add_signed(wall_offset_ns))
}
