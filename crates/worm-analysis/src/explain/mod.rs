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
//! - `search`: the steps, one after the other; `prepare`: the runs, and the recalibration; `refit`: effects fitted to the end.
//! - `observed`: the recordings as the search sees them; `bins`: by cycle, step and phase; `predict`: the positions that a
//!   `hypothesis` predicts, by a `walk` from `start` along a `track`, at samples by their `clock`; `residual`: what that leaves of the data; `noise`: how well the worm repeats itself.
//! - `plant`: what the judgement needs to know of a machine; `discrepancy`: by how much the model is wrong everywhere.
//! - `parameter`: which quantities are free, with priors; `phase_correction`: for phases found from overlapping steps;
//!   `fit`: the campaign as a problem of least squares (`least_squares`); `local_restart`: from one local minimum to another.
//! - `score_test`: screens the whole library, by its `directions`; `onset`: effects that begin in mid-run; `speed_droop`: the one effect that shows in time alone.
//! - `judge`: priors, evidence, chance and the verdict, for any plant; `judgement`: weighs the candidates of a worm; `matters`: whether
//!   an effect changes what anybody asks; `cross_validation`: held-out data, which may veto.
//! - `whole_effects`: what nuisances have of an effect's law, given to the effect.
//! - `residual_map`: where the gap is; `period`: whether it repeats from cycle to cycle, `sway`: within the cycles, `wave`: how
//!   probable that is; `gap`: how it shrinks; `experiment_design`: the next experiment; `words`: the answer in words.
//! - `scalar_data`: the same where only advances per cycle are known.
//! - `assemble`: puts the answer together; [`model_update`]: the model's file with the answer in it.

pub mod answer;
mod assemble;
mod bins;
mod clock;
mod cross_validation;
mod directions;
mod discrepancy;
mod error;
mod experiment_design;
mod fit;
#[cfg(test)]
mod fixture;
mod gap;
mod hypothesis;
mod judge;
mod judgement;
mod local_restart;
mod matters;
pub mod model_update;
mod noise;
mod normal_probability;
mod observed;
mod onset;
mod pace;
mod parameter;
mod period;
mod phase_correction;
mod plant;
mod predict;
mod predicted;
mod prediction;
mod prepare;
mod refit;
mod residual;
mod residual_map;
mod scalar_data;
mod score_test;
mod search;
mod speed_droop;
mod start;
mod sway;
mod track;
mod walk;
mod wave;
mod whole_effects;
mod words;

pub use crate::experiment::RecordedRun;
pub use answer::{Answer, Verdict};
pub use error::ExplainError;
pub use prediction::Prediction;
pub use scalar_data::explain_advances;
pub use search::{Options, explain};
