//! The controller: a pure [`Controller::tick`] around an explicit state machine, and the real-time loop that gives it
//! deadlines.
//!
//! In the order in which one tick runs:
//!
//! 1. [`Schedule`] says when the tick is due; the loop in [`run()`] sleeps until then. `rate` slows it down where the computer cannot
//!    hold the configured rate.
//! 2. The link exchanges the goal velocity for readings.
//! 3. [`Controller::tick`] turns readings, commands and alarms into a [`State`](worm_estimator::message::State), the next
//!    goal and, rarely, a [`Service`]. It knows the limits (`safety`), the ramps (`ramp`), how readings become
//!    messages (`state_assembler`), and which part of the time the loop was there at all (`presence`, `resume`); it takes time as an
//!    argument, so all of it is tested in virtual time.
//! 4. The loop publishes, wakes who listens, carries out a service if one is due, and finishes the tick on the schedule. A tick
//!    that was late gets its culprit, by what the kernel has counted (`sched_counters`); what there is to log goes to the `journal`.

mod controller;
mod hardware;
mod journal;
mod presence;
mod ramp;
mod rate;
mod resume;
mod run;
mod safety;
mod sched_counters;
mod schedule;
mod state_assembler;

pub use controller::{Controller, Inputs, Outputs, Service, ServiceOutcome};
pub use hardware::{Drive, DriveError, link_settings};
pub use run::{Ending, RunError, run};
pub use schedule::{Schedule, bus_allowed_ns};
