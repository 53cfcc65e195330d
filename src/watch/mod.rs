//! A running worm for people to watch: its telemetry, a terminal view of it, and the summary at the end.
//!
//! [`Telemetry`] gathers the messages of the topics, whoever reads them; [`view::draw`] paints it, and [`Summary`] sums it up
//! as text and as the JSON that scripts read.

pub(crate) mod mismatch;
pub(crate) mod range;
mod recent;
pub(crate) mod recording;
mod summary;
mod telemetry;
pub mod view;

pub use recent::Recent;
pub use summary::{AlarmSummary, CycleSummary, PlaceSummary, RangeSummary, Summary, TimingSummary, remarks};
pub use telemetry::Telemetry;

#[cfg(test)]
mod tests;
