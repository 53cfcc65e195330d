//! Where model and data disagree, which effect is missing, and what to try next.
//!
//! # The story
//! A model that is wrong in one place can be made to look right by being a little wrong everywhere, so the search begins by
//! recalibrating it: friction, stiffness, stroke and the like are fitted within what is honestly not known of them. What is then
//! left is the gap. Each effect of the library ([`worm_physics::effect`]) is tried on it; the best are fitted to the end and
//! compared by what they say of data that they were not fitted to. An effect is named only where it does more than the best of
//! the whole library would by chance, and where what it leaves is noise; what explains the data equally well stays in the answer,
//! with everything that no positions could tell from it, and with the experiment that would decide.
//!
//! Pure: recordings in, an [`Answer`] out; knows of no files. The same input and seed give the same answer.
//!
//! # The map, in reading order
//! - [`answer`]: what comes out, the JSON contract.
//! - `search`: the steps, one after the other.
//! - `observed`: the recordings as the search sees them; `noise`: how well the worm repeats itself.
//! - `parameter`: what may be turned, with priors; `predict`: what a hypothesis says of every sample;
//!   `phase_correction`: where the phase was read off overlapping steps; `fit`: least squares; `local_restart`:
//!   from one valley of it to another.
//! - `score_test`: the whole library at a glance; `speed_droop`: the one effect that shows in time alone.
//! - `cross_validation`: data left out; `model_selection`: the rules of the judgement.
//! - `residual_map`: where the gap is; `period`: whether it comes back; `gap`: how it shrinks; `experiment_design`: the next experiment; `words`: the answer in words.
//! - `scalar_data`: the same where only advances per cycle are known.
//! - `assemble`: all of it put together; [`model_update`]: the model's file with the answer in it.

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
