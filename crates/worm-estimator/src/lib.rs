//! Configuration, messages and the streaming estimator of an earthworm robot.
//!
//! | module | what it holds | does not depend on |
//! |---|---|---|
//! | [`battery`] | open-circuit voltage, and how much is left | processes, topics |
//! | [`config`] | the worm and how it is run: one TOML file, checked once, then trusted | processes, topics |
//! | [`message`] | one plain, fixed-size type per topic, its JSON form and schema | how messages travel |
//! | [`estimate`] | contact points, deformation, energy, cycles and alarms from the controller's states | clocks, files, topics |
//! | [`self_sensing`] | friction, stiffness, advance and energy from the motor's current alone | messages but the state, clocks, files |
//! | [`number`], [`abridged`] | numbers and foreign names as text, for reports and errors | everything else |
//!
//! Everything here is pure: time comes with the messages. The same estimator runs on the robot and on a recording, with the same results
//! to the last bit.

pub mod abridged;
pub mod battery;
pub mod config;
pub mod estimate;
pub mod message;
pub mod number;
pub mod self_sensing;
pub mod time;
pub mod winding;

pub use worm_physics::MAX_CELLS;
