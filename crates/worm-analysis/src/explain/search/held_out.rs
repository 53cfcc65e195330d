//! How a hypothesis does on data held out, as [`super::cross_validation`] finds it.

use super::fit::FitWithout;

/// How a hypothesis does on data that it was not fitted to.
#[derive(Debug, Clone)]
pub(in crate::explain) struct HeldOut {
    /// The score, as a chi-squared: mean over the partitions.
    pub chi_squared: f64,
    /// The refit without each fold.
    pub fits: Vec<FitWithout>,
    /// For each fold, whether what stays determines the severities of all effects: where it does not, because an effect began in what is
    /// left out, the refit says nothing about what the effect does there.
    pub determined: Vec<bool>,
}

impl HeldOut {
    /// The refits of one's own and of another's same folds, where what stays determines one's own effects.
    pub fn determined_beside<'h>(&'h self, other: &'h Self) -> (Vec<&'h FitWithout>, Vec<&'h FitWithout>) {
        let pairs = self.fits.iter().zip(&other.fits).zip(&self.determined);
        pairs
            .filter(|(_, determined)| **determined)
            .map(|(pair, _)| pair)
            .unzip()
    }
}
