//! How probable a wave is beside scatter of unknown size.
//!
//! With ν values beyond their means, of which k coefficients of waves take the fraction R² of the square sum, and a prior on these that is
//! worth one of g values (Zellner's g-prior), the Bayes factor is (1 + g)^((ν − k)/2) (1 + g (1 − R²))^(−ν/2) (Liang et al. 2008).

/// Logarithm of the Bayes factor of `waves` coefficients of waves that take a fraction of the square sum of values with `free` degrees of
/// freedom, with a prior that is worth as many of them as `worth` says.
pub(in crate::explain) fn ln_bayes_of_fraction(fraction: f64, free: f64, waves: f64, worth: f64) -> f64 {
    let left = worth * (1.0 - fraction).max(0.0);
    0.5 * (free - waves) * worth.ln_1p() - 0.5 * free * left.ln_1p()
}
