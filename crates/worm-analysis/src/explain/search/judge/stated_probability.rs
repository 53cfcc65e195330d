//! What a posterior probability is worth: how often the test beds show what no posterior probability can know.
//!
//! An effect that recalibration imitates looks like nothing, and one that does not follow its law looks like something else. How often
//! that happens was counted on 60 answers of both test beds' development splits. It changes no verdict, only what is stated.

use super::decision::Selected;
use super::prior::{NONE, OTHER, PAIR, SINGLE};

/// Fraction of what matters (an effect, a pair, something else) of which nothing is left to see once the model is recalibrated: of 37 worms
/// that had something which matters, 4 were taken for agreement.
const HIDDEN: f64 = by_succession(4.0, 37.0);
/// Fraction of what is something else that is found to be so: 7 of 8.
const FOUND: f64 = by_succession(7.0, 8.0);
/// Fraction of the library's own effects that look like something else, for they do not always follow its laws: 2 of 29.
const UNLIKE: f64 = by_succession(2.0, 29.0);

/// Laplace's rule of succession: the probability that it happens the next time.
const fn by_succession(hits: f64, of: f64) -> f64 {
    (hits + 1.0) / (of + 2.0)
}

impl Selected {
    /// Probability that nothing which matters is missing, counting what recalibration can hide.
    pub fn null_probability(&self) -> f64 {
        self.null_probability * (NONE / (NONE + HIDDEN * (1.0 - NONE)))
    }

    /// Probability that something is missing that is no effect of the library, counting effects that are unlike their laws.
    pub fn other_probability(&self) -> f64 {
        self.other_probability * (OTHER * FOUND / (OTHER * FOUND + UNLIKE * (SINGLE + PAIR)))
    }

    /// Probability of what can be distinguished from nothing.
    pub fn visible_probability(&self) -> f64 {
        1.0 - self.null_probability
    }
}
