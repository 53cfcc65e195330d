//! What a bridge and a laptop say to each other. docs/bridge.md has the rules behind it.
//!
//! Up go small JSON objects, at least ten a second. Down go pieces ([`super::pieces`]) of compressed JSON, which the laptop confirms.

use crate::relay::wire::{Answer, Line, RequestLine};
use serde::{Deserialize, Serialize};

/// Version of this language, as that of the relay: new members need no new one.
pub(crate) const VERSION: u32 = 1;

/// Longest message of a laptop, bytes.
pub(crate) const MAX_UP: usize = 64 << 10;

/// How often a laptop is heard of at least, ns.
pub(crate) const UP_INTERVAL_NS: u64 = 100_000_000;

/// A message of a laptop.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct Up {
    /// [`VERSION`] of the laptop.
    pub version: u32,
    /// What it has received.
    pub echo: Option<Echo>,
    /// It cannot go on with what it has received: begin anew.
    #[serde(default)]
    pub is_lost: bool,
    /// Its watchers that were heard of late.
    #[serde(default)]
    pub watchers: Vec<RemoteWatcher>,
    /// What they ask for.
    #[serde(default)]
    pub requests: Vec<RemoteRequest>,
}

/// The newest piece that a laptop has received: it proves how old a message is at most, without any clock being right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Echo {
    /// The stream of the piece.
    pub stream: u64,
    /// Its number.
    pub sequence: u64,
    /// How long before the message it came, ms.
    pub held_ms: u64,
}

/// A watcher behind a laptop.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(crate) struct RemoteWatcher {
    /// The worm that it watches.
    pub worm: String,
    /// Its number at the laptop.
    pub watcher: u64,
}

/// A request of such a watcher.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct RemoteRequest {
    /// Who asks.
    #[serde(flatten)]
    pub from: RemoteWatcher,
    /// The name that it gave, if it did.
    pub name: Option<String>,
    /// What it asks for.
    pub line: RequestLine,
}

/// A message of a robot.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Down {
    /// The bridge is there.
    Beat(Beat),
    /// A line of a worm's relay.
    Line {
        /// The worm.
        worm: String,
        /// The line.
        line: Line,
    },
    /// The answer to a request.
    Answer {
        /// Who asked.
        to: RemoteWatcher,
        /// The answer.
        answer: Answer,
    },
}

/// How a bridge stands.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Beat {
    /// [`VERSION`] of the bridge.
    pub version: u32,
    /// Version of its `wormd`.
    pub wormd: String,
    /// This run of it. A worm has one bridge: two that differ serve two worms, whatever their names; none of an older bridge.
    #[serde(default)]
    pub bridge: Option<String>,
    /// The worms that it serves.
    pub worms: Vec<String>,
    /// Whether this laptop's certificate permits to drive.
    pub may_drive: bool,
    /// How long a piece and its echo were under way together of late, ms; none where that is not known.
    pub round_trip_ms: Option<u64>,
    /// The robot's clocks.
    pub clock: ClockStatus,
}

/// The clocks of a robot. Nothing is judged by wall time; this says what times in its logs mean.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct ClockStatus {
    /// The kernel's name for this run of the computer: times of `CLOCK_MONOTONIC` of another one do not compare.
    pub boot_id: String,
    /// Whether the kernel counts its wall time as synchronised; none where it does not say.
    pub synchronised: Option<bool>,
    /// Wall time (Unix) less `CLOCK_MONOTONIC`, ns.
    pub wall_offset_ns: i64,
    /// How often wall time was set since the bridge began.
    pub steps: u64,
    /// The newest such step.
    pub last_step: Option<ClockStep>,
}

/// Wall time was set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct ClockStep {
    /// When, ns of `CLOCK_MONOTONIC`.
    pub time_ns: u64,
    /// By how much, ns; forward is positive.
    pub step_ns: i64,
}
