//! Where model and data disagree, which effect is missing, and what to try next.
//!
//! A model that is wrong in one place can be made to look right by being a little wrong everywhere. So the search first
//! recalibrates the model: friction, stiffness, stroke and the like are fitted within what is not known of them. What remains is the
//! gap. No model is quite right, so a smooth unknown discrepancy is part of the likelihood. Each effect of the library
//! ([`worm_physics::effect`]) is screened against what that leaves; the best are fitted to the end, and get posterior probabilities beside
//! none and something else. An effect is named only where it is more probable than the best of the whole library becomes by chance, and
//! changes what matters. Effects that explain the data equally well stay in the answer, together with whatever
//! no positions can distinguish from them, and with the experiment that would decide.
//!
//! Pure: recordings in, an [`Answer`] out, no files. The same input and seed give the same answer, whatever the number of threads.
//!
//! # Modules, in reading order
//! - [`answer`]: the result and its JSON contract.
//! - `recorded`: the search on recordings of a worm, from beginning to end.
//! - `search`: the search for the missing effect of any machine, a plant.
//! - `worm`: the worm as such a plant; [`servo`]: a servo on a bench, with an answer of its own.
//! - `assemble`: puts the answer together, from `residual_map`: where the gap is, `experiment_design`: the next
//!   experiment, and `words`: the answer in words.
//! - `scalar_data`: the same where only advances per cycle are known.
//! - [`model_update`]: the model's file with the answer in it; `prediction`: what a model predicts, without any search.

pub mod answer;
mod assemble;
mod error;
mod experiment_design;
#[cfg(test)]
mod fixture;
pub mod model_update;
mod prediction;
mod recorded;
mod residual_map;
mod scalar_data;
mod search;
pub mod servo;
mod words;
mod worm;

pub use crate::experiment::RecordedRun;
pub use answer::{Answer, Verdict};
pub use error::ExplainError;
pub use prediction::Prediction;
pub use recorded::explain;
pub use scalar_data::explain_advances;
pub use search::find::{Evidence, Options};
