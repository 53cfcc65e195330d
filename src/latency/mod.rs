//! How late the loop is, where each late tick's time went, and how near that comes to what the machine can do.
//!
//! In reading order:
//! - [`histogram`]: durations in histograms, and their [`Percentiles`].
//! - [`timeline`]: one tick as its parts on the clock; [`WorstTicks`], the worst ones of a run.
//! - [`tick_stats`]: what the `timing` topic tells of a run, and how long states took to whoever received them.
//! - [`ipc_baseline`] and [`floor`]: what the machine and iceoryx2 can do at best, measured beside the loop.
//! - [`stress`]: a load beside it.
//! - [`outcome`]: what a run has found, as JSON shows it; [`measure`]: its durations, each with its name and its floor;
//!   [`attribution`]: what each culprit means.
//!
//! `wormd latency` puts them together.

pub mod attribution;
pub mod floor;
pub mod histogram;
pub mod ipc_baseline;
pub mod measure;
pub mod outcome;
#[cfg(feature = "analysis")]
pub mod page;
pub mod stress;
pub mod tick_stats;
pub mod timeline;

pub use histogram::{Durations, Percentiles};
pub use measure::{Measure, ratio};
pub use outcome::Outcome;
pub use tick_stats::{Deliveries, HostPauses, TickStats};
pub use timeline::{Tick, WorstTicks};
