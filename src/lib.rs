//! `wormd`: a shared-memory real-time controller and telemetry daemon for an untethered earthworm robot.
//!
//! A real-time loop commands the worm's actuator over a serial bus at a fixed rate and publishes each tick on shared-memory
//! topics. An estimator process computes from them, while the worm crawls, what each gait cycle costs and whether the worm is
//! stuck. The science is Zarrouk, Sharf and Shoham 2016, "Energetic analysis and experiments of earthworm-like locomotion with
//! compliant surfaces"; equation numbers in these docs are theirs.
//!
//! # Data flow
//!
//! ```text
//!   config ──► everything
//!
//!   worm ◄─serial─► link ◄──► control ──► topics ──► estimator ──► topics ──► relay, Python, C
//!                    ▲           ▲                      │  ▲           │
//!         link::virtual_worm     └───── alarms ─────────┘  │           └──► alarms back to control
//!                    ▲                                     │
//!               worm-physics ──────── prediction ──────────┘
//!
//!   timing topic ──► latency, compared with a bare sleeper and a bare publisher ──► page
//!   topics ──► recorder ──► log (MCAP) ──► estimator again: the same results to the last bit
//!   recording (MCAP, CSV, C3D, Vicon) ──► worm-analysis: identify ──► experiment ──► report
//!                                    └──► worm-analysis: explain ──► report, and the model with the missing effect
//! ```
//!
//! # The workspace
//! This crate is the daemon: everything that touches devices, clocks, threads and shared memory. The other crates are pure but for
//! the files that they read and write:
//!
//! | crate | contents | depends on |
//! |---|---|---|
//! | `worm-physics` | the exact motion and one for any friction law, its energy, the steady cycle, the design study, effects beyond the paper's theory | |
//! | `dynamixel-bus` | DYNAMIXEL Protocol 2.0: packets, the bus, serial ports, a fault injector | |
//! | `worm-estimator` | configuration (one TOML file), messages (one plain type per topic), the estimator and its alarms | `worm-physics` |
//! | `worm-log` | the topics as an MCAP log, its replay through the estimator, and tables of it (feature `tables`) | `worm-estimator` |
//! | `worm-plan` | trips on a battery: what a route costs, where it fails, the best design for it; the decisions on the way, and where a silent worm is | `worm-estimator` |
//! | `worm-analysis` | recordings in every format; gait and parameters from positions; the paper's experiment; the search for a missing effect; reports. The feature `analysis` | `worm-log`, `worm-plan` |
//!
//! # The modules, bottom up
//! | module | contents | uses |
//! |---|---|---|
//! | [`realtime`] | what a process requests from the operating system, what it really gets, how the computer is set up for it | |
//! | [`topics`] | iceoryx2: one namespace per worm, publishers, subscribers, the command service, the guard at start-up | |
//! | [`link`] | the servo and the tracker on the bus; [`link::virtual_worm`] simulates both | |
//! | [`attendance`] | the pipe from a parent, the stop socket, and what a service manager learns | `topics`, `realtime` |
//! | [`control`] | the pure tick with its state machine and safety rules, and the loop that gives it deadlines | `link`, `topics`, `realtime`, `attendance` |
//! | `estimator` | the process around the estimator | `topics`, `realtime` |
//! | `recorder` | the process that logs the topics | `topics` |
//! | `black_box` | the moments around alarms and faults, and a thin log of the rest; its files, for who lists and copies them | `recorder` |
//! | [`latency`] | durations in histograms, where each tick's time went, the page about it | |
//! | [`watch`] | telemetry of a running worm: gathered, as a live display fed by the relay, as a summary | `latency` |
//! | `trip` | the process that makes a trip: the topics into the guide of `worm-plan`, its commands to the controller | `topics`, `supervisor` |
//! | `relay` | one process that serves all watchers: history, frames, commands, one driver at a time | `topics`, `watch`, `supervisor` |
//! | `dashboard` | the worm in a browser: an HTTP server between the relay and any number of pages. The feature `dashboard` | `relay`, `watch` |
//! | `foxglove` | the topics live in Foxglove: what a recorder reads, over a WebSocket. The feature `foxglove` | `recorder` |
//! | `bridge` | worms over a network: the relay's language by Zenoh. The feature `bridge` | `relay`, `watch` |
//! | `supervisor` | a worm's processes under one parent: start, command, observe, end | `topics`, `watch` |
//! | `calibration` | slow turns of a running worm, for the friction of its gears | `topics`, `supervisor` |
//! | `benchmark` | the measurement of `wormd latency` | `supervisor`, `estimator`, `control`, `latency` |
//! | [`servo_bench`] | recordings of a servo that moves an arm on a bench, through the link | `link` |
//! | [`soak`] | many hours in virtual time with drawn worms and faults, and the session that the tests in virtual time use | `link`, `control` |
//! | `preflight` | the checks of `wormd check` | `control`, `topics`, `realtime` |
//! | [`why`] | why a worm stopped: the first reason, the events before it, the remedy, from any log | `black_box` |
//! | `bundle` | everything that support needs, in one archive | `black_box`, `preflight` |
//! | [`command`] | one file per subcommand: arguments in, one library call, exit code out | all |
//!
//! `logging`, `print`, `remedy`, `syslog` and `failure` are small helpers: summed log messages, output that never panics, what to do about an alarm,
//! the computer's log, errors with an exit status.
//!
//! # Rules
//! - The core is pure and takes time as an argument: [`control::Controller`], [`worm_estimator::estimate::Observer`],
//!   [`worm_physics::Motion`] and the virtual worm run in virtual time in the tests, thousands of times faster than the worm.
//! - Bytes and valid values have different types: [`link::packet`] handles bytes, [`link::ServoReading`] is a value.
//! - A tick allocates only what iceoryx2 needs for a loan, logs nothing, and waits only for the bus. Its system calls are the
//!   sleep, the port, and the event that wakes listeners; a late tick also reads the kernel's counters to find the cause.
//! - Names carry SI units: `stroke_m`, `energy_j`. People read millimetres, millijoules and degrees.
//! - Faults are injected by a wrapper, never by an `if` in the product.

pub mod attendance;
mod benchmark;
mod black_box;
#[cfg(feature = "bridge")]
mod bridge;
mod bundle;
mod calibration;
pub mod command;
pub mod control;
#[cfg(feature = "dashboard")]
mod dashboard;
mod estimator;
mod failure;
#[cfg(feature = "foxglove")]
mod foxglove;
pub mod latency;
pub mod link;
mod logging;
mod preflight;
mod print;
pub mod realtime;
mod recorder;
mod relay;
mod remedy;
pub mod servo_bench;
pub mod soak;
mod supervisor;
mod syslog;
pub mod topics;
mod trip;
pub mod watch;
pub mod why;
