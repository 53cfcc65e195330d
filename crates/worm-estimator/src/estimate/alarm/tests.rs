//! The alarms against a simulated worm in virtual time: every fault is reported, and nothing else.

mod charts;
mod fault_table;
mod faults;
mod properties;
mod quiet;
mod recording;
mod worm;
