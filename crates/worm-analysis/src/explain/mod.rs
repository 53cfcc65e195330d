//! Where model and data disagree, which effect is missing, and what to try next.
//!
//! A model that is wrong in one place can be made to look right by being a little wrong everywhere. So the search first
//! recalibrates the model: friction, stiffness, stroke and the like are fitted within what is not known of them. What remains is the
//! gap. Each effect of the library ([`worm_physics::effect`]) is screened against it; the best are fitted to the end and compared
//! on data that they were not fitted to. An effect is named only where it does more than the best of the whole library would by
//! chance, and where what it leaves is noise. Effects that explain the data equally well stay in the answer, together with whatever
//! no positions can distinguish from them, and with the experiment that would decide.
//!
//! Pure: recordings in, an [`Answer`] out, no files. The same input and seed give the same answer, whatever the number of threads.
//!
//! # Modules, in reading order
//! - [`answer`]: the result and its JSON contract.
//! - `search`: the steps, one after the other; `prepare`: the runs, and the recalibration; `refit`: effects fitted to the end.
//! - `observed`: the recordings as the search sees them; `predict`: the positions that a `hypothesis` predicts; `residual`: what
//!   that leaves of the data; `noise`: how well the worm repeats itself.
//! - `parameter`: which quantities are free, with priors; `phase_correction`: for phases found from overlapping steps;
//!   `fit`: the campaign as a problem of least squares (`least_squares`); `local_restart`: from one local minimum to another.
//! - `score_test`: screens the whole library; `speed_droop`: the one effect that shows in time alone.
//! - `cross_validation`: held-out data; `model_selection`: the verdict.
//! - `residual_map`: where the gap is; `period`: whether it repeats; `gap`: how it shrinks; `experiment_design`: the next experiment;
//!   `words`: the answer in words.
//! - `scalar_data`: the same where only advances per cycle are known.
//! - `assemble`: puts the answer together; [`model_update`]: the model's file with the answer in it.

pub mod answer;
mod assemble;
mod cross_validation;
mod error;
mod experiment_design;
mod fit;
#[cfg(test)]
mod fixture;
mod gap;
mod hypothesis;
mod local_restart;
mod model_selection;
pub mod model_update;
mod noise;
mod observed;
mod parameter;
mod period;
mod phase_correction;
mod predict;
mod prediction;
mod prepare;
mod refit;
mod residual;
mod residual_map;
mod scalar_data;
mod score_test;
mod search;
mod speed_droop;
mod words;

pub use crate::experiment::RecordedRun;
pub use answer::{Answer, Verdict};
pub use error::ExplainError;
pub use prediction::Prediction;
pub use scalar_data::explain_advances;
pub use search::{Options, explain};
