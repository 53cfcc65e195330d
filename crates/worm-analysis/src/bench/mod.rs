//! A servo on a bench: its recordings, the campaign that lists them, and its model's file.
//!
//! - [`recording`]: what the servo reported while it moved an arm; `csv_file` reads it, `checks` refuses what is on another servo's scale.
//! - [`campaign`]: `plant = "servo-bench"`: the bench, and its recordings with the position gain of each.
//! - [`model`]: the servo's model as a file, with the effects in it.

pub mod campaign;
mod checks;
mod csv_file;
pub mod model;
pub mod recording;
#[cfg(test)]
mod tests;

pub use campaign::{BenchCampaign, BenchRun, Plant, plant_of};
pub use model::ServoModel;
pub use recording::ServoRecording;
