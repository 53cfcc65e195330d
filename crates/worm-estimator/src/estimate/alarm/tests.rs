//! The alarms against a simulated worm in virtual time: every fault is told, nothing else is.

mod charts;
mod fault_table;
mod faults;
mod properties;
mod quiet;
mod worm;
