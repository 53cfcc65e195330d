//! Logs of a worm's topics as MCAP files: every message of its processes, to the last bit.
//!
//! A log has one channel for each topic (`/state`, `/timing`, `/estimate`, `/cycle`, `/alarm`, `/range`, `/command`, `/trip`), with messages in Protocol Buffers
//! ([`ProtobufMessage`](worm_estimator::message::ProtobufMessage)) and their descriptor, so the official readers of any language, Foxglove
//! and PlotJuggler read it as named series. Log time is the time in the message, ns of `CLOCK_MONOTONIC`. The metadata record `wormd` gives
//! the corresponding wall-clock time, the worm and the version that wrote the file, and the attachment `worm.toml` is the configuration. So
//! the file is all that an analysis needs. A [`Note`] says what is special about it. Logs of older versions hold JSON, and are read as well.
//!
//! # How it works
//! `writer` puts messages into zstd chunks, each written as a whole: if the writer is killed, the file ends after its last chunk, without a
//! summary. `scan` therefore reads from the front; of a truncated file it reads all that is there, even within a
//! chunk, and reports how far it came. In a complete one the summary says where each chunk is, whatever is damaged before it. [`messages`] returns the contents of a log. [`replay`] feeds the states to the estimator again, and
//! [`compare`] says whether the results are the same as live. [`ChunkWriter`] makes the chunks of a log without a file, for a black box;
//! [`outline()`] says what is in a file without unpacking it, and [`complete`] finishes one that was cut off. [`export`] makes whole logs of damaged or old ones, and tables.
//!
//! # Cost
//! What a tick takes on disk and of a CPU is measured in `docs/results.md`, part by part (`benches/recording_mcap.rs`).

mod channel;
mod chunk_writer;
mod compare;
mod error;
pub mod export;
mod log;
mod note;
mod older;
mod outline;
mod payload;
mod recorder_alarm;
mod replay;
mod scan;
mod shape;
mod summary;
mod unpack;
mod writer;

pub use channel::{Channel, Logged};
pub use chunk_writer::{Chunk, ChunkWriter, head, metadata_record};
pub use compare::{Comparison, compare};
pub use error::ReadError;
pub use log::{Log, messages, messages_from, nothing, without_messages};
pub use note::Note;
pub use outline::{Outline, complete, outline};
pub use payload::{Payload, PayloadError};
pub use replay::{Replay, replay};
pub use scan::{Contents, scan, scan_from};
pub use writer::{Index, Origin, WriteError, Writer};
