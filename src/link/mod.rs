//! The serial side: a worm's servo and tracker, as DYNAMIXEL devices on one bus.
//!
//! From the wire up:
//!
//! 1. [`packet`] turns bytes into valid values and back (Protocol 2.0), for both ends of the line.
//! 2. [`servo`] and [`tracker`] say where in a device's control table things stand, what a count is worth, and turn a
//!    tick's block into a [`ServoReading`] and a [`TrackerReading`] in SI units.
//! 3. A [`Port`] sends, and waits no longer than it is told. [`Tty`] is the operating system's: opened for one controller
//!    alone, its USB latency timer found and mended. [`FaultInjector`] makes any port a bad one, from a seed.
//! 4. A [`Bus`] asks one question at a time on a port: ping, read, write, sync and bulk read, reboot. It counts what goes
//!    wrong by kind ([`BusCounters`]).
//! 5. [`prepare`] makes a worm ready at start-up: right devices, right settings, motor at rest, watchdog set. What it finds
//!    out of order it mends and tells ([`Finding`]), or refuses with a reason ([`StartupError`]).
//! 6. [`WormBus::exchange`] is what each tick does then: one write with the goal velocity and the question for both devices'
//!    blocks, then the answers until the deadline. It allocates nothing, logs nothing, and uses a partial answer for what it
//!    holds.
//! 7. [`WormBus::set_torque`], [`WormBus::stop_motor`], [`WormBus::rearm_watchdog`] and [`WormBus::reboot_servo`] are what a controller
//!    does between ticks; each change is read back.
//! 8. [`virtual_worm`] is the other end of the line: the same devices, simulated on a pseudo-terminal.
//!
//! ```no_run
//! use std::path::Path;
//! use std::time::{Duration, Instant};
//! use wormd::link::{LinkSettings, Tty, WormBus, prepare};
//!
//! # fn run(settings: LinkSettings) -> Result<(), Box<dyn std::error::Error>> {
//! let (tty, mut findings) = Tty::open(Path::new("/dev/ttyUSB0"), settings.baud)?;
//! let mut bus = WormBus::new(tty);
//! let worm = prepare(&mut bus, &settings, &mut findings)?;
//! bus.set_torque(worm.plan.servo, true)?;
//! let outcome = bus.exchange(&worm.plan, 2.5, Instant::now() + Duration::from_millis(3));
//! if let Ok(servo) = outcome.servo {
//!     println!("{} rad, {} A", servo.position_rad, servo.current_a);
//! }
//! # Ok(()) }
//! ```
//!
//! Times are deadlines on the monotonic clock. Only ports wait; a port in memory makes every test of the link instant.
//!
//! What cannot be told: an answer that comes later than the next question looks like the answer to that question, for the
//! protocol numbers nothing. It is taken for it when it is received first; of two that are there together the newer one has
//! the last word. When the goal has changed meanwhile, [`ExchangeOutcome::goal_taken`] gives it away; the tracker's sample
//! counter may, too.

mod counters;
mod exchange;
mod operations;
pub mod servo;
mod startup;
pub mod tracker;
pub mod virtual_worm;
mod worm_bus;

pub use counters::{ExchangeCounters, LinkCounters};
pub use dynamixel_bus::{
    Bus, BusCounters, FaultInjector, Faults, Finding, Identity, OpenError, Port, PortError, RefusalCounters, Register,
    TransactionError, Tty, WaitEnd, packet,
};
pub use exchange::{ExchangeOutcome, ExchangePlan, ReadFailure, ReadMode, ReadPlan};
pub use operations::OperationError;
pub use servo::ServoReading;
pub use startup::{LinkSettings, Prepared, StartupError, prepare};
pub use tracker::{NoTrackerBlock, TrackerReading};
pub use worm_bus::WormBus;
