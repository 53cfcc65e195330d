//! The virtual worm: servo, tracker, motor, body and canal, simulated, so that everything above the serial port can be
//! run and tested without a robot, and compared with a ground truth that no estimator can see.
//!
//! From the physics out to the port:
//!
//! 1. A [`supply`] feeds a [`motor`], solved exactly within each step; the motor turns the cam of a [`body`], the
//!    quasi-static motion of [`worm_physics`] under every `[[effect]]`, with friction that scatters from cycle to cycle; a camera ([`camera`])
//!    sees the cells. [`Plant`] steps them together and keeps the [`ledger`] of where the energy went. No clock, no I/O.
//! 2. `servo` and `tracker` are the devices: control tables with the manual's access rules, modes, watchdog, shutdown.
//!    [`Devices`] puts both on a bus: bytes and a time in, bytes out. Still no clock.
//! 3. [`Server`] gives them a clock and a pseudo-terminal; [`VirtualWorm`] runs it in a thread, `wormd virtual-worm` in a
//!    process.
//!
//! A [`Fault`] changes the [`conditions`], the parameters of all of the above: see [`fault`] for the grammar and [`Fault::help`] for the list.
//!
//! # Limits
//! Of the effects, `sensor-latency` cannot be negative here, because a real-time simulation does not know the future. `motor-droop` reduces
//! the velocity that the servo is commanded to keep.
//!
//! The servo may carry an arm instead of the cam ([`Options::arm`]), for recordings on a bench; the worm rests then.
//!
//! Not modelled: the winding's inductance, the backlash of the gears and the time of bytes on a real wire. The servo's EEPROM lives
//! as long as the process. Positions, currents and voltages are quantised as the registers are; currents and
//! voltages carry no noise.

pub mod body;
mod bus;
pub mod camera;
pub mod conditions;
mod control_table;
mod devices;
pub mod fault;
mod fault_kinds;
mod fault_switch;
mod inertial_sensor;
pub mod ledger;
mod line;
pub mod motor;
mod options;
mod plant;
mod pty;
mod report;
mod server;
mod servo;
mod servo_table;
pub mod supply;
mod tracker;
mod virtual_port;

#[cfg(test)]
mod behaviour_tests;
#[cfg(test)]
mod device_harness;
#[cfg(test)]
mod protocol_tests;

pub use devices::{Devices, DevicesError};
pub use fault::{Fault, FaultError};
pub use fault_switch::{FaultAnswer, FaultRequest, ListedFault, ask as ask_fault_switch};
pub use ledger::PlantLedger;
pub use options::Options;
pub use plant::{DEFAULT_STEP_S, Plant};
pub use pty::{PortLink, PtyError};
pub use report::VirtualWormReport;
pub use server::{Server, ServerError, VirtualWorm};
pub use virtual_port::VirtualPort;
