//! `wormd`: a shared-memory real-time controller and telemetry daemon for an untethered earthworm robot.

/// Most cells a worm can have: fixed-size topics and control tables are laid out for this many.
pub const MAX_CELLS: usize = 16;

pub mod config;
pub mod control;
pub mod estimate;
pub mod link;
pub mod message;
pub mod model;
pub mod realtime;
pub mod topics;
