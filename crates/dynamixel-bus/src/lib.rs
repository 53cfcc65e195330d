//! DYNAMIXEL Protocol 2.0, from bytes to transactions, for both ends of the line.
//!
//! 1. [`packet`] turns bytes into valid values and back. It needs neither `std` nor an allocator, so a microcontroller can be a
//!    device with it: see `examples/tracker`.
//! 2. A [`Port`] sends and receives, and waits no longer than its deadline. [`Tty`] is a serial port of the operating system,
//!    opened for one process alone, with its USB latency timer checked and corrected. [`FaultInjector`] makes any port a bad one,
//!    from a seed.
//! 3. A [`Bus`] does one transaction at a time on a port: ping, read, write, sync and bulk read, reboot. It counts what goes
//!    wrong by kind ([`BusCounters`]).
//!
//! Points 2 and 3 need the feature `std`, which is on by default.
//!
//! ```no_run
//! use dynamixel_bus::{Bus, Tty, packet::DeviceId};
//! use std::path::Path;
//! use std::time::{Duration, Instant};
//!
//! # fn run() -> Result<(), Box<dyn std::error::Error>> {
//! let (tty, _findings) = Tty::open(Path::new("/dev/ttyUSB0"), 57_600)?;
//! let mut bus = Bus::new(tty);
//! let servo = DeviceId::new(1).ok_or("no such ID")?;
//! let identity = bus.ping(servo, Instant::now() + Duration::from_millis(50))?;
//! println!("model {}, firmware {}", identity.model, identity.firmware);
//! # Ok(()) }
//! ```
#![cfg_attr(not(feature = "std"), no_std)]

/// The examples of the README are tested, too.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

#[cfg(feature = "std")]
mod bus;
#[cfg(feature = "std")]
mod counters;
#[cfg(feature = "std")]
mod fault_injector;
#[cfg(feature = "std")]
mod finding;
#[cfg(feature = "std")]
mod latency_timer;
pub mod packet;
#[cfg(feature = "std")]
mod port;
mod register;
#[cfg(feature = "std")]
mod tty;

#[cfg(feature = "std")]
pub use bus::{Bus, Identity, TransactionError, WaitEnd};
#[cfg(feature = "std")]
pub use counters::{BusCounters, RefusalCounters};
#[cfg(feature = "std")]
pub use fault_injector::{FaultInjector, Faults};
#[cfg(feature = "std")]
pub use finding::Finding;
#[cfg(feature = "std")]
pub use port::{Port, PortError};
pub use register::{Block, Register};
#[cfg(feature = "std")]
pub use tty::{OpenError, Tty};
