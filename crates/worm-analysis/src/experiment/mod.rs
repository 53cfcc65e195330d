//! Section 3 of the paper on recordings: what the worm did, what it cost, and what theory says.
//!
//! # The story
//! [`analyze`] takes recordings and the conditions they were made under. [`identify`](crate::identify) finds gait, largest tip
//! deformations and the path of the worm; `energy_balance` follows the tips along that path, and books slides and energy cycle by
//! cycle; theory, of the worm found and of the worm configured, stands beside it. All of it is an [`Analysis`], which
//! [`report`](crate::report) draws and the command line prints as JSON.
//!
//! Pure: recordings in, figures out; knows of no files.

mod analysis;
mod analyze;
mod energy_balance;
mod error;
mod simulate;

pub use analysis::{
    Analysis, CycleResult, CycleValues, FirstEstimate, PaperSearch, PhaseSource, Series, Theory, TheoryCycle,
};
pub use analyze::{Progress, RecordedRun, analyze};
pub use error::AnalysisError;
pub use simulate::{Simulation, SimulationError, simulate};
