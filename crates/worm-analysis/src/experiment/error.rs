//! Why a recording cannot be analysed, and what to do about it.

use crate::identify::{FitError, GaitError};
use worm_physics::effect::SettingError;
use worm_physics::{SlidesDown, WormError};

/// Why a recording cannot be analysed.
#[derive(Debug, thiserror::Error)]
pub enum AnalysisError {
    /// There is none.
    #[error("no recording was given")]
    NoRun,
    /// The recording is of a worm with another number of cells.
    #[error(
        "{recording}: {found} cells, but the worm is configured with {configured}: give its own --config (worm.cells, worm.step_order)"
    )]
    Cells {
        /// The recording.
        recording: String,
        /// Cells in it.
        found: usize,
        /// Cells of the configured worm.
        configured: usize,
    },
    /// Neither positions nor current.
    #[error(
        "{recording}: holds neither positions nor the motor's current with its gait phase: record a worm that crawls"
    )]
    NoCurrent {
        /// The recording.
        recording: String,
    },
    /// Too few readings for the course of the torque to be seen.
    #[error(
        "{recording}: nobody saw the worm in it, and {per_step:.0} readings of the motor in a step are too few for its current to say anything: record at least {needed} (on the robot `wormd record` has every tick)"
    )]
    FewReadings {
        /// The recording.
        recording: String,
        /// Readings in a step of a cell.
        per_step: f64,
        /// How many are needed.
        needed: f64,
    },
    /// Too little of a crawl for the current to say anything.
    #[error(
        "{recording}: holds no whole gait cycle crawled forward after the first, so its current says nothing: record for longer"
    )]
    NoCycle {
        /// The recording.
        recording: String,
    },
    /// No gait was found in the recording.
    #[error("{recording}: {source}")]
    IdentifiedGait {
        /// The recording.
        recording: String,
        /// What is wrong with the gait.
        source: GaitError,
    },
    /// The positions seem to be millimetres.
    #[error(
        "{recording}: the cells step by {stroke_m:.3} m, a thousand times the configured stroke: the positions are evidently millimetres, convert them to metres"
    )]
    Millimetres {
        /// The recording.
        recording: String,
        /// The stroke seen, m.
        stroke_m: f64,
    },
    /// The stroke is not this worm's.
    #[error("{recording}: the cells step by {:.2} mm, but worm.stroke_m is {:.2} mm: is this the configured worm, and are the positions in metres?", seen_m * 1e3, configured_m * 1e3)]
    Stroke {
        /// The recording.
        recording: String,
        /// The stroke seen, m.
        seen_m: f64,
        /// The configured one, m.
        configured_m: f64,
    },
    /// The slope is none.
    #[error("{recording}: a slope of {slope_deg}°: give -90 to 90 degrees")]
    Slope {
        /// The recording.
        recording: String,
        /// The slope given, degrees.
        slope_deg: f64,
    },
    /// The payload is none.
    #[error("{recording}: a payload of {payload_kg} kg: give what the worm carried, 0 to 100 kg")]
    Payload {
        /// The recording.
        recording: String,
        /// The payload given, kg.
        payload_kg: f64,
    },
    /// The configured worm is none.
    #[error("the model refuses the configured worm: {0}")]
    Worm(#[from] WormError),
    /// A configured effect cannot be switched on.
    #[error(transparent)]
    Effect(#[from] SettingError),
    /// Nothing fits.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// The worm found cannot hold itself.
    #[error("{0}: with what was found the recorded crawl is impossible: are slope, mass and stiffness right?")]
    SlidesDown(#[from] SlidesDown),
}
