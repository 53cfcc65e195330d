//! What the processes of an earthworm robot know and say: configuration, messages, and the estimator between them.
//!
//! | module | what it holds | knows nothing of |
//! |---|---|---|
//! | [`config`] | what a worm is and how it is run: one TOML file, checked once, then trusted | processes, topics |
//! | [`message`] | one plain, fixed-size type per topic, its JSON form and schema | how messages travel |
//! | [`estimate`] | contact points, deformation, energy, cycles and alarms from the states of the controller | clocks, files, topics |
//!
//! Everything here is pure: time comes in with the messages. The same estimator runs on the robot and on a recording, and gives
//! the same numbers to the last bit.

pub mod config;
pub mod estimate;
pub mod message;
pub mod number;
pub mod time;

pub use worm_physics::MAX_CELLS;
