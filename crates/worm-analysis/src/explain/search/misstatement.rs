//! A mistake in what is stated about the recordings, as a hypothesis.

use super::hypothesis::Hypothesis;

/// Sorts of mistakes; all of a sort are equally probable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::explain) enum Sort {
    /// Conditions that are written down in a wrong way.
    Written,
    /// What is stated of one run is any.
    OfOneRun,
    /// What is the same in all runs was not in one of them.
    UnlikeOthers,
}

/// A mistake in what is stated about the recordings.
#[derive(Debug, Clone)]
pub(in crate::explain) struct Misstatement {
    pub sort: Sort,
    /// The plant's number for it.
    pub what: usize,
    /// The nuisances under the conditions that were meant.
    pub hypothesis: Hypothesis,
    /// Values from which it is fitted.
    pub start: Vec<f64>,
    /// A free quantity and the least change of it that makes this a mistake.
    pub must_differ: Option<(usize, f64)>,
}
