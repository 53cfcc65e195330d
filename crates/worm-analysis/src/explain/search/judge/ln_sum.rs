//! Sums of probabilities that are known by their logarithms.

/// Logarithm of a sum, from logarithms.
pub(in crate::explain) fn ln_sum(logarithms: impl IntoIterator<Item = f64> + Clone) -> f64 {
    let max = logarithms.clone().into_iter().fold(f64::NEG_INFINITY, f64::max);
    if max == f64::NEG_INFINITY {
        return max;
    }
    max + logarithms.into_iter().map(|one| (one - max).exp()).sum::<f64>().ln()
}

/// Logarithm of a mean, from logarithms; none of none.
pub(in crate::explain) fn ln_mean(logarithms: &[f64]) -> Option<f64> {
    let count = logarithms.len() as f64;
    (count > 0.0).then(|| ln_sum(logarithms.iter().copied()) - count.ln())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_of_logarithms_do_not_overflow() {
        assert!((ln_sum([-2000.0, -2000.0]) - (2.0_f64.ln() - 2000.0)).abs() < 1e-12);
        assert_eq!(ln_sum([]), f64::NEG_INFINITY);
        assert!((ln_mean(&[-2000.0, -2000.0]).expect("of two") + 2000.0).abs() < 1e-12);
        assert_eq!(ln_mean(&[]), None);
    }
}
