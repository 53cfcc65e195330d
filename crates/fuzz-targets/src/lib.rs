//! The readers of foreign bytes under attack: one function for each, which panics when a property does not hold.
//!
//! The same functions run under cargo-fuzz (`fuzz/` in the root of the repository) and, on stable Rust and for a bounded time, in
//! `tests/hostile_input`, which also measures their memory.
//!
//! What every target must keep to, whatever its input:
//! - it does not panic, and ends soon;
//! - it holds at most [`Target::memory_bound`] bytes at any moment;
//! - an error is a text that a person can read: it is no longer than [`MAX_ERROR_LEN`];
//! - what was accepted is consistent, and reads back the same where it can be written.

mod bench;
mod log;
mod packets;
mod recording;
mod route;
mod text;
mod tracker;

use std::fmt::Display;

/// A reader under attack.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// Its name, also that of its corpus.
    pub name: &'static str,
    /// Feeds it an input and checks what comes out.
    pub run: fn(&[u8]),
    /// Bytes that it may hold for each byte of input.
    pub memory_per_byte: usize,
    /// Bytes that it may hold besides.
    pub memory_base: usize,
}

impl Target {
    /// The most memory that it may hold at any moment for an input of so many bytes, bytes.
    pub const fn memory_bound(&self, input_len: usize) -> usize {
        self.memory_base + self.memory_per_byte * input_len
    }
}

/// Longest error, bytes; paths are short here.
pub const MAX_ERROR_LEN: usize = 16 * 1024;

/// Longest text of all warnings about one recording, bytes.
pub const MAX_WARNINGS_LEN: usize = 64 * 1024;

const KIB: usize = 1024;
const MIB: usize = 1024 * KIB;

/// Every target.
pub const TARGETS: [Target; 13] = [
    Target {
        name: "packets",
        run: packets::packets,
        memory_per_byte: 64,
        memory_base: 64 * KIB,
    },
    Target {
        name: "tracker_table",
        run: tracker::tracker_table,
        memory_per_byte: 16,
        memory_base: 64 * KIB,
    },
    Target {
        name: "config_toml",
        run: text::config_toml,
        memory_per_byte: 256,
        memory_base: 4 * MIB,
    },
    Target {
        name: "campaign_toml",
        run: text::campaign_toml,
        memory_per_byte: 256,
        memory_base: MIB,
    },
    Target {
        name: "bench_toml",
        run: bench::bench_toml,
        memory_per_byte: 256,
        memory_base: MIB,
    },
    Target {
        name: "servo_csv",
        run: bench::servo_csv,
        memory_per_byte: 64,
        memory_base: MIB,
    },
    Target {
        name: "recording_csv",
        run: recording::recording_csv,
        memory_per_byte: 128,
        memory_base: MIB,
    },
    Target {
        name: "route_csv",
        run: route::route_csv,
        memory_per_byte: 128,
        memory_base: MIB,
    },
    Target {
        name: "vicon_csv",
        run: recording::vicon_csv,
        memory_per_byte: 128,
        memory_base: MIB,
    },
    Target {
        name: "c3d",
        run: recording::c3d,
        memory_per_byte: 64,
        memory_base: MIB,
    },
    Target {
        name: "mcap_log",
        run: log::mcap_log,
        // A chunk may unpack to 64 times its size, and an empty message of 31 bytes to 1 kB in a list with as much room to spare.
        memory_per_byte: 5 * KIB,
        memory_base: 8 * MIB,
    },
    Target {
        name: "protobuf_message",
        run: log::protobuf_message,
        memory_per_byte: 64,
        memory_base: 64 * KIB,
    },
    Target {
        name: "log_messages",
        run: log::log_messages,
        memory_per_byte: 64,
        memory_base: 8 * MIB,
    },
];

/// The target of this name.
pub fn target(name: &str) -> Option<&'static Target> {
    TARGETS.iter().find(|target| target.name == name)
}

/// Runs the target of this name.
///
/// # Panics
/// When a property does not hold, or there is no such target.
pub fn run(name: &str, data: &[u8]) {
    (target(name).expect("a target").run)(data);
}

/// Holds an error to its length and returns it.
fn readable(error: impl Display) -> String {
    let text = error.to_string();
    assert!(!text.is_empty(), "an error without a text");
    assert!(
        text.len() <= MAX_ERROR_LEN,
        "an error of {} bytes: {text:.200}",
        text.len()
    );
    text
}
