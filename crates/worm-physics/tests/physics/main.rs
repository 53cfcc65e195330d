//! The physics against the paper, against themselves, and against figures that were worked out without them.

mod effects;
mod properties;
mod tables;
