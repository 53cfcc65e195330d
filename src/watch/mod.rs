//! A running worm for people to watch: its telemetry, a terminal view of it, and the summary at the end.
//!
//! [`Telemetry`] gathers the messages of the topics, and [`Summary`] sums it up as text and as the JSON that scripts read. The live
//! display knows the worm from its relay: `picture` has what was sent, `ghost` where the worm is while nothing comes, `app` is the screen with
//! its keys, `view` paints it. The dashboard uses the same `picture` and the same words.

pub(crate) mod alarm_text;
pub(crate) mod app;
pub(crate) mod breakdown;
mod delay;
pub(crate) mod fault;
mod ghost;
pub(crate) mod inferred;
pub(crate) mod mismatch;
pub(crate) mod picture;
pub(crate) mod range;
mod recent;
pub(crate) mod recording;
mod summary;
mod telemetry;
mod view;

pub use inferred::{ArmedChanges, InferredSummary};
pub use recent::Recent;
pub use summary::{AlarmSummary, CycleSummary, PlaceSummary, RangeSummary, Summary, TimingSummary, remarks};
pub use telemetry::Telemetry;

#[cfg(test)]
mod tests;
