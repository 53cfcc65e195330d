//! Why a worm stopped: the first reason, what led there, and what to do, from any log or box.
//!
//! Everything is ordered and judged by `CLOCK_MONOTONIC`; the wall clock only says when it was.
//!
//! # Modules, in reading order
//! - [`timeline`]: what happened in a log, event by event. Pure.
//! - [`stops`]: where the worm stopped, and by what. Pure.
//! - [`answer`]: what the answer consists of. Its JSON names are a contract.
//! - `alarm`: the alarm that a log is about. Pure.
//! - [`explanation`]: all together, with the remedy. Pure.
//! - `newest_stop`: which box has one. `text`: for the terminal; `page`: for a browser, with the feature `analysis`.
//! - `last_cycles`: what `explain` makes of the gait cycles before it, with the feature `analysis`.

mod alarm;
pub mod answer;
pub mod explanation;
#[cfg(feature = "analysis")]
pub(crate) mod last_cycles;
pub(crate) mod newest_stop;
#[cfg(feature = "analysis")]
pub(crate) mod page;
pub mod stops;
pub(crate) mod text;
pub mod timeline;

pub use answer::{Explanation, Trigger};
pub use explanation::explain_stop;
