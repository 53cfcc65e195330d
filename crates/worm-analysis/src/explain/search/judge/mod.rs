//! The judgement: how probable each hypothesis is, none and something else among them.
//!
//! - `candidate`: a fitted effect, or a pair.
//! - `prior`: what is expected of an effect before the data are seen.
//! - `evidence`: the probability of the data under a hypothesis.
//! - `beside`: the evidence for what the residual of a fit may hold beside it.
//! - `structural_change`: the evidence that something changes in the middle of a run.
//! - `repetition`: the evidence that something repeats after some cycles.
//! - `chance`: how large the evidence for the best of the library becomes where there is none.
//! - `ln_sum`: sums of probabilities by their logarithms.
//! - `decision`: the posterior, and the verdict.
//! - `stated_probability`: what a posterior probability is worth, by the test beds.

mod beside;
pub(in crate::explain) mod candidate;
pub(in crate::explain) mod chance;
pub(in crate::explain) mod decision;
pub(in crate::explain) mod evidence;
pub(in crate::explain) mod ln_sum;
pub(in crate::explain) mod prior;
mod repetition;
mod stated_probability;
pub(in crate::explain) mod structural_change;
