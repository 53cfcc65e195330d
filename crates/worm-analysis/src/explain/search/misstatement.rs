//! A mistake in what is stated about the recordings, as a hypothesis.

use super::hypothesis::Hypothesis;

/// A mistake in what is stated about the recordings.
#[derive(Debug, Clone)]
pub(in crate::explain) struct Misstatement {
    /// The plant's number for it.
    pub what: usize,
    /// The nuisances under the conditions that were meant.
    pub hypothesis: Hypothesis,
    /// Values from which it is fitted.
    pub start: Vec<f64>,
    /// A free quantity and the least change of it that makes this a mistake.
    pub must_differ: Option<(usize, f64)>,
}
