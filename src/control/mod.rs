//! The controller: a pure [`Controller::tick`] around an explicit state machine, and the real-time loop that gives it
//! deadlines.
//!
//! In the order in which one tick runs:
//!
//! 1. [`Schedule`] says when the tick is due; the loop in [`run()`] sleeps until then. `rate` slows it down when the computer cannot
//!    sustain the configured rate.
//! 2. The link exchanges the goal velocity for readings. A port that is gone comes back by itself (`replaceable_port`).
//! 3. [`Controller::tick`] turns readings, commands and alarms into a [`State`](worm_estimator::message::State), the next
//!    goal and, rarely, a [`Service`]. It enforces the limits (`safety`, `estimator_watch`, `crawl_limit`), reacts to alarms
//!    (`standing_alarms`), ramps (`ramp`), assembles the state (`state_assembler`), and handles pauses of the computer (`loop_clock`,
//!    `resume`). Time is an argument, so all of it is tested in virtual time.
//! 4. The loop publishes (`ports`), wakes the listeners, executes a service if one is due, and finishes the tick on the schedule. The kernel's
//!    counters (`sched_counters`) show what made a late tick late; the `journal` logs from a thread of its own.

mod controller;
mod crawl_limit;
mod estimator_watch;
mod hardware;
mod interface;
mod journal;
mod loop_clock;
mod ports;
mod ramp;
mod rate;
mod replaceable_port;
mod resume;
mod run;
mod safety;
mod sched_counters;
mod schedule;
mod standing_alarms;
mod state_assembler;

pub use controller::Controller;
pub use hardware::{Drive, DriveError, link_settings};
pub use interface::{EstimateSeen, Inputs, Lease, Note, Notes, Outputs, Service, ServiceOutcome};
pub use run::{Ending, RunError, run};
pub use schedule::{Schedule, bus_allowed_ns};
