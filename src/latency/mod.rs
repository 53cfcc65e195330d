//! How late the loop is, where each late tick's time went, and how close that comes to what the machine can do.
//!
//! In reading order:
//! - [`histogram`]: durations in histograms, and their [`Percentiles`].
//! - [`timeline`]: one tick as its parts on the clock; [`WorstTicks`], the worst ones of a run.
//! - [`tick_stats`]: the `timing` topic of a run in histograms, and how long states took to their receivers.
//! - [`outcome`]: the result of a run, as JSON shows it; [`measure`]: its durations, each with its name and its floor;
//!   [`attribution`]: what each culprit means.
//!
//! `wormd latency` measures all of it with the crate's `benchmark`, and shows it as text and as a page.

pub mod attribution;
pub mod histogram;
pub mod measure;
pub mod outcome;
#[cfg(feature = "analysis")]
pub mod page;
mod text;
pub mod tick_stats;
pub mod timeline;

pub use histogram::{Durations, Percentiles};
pub use measure::{Measure, ratio};
pub use outcome::Outcome;
pub use tick_stats::{Deliveries, HostPauses, TickStats};
pub use timeline::{Tick, WorstTicks};
