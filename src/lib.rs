//! `wormd`: a shared-memory real-time controller and telemetry daemon for an untethered earthworm robot.
//!
//! This is the map of the house. A real-time loop commands the worm's actuator over serial at a fixed rate and publishes what
//! it sees on shared-memory topics; an estimator process beside it knows, while the worm crawls, what each gait cycle
//! costs and whether the worm is stuck. The science is Zarrouk, Sharf and Shoham 2016, "Energetic analysis and
//! experiments of earthworm-like locomotion with compliant surfaces"; equation numbers in these pages are theirs.
//!
//! # How data flows
//!
//! ```text
//!   config ──► everything
//!
//!   worm ◄─serial─► link ◄──► control ──► topics ──► estimate ──► topics ──► watch, Python, C
//!                    ▲           ▲                      │  ▲          │
//!         link::virtual_worm     └───── alarms ─────────┘  │          └──► alarms back to control
//!                    ▲                                     │
//!                  model ──────────── prediction ──────────┘
//!
//!   timing ──► latency, held against a bare sleeper and a bare publisher ──► report
//!   topics ──► recording (MCAP) ──► estimate once more: the same results to the last bit
//!   recording (MCAP, CSV, C3D, Vicon) ──► identify ──► experiment ──► report
//!            └───────────────────────────────► explain ──► report, and the model with the missing effect in it
//! ```
//!
//! # The rooms, in reading order
//! | room | what lives there | knows nothing of |
//! |---|---|---|
//! | [`config`] | what a worm is and how it is run: one TOML file, checked once, then trusted | all but the names of alarms and effects |
//! | [`message`] | what the processes say to each other: one plain type per topic | all |
//! | [`model`] | pure physics: the exact motion and one for any law, its energy, the steady cycle, the design study; [`model::effect`] has what the paper's theory leaves out | clocks, files, serial, topics |
//! | [`link`] | DYNAMIXEL Protocol 2.0: packets, the bus, servo and tracker; [`link::virtual_worm`] is the other end | control, topics |
//! | [`control`] | the pure tick with its state machine and safety rules, and the loop that gives it deadlines | estimate |
//! | [`topics`] | iceoryx2: one namespace per worm, publishers, subscribers, the command service, the guard at start-up | control, estimate |
//! | [`estimate`] | pure and streaming: contact points, deformation, energy, cycles, alarms; one code live and on a recording | clocks, files, topics |
//! | [`recording`] | logs of the topics, and recordings of cell positions in every format; the replay through the estimator | control |
//! | [`identify`] | gait, largest tip deformations and mass from positions alone: section 3.2 of the paper | files, topics, serial |
//! | [`experiment`] | section 3 on recordings: slides, forces, energy by two methods, theory beside them; recordings from the model | files, topics, serial |
//! | [`explain`] | where model and recordings disagree, which effect is missing, and what to try next | files, topics, serial |
//! | [`latency`] | durations in histograms, the account of where each tick's time went, the floor of machine and transport that it is held against | explain, serial |
//! | [`watch`] | what a person sees: telemetry gathered, the picture in the terminal, the summary | control, serial |
//! | [`report`] | what a person looks at afterwards: the pages with figures and tables, of an experiment, of the search for the missing effect and of the loop's latency, and CSV | control, serial |
//! | [`logging`] | how often what recurs is logged | all |
//! | [`realtime`] | what a process asks of the operating system, what it really has, and how the computer is set for it | everything but config |
//! | [`command`] | one file per subcommand: arguments in, one library call, exit code out | |
//!
//! # Rules of the house
//! - The core is pure and takes time as an argument: [`control::Controller`], [`estimate::Observer`], [`model::Motion`] and the
//!   physics of the virtual worm run in virtual time in the tests, thousands of times faster than the worm.
//! - Bytes and valid values are different types: [`link::packet`] knows bytes, [`link::ServoReading`] is a value.
//! - A tick allocates nothing but what iceoryx2 takes for a loan, logs nothing, waits for nothing but the bus, and calls the system for
//!   nothing but its sleep, the port and the event that wakes who listens. A late one also asks the kernel who is to blame.
//! - SI units stand in the names: `stroke_m`, `energy_j`. People read millimetres, millijoules and degrees.
//! - Faults are injected by a wrapper, never by an `if` in the product.

mod benchmark;
pub mod command;
pub mod control;
mod estimator;
mod failure;
pub mod latency;
pub mod link;
pub mod logging;
mod preflight;
mod print;
pub mod realtime;
mod recorder;
mod supervisor;
pub mod topics;
pub mod watch;
