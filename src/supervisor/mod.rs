//! A worm's processes under one parent, `wormd up` or `wormd latency`: starting and ending them in order, giving the controller
//! commands, reading the telemetry.
//!
//! - [`child_process`]: one process, its readiness, its log and its end.
//! - [`controller`]: commands to the controller, and why it refuses one.
//! - [`telemetry_receiver`]: all topics of the worm, read into one [`Telemetry`](crate::watch::Telemetry).
//! - [`processes`]: the processes of `wormd up`.
//! - [`attend`]: a crawl that lasts as long as a process in the foreground attends to it.
//! - [`takeover`]: ends what a killed parent has left running.
//! - [`crawl`]: one run: crawl, show, stop.

pub(crate) mod attend;
pub(crate) mod child_process;
pub(crate) mod controller;
pub(crate) mod crawl;
pub(crate) mod processes;
pub(crate) mod takeover;
pub(crate) mod telemetry_receiver;
