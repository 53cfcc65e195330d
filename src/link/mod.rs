//! The serial side: a worm's servo and tracker, as DYNAMIXEL devices on one bus.
//!
//! From the wire up:
//!
//! 1. [`packet`] turns bytes into valid values and back (Protocol 2.0), for both ends of the line.
//! 2. [`servo`] and [`tracker`] have the addresses and units of the devices' control tables, and turn a tick's block into a
//!    [`ServoReading`] and a [`TrackerReading`] in SI units.
//! 3. A [`Port`] sends, and receives until a deadline. [`Tty`] is the operating system's port: opened exclusively, with its USB
//!    latency timer corrected. [`FaultInjector`] adds reproducible faults to any port.
//! 4. A [`Bus`] performs one transaction at a time on a port: ping, read, write, sync and bulk read, reboot. It counts failures by
//!    kind ([`BusCounters`]).
//! 5. [`prepare`] makes a worm ready at start-up: right devices, right settings, motor at rest, watchdog set. It corrects wrong
//!    settings and reports them ([`Finding`]), or refuses with a reason ([`StartupError`]).
//! 6. [`WormBus::exchange`] is the transaction of each tick: one write with the goal velocity and the request for both devices'
//!    blocks, then the answers until the deadline. It allocates nothing, logs nothing, and uses what a partial answer contains.
//! 7. [`WormBus::set_torque`], [`WormBus::stop_motor`], [`WormBus::rearm_watchdog`] and [`WormBus::reboot_servo`] serve between ticks;
//!    each change is verified by reading back.
//!    [`arm`] prepares and switches torque on, and off again where that cannot be verified. [`WormBus::try_watchdog`] and
//!    [`WormBus::try_motion`] are trials that turn the cam, until [`StopInputs`] end them.
//! 8. [`EmergencyStopInput`] reads the emergency stop, from the exchange or from a GPIO line.
//! 9. [`virtual_worm`] is the other end of the line: the same devices, simulated on a pseudo-terminal.
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
//! A limit of the protocol: it does not number packets, so an answer that arrives after the next request looks like the answer to
//! that one. If it is received first, it is taken for it; if both are present, the newer one counts. When the goal has changed
//! meanwhile, [`ExchangeOutcome::goal_taken`] reveals the mix-up; so may the tracker's sample counter.

mod arm;
mod counters;
mod emergency_stop;
mod exchange;
mod operations;
mod owed_answers;
pub mod servo;
mod startup;
mod stop_inputs;
pub mod tracker;
mod trial;
pub mod virtual_worm;
mod worm_bus;

pub use arm::{ArmError, arm, disarm};
pub use counters::{ExchangeCounters, LinkCounters};
pub use dynamixel_bus::{
    Bus, BusCounters, FaultInjector, Faults, Finding, Identity, OpenError, Port, PortError, RefusalCounters, Register,
    TransactionError, Tty, WaitEnd, packet,
};
pub use emergency_stop::{EmergencyStopError, EmergencyStopInput};
pub use exchange::{ExchangeOutcome, ExchangePlan, ReadFailure, ReadMode, ReadPlan, TrackerQuery};
pub use operations::OperationError;
pub use servo::ServoReading;
pub use startup::{LinkSettings, Prepared, PreparedTracker, StartupError, TrackerSettings, prepare};
pub(crate) use startup::{find_servo, limit_duty_to};
pub use stop_inputs::StopInputs;
pub use tracker::{NoTrackerBlock, TrackerReading};
pub use trial::{MotionTrial, TrialError, WatchdogTrial};
pub use worm_bus::WormBus;
