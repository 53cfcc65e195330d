//! The search for the missing effect of a machine, a plant.
//!
//! A plant ([`plant::Plant`]) predicts what was recorded of it under a hypothesis, has nuisances with priors, effects of the library that
//! its recordings can show, and bins in which its gap is localised. Nothing here knows more of it.
//!
//! # Modules, in reading order
//! - `plant`: what a plant is; `bins`: where its gap is localised; `impact`: what an effect changes of it.
//! - `parameter`: which quantities may be free, with priors; `hypothesis`: which effects act, and which quantities are free.
//! - `find`: the search, step by step; `recalibrate`: the model within the priors of its nuisances, before it.
//! - `problem`: a plant's recordings as a problem of least squares, `fit`: a solution of it; `discrepancy`: by how much a model is wrong everywhere.
//! - `score_test`: screens all effects, by their `directions`; `refit`: fits them to the end, `local_restart`: from one local minimum to
//!   another; `onset`: effects that begin in mid-run.
//! - `judge`: priors, evidence, chance and the verdict; `judgement`: weighs the candidates by them; `cross_validation`, `held_out`: held-out data,
//!   which may veto, by `folds`; `squares`: what fraction of a gap is closed there.
//! - `misstatement`: a mistake in what is stated about the recordings, `misstated`: weighed in place of a missing effect.
//! - `law`: a law that nobody listed, where no effect of the library explains the data.

pub(in crate::explain) mod bins;
pub(in crate::explain) mod cross_validation;
pub(in crate::explain) mod directions;
pub(in crate::explain) mod discrepancy;
pub(in crate::explain) mod find;
pub(in crate::explain) mod fit;
pub(in crate::explain) mod folds;
pub(in crate::explain) mod held_out;
pub(in crate::explain) mod hypothesis;
pub(in crate::explain) mod impact;
pub(in crate::explain) mod judge;
pub(in crate::explain) mod judgement;
pub(in crate::explain) mod law;
pub(in crate::explain) mod local_restart;
pub(in crate::explain) mod misstated;
pub(in crate::explain) mod misstatement;
pub(in crate::explain) mod normal_probability;
pub(in crate::explain) mod onset;
pub(in crate::explain) mod parameter;
pub(in crate::explain) mod plant;
pub(in crate::explain) mod problem;
pub(in crate::explain) mod recalibrate;
pub(in crate::explain) mod refit;
pub(in crate::explain) mod score_test;
pub(in crate::explain) mod squares;
