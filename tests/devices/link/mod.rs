//! The link against a worm in memory: exchange, faults, start-up.

mod arm;
mod exchange;
mod faults;
mod startup;
mod tty;
mod worm;
