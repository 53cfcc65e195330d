//! Recordings of a servo that moves an arm on a bench, made through the link: what `wormd explain` finds the missing friction in.
//!
//! 1. [`trajectory`]: what the servo is told.
//! 2. [`recorder`]: tells it, reads it, and ends with the torque off.
//! 3. [`files`]: a CSV for each run, and the campaign beside them.

pub mod files;
pub mod recorder;
pub mod trajectory;

pub use files::{Bench, BenchFiles};
pub use recorder::{BenchServo, BenchSettings, Reading, RecordingError};
pub use trajectory::Trajectory;
