//! Section 3 of the paper on recordings: what the worm did, the energy it took, and what theory predicts.
//!
//! [`analyze`] takes recordings and the conditions under which they were made. [`identify`](crate::identify) finds gait, largest tip
//! deformations and the path of the worm; `energy_balance` follows the tips along that path and sums up slides and energy cycle by
//! cycle. The steady cycles of the identified and of the configured worm stand beside it. The result is an [`Analysis`], which
//! [`report`](crate::report) draws and the command line prints as JSON. Where nobody saw the worm, [`analyze_by_current`] goes by its motor.
//!
//! Pure: recordings in, figures out, no files.

mod analysis;
mod analyze;
mod by_current;
mod energy_balance;
mod error;
mod simulate;
mod torque;

pub use analysis::{
    Analysis, CycleResult, CycleValues, FirstEstimate, PaperSearch, PhaseSource, Series, Theory, TheoryCycle,
};
pub use analyze::{Progress, RecordedRun, analyze};
pub use by_current::{AnalysisByCurrent, CycleByCurrent, NominalTheory, analyze_by_current};
pub use error::AnalysisError;
pub use simulate::{Simulation, SimulationError, simulate};
pub use torque::TorqueProfile;
