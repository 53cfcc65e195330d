//! Logs of a worm's topics as MCAP files: what the processes said to each other, to the last bit.
//!
//! A log has one channel for each topic (`/state`, `/timing`, `/estimate`, `/cycle`, `/alarm`), messages as JSON after
//! [`JsonMessage`](worm_estimator::message::JsonMessage) with their schema beside them, so the official readers of any language,
//! Foxglove and PlotJuggler take it as named series. Log time is the time that stands in the message,
//! ns of `CLOCK_MONOTONIC`; the metadata record `wormd` tells which wall-clock time that was, which worm it is and which
//! version wrote the file, and the attachment `worm.toml` is its configuration. Nothing but the file is needed later.
//!
//! # The story
//! `writer` lays messages into lz4 chunks, each of which reaches the file as a whole: a killed writer leaves a file that
//! ends after its last chunk, without a summary. `scan` therefore reads from the front, never by the index, and of a file
//! that is cut off anywhere it takes what is there, inside a chunk too, and says how far it came.
//! [`messages`] gives what a log holds. [`replay`] feeds the states to the estimator once more and [`Comparison`] says whether it came to
//! the same results as live.
//!
//! # Cost
//! Writing the state and the timing of a tick takes 4.4 µs, so 0.4 % of a CPU at 1 kHz, and all topics together take
//! 200 bytes a tick on disk, 0.7 GB an hour. Reading a state takes 1.6 µs (`benches/recording_mcap.rs`).

mod channel;
mod compare;
mod error;
mod log;
mod older;
mod replay;
mod scan;
mod writer;

pub use channel::{Channel, Logged};
pub use compare::{Comparison, compare};
pub use error::ReadError;
pub use log::{Log, messages, nothing, without_messages};
pub use replay::{Replay, replay};
pub use scan::{Contents, scan};
pub use writer::{Origin, WriteError, Writer};
