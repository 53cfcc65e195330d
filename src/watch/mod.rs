//! What a person sees of a running worm: the telemetry gathered into one picture, a terminal view, and the summary at the
//! end.
//!
//! [`Telemetry`] takes the messages of the topics as they come, whoever reads them; [`view::draw`] paints it, and
//! [`Summary`] is what remains of it, as text and as the JSON that scripts read.

pub(crate) mod mismatch;
mod summary;
mod telemetry;
pub mod view;

pub use summary::{AlarmSummary, CycleSummary, PlaceSummary, Summary, TimingSummary, remarks};
pub use telemetry::Telemetry;

#[cfg(test)]
mod tests;
