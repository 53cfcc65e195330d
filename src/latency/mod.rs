//! How late the loop is, and where each late tick's time went.
//!
//! In reading order:
//! - [`histogram`]: durations in histograms, and their [`Percentiles`].
//! - [`timeline`]: one tick as its parts on the clock; [`WorstTicks`], the worst ones of a run.
//! - [`account`]: what the `timing` topic tells of a run, and how long states took to whoever received them.

pub mod account;
pub mod histogram;
pub mod timeline;

pub use account::{Account, Deliveries};
pub use histogram::{Durations, Percentiles};
pub use timeline::{Tick, WorstTicks};
