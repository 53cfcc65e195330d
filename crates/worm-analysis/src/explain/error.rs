//! Why nothing can be explained, and what to do about it.

use crate::identify::GaitError;
use worm_estimator::config::PhysicsError;
use worm_physics::WormError;
use worm_physics::effect::SettingError;

/// Why nothing can be explained.
#[derive(Debug, thiserror::Error)]
pub enum ExplainError {
    /// There is no recording.
    #[error("no recording was given: list at least one [[run]]")]
    NoRun,
    /// A recording is of a worm with another number of cells.
    #[error(
        "{recording}: {found} cells, but the worm is configured with {configured}: list recordings of the configured worm, or give its own --config (worm.cells, worm.step_order)"
    )]
    Cells {
        /// The recording.
        recording: String,
        /// Cells in it.
        found: usize,
        /// Cells of the configured worm.
        configured: usize,
    },
    /// Two cells never stand still together, so their positions say too little.
    #[error(
        "a worm of two cells: no cell ever stands still in its body to measure the others by, so effects cannot be separated: at least three cells are needed"
    )]
    TwoCells,
    /// A recording shows no gait.
    #[error("{recording}: {source}")]
    IdentifiedGait {
        /// The recording.
        recording: String,
        /// What is wrong with the gait.
        source: GaitError,
    },
    /// The recordings are of worms that step in different orders.
    #[error(
        "{recording}: its cells step in the order {found:?}, those of {first} in the order {expected:?}: list recordings of one worm"
    )]
    StepOrder {
        /// The recording.
        recording: String,
        /// Its order, cells from 1.
        found: Vec<usize>,
        /// The first recording.
        first: String,
        /// Its order.
        expected: Vec<usize>,
    },
    /// Two runs are one.
    #[error("{recording}: it is a copy of {first}, sample by sample: list each recording once, with its own slope")]
    Copy {
        /// The recording.
        recording: String,
        /// The one that it is a copy of.
        first: String,
    },
    /// A recording is too short to distinguish scatter from cause.
    #[error(
        "{recording}: {cycles} whole gait cycles after the start, at least {needed} are needed to distinguish scatter from cause: record a longer run"
    )]
    TooShort {
        /// The recording.
        recording: String,
        /// Whole cycles in it that count.
        cycles: usize,
        /// What is needed.
        needed: usize,
    },
    /// Too few advances.
    #[error(
        "{found} advance alone: a recalibration explains any one figure: list the advances on at least two slopes, or recordings"
    )]
    FewAdvances {
        /// How many were given.
        found: usize,
    },
    /// An advance without a standard error, without which a gap cannot be distinguished from chance.
    #[error(
        "{recording}: it and its standard error must be known: give advance_m, and a positive advance_sigma_m, in metres"
    )]
    NoSigma {
        /// The advance.
        recording: String,
    },
    /// The current was to count, and there is none.
    #[error(
        "no recording has the motor's current with the gait phase: record with wormd, or leave the current out of the evidence"
    )]
    NoCurrent,
    /// A run was to be explained by the current alone, and has none, or no phase.
    #[error(
        "{recording}: it has neither positions that count nor the motor's current with the gait phase in nine of ten samples: record with wormd, and have the servo's current read"
    )]
    NoCurrentOfRun {
        /// The recording.
        recording: String,
    },
    /// A recording without positions, and the current was not to count.
    #[error(
        "{recording}: it holds no positions: `--current` takes what the motor's current shows as evidence, or record with a tracker that works"
    )]
    NoPositions {
        /// The recording.
        recording: String,
    },
    /// The slope is none.
    #[error("{recording}: a slope of {slope_deg}°: give -90 to 90 degrees")]
    Slope {
        /// The recording.
        recording: String,
        /// The slope given, degrees.
        slope_deg: f64,
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
    /// The configured model is none.
    #[error("the model refuses the configured worm: {0}")]
    Worm(#[from] WormError),
    /// A configured effect cannot be switched on like that.
    #[error("the configured worm: {0}")]
    Effect(#[from] SettingError),
    /// The configured model is none.
    #[error("the model refuses the configured worm: {0}")]
    Physics(#[from] PhysicsError),
    /// The model slides down where the worm was recorded crawling, whatever is recalibrated.
    #[error(
        "{recording}: the configured worm slides down a slope of {slope_deg}° on which it was recorded crawling: are slope_deg, worm.mass_kg, worm.max_deformation_m and worm.stiffness_n_per_m right?"
    )]
    SlidesDown {
        /// The recording.
        recording: String,
        /// Its slope, degrees.
        slope_deg: f64,
    },
}
