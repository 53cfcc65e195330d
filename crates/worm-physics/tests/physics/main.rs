//! The physics against the paper's tables, and against figures that were calculated without them.

mod effects;
mod tables;
