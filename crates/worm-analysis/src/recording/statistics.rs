//! Order statistics of the seen values: a lost, swapped or stray marker hardly changes them.

/// The value below which a `fraction` of the seen values lies; `NaN` values are not seen. `None` where nothing was seen.
pub(super) fn quantile(values: impl IntoIterator<Item = f64>, fraction: f64) -> Option<f64> {
    quantiles(values, [fraction]).map(|[value]| value)
}

/// Several quantiles at once, as [`quantile`].
pub(super) fn quantiles<const N: usize>(
    values: impl IntoIterator<Item = f64>,
    fractions: [f64; N],
) -> Option<[f64; N]> {
    let mut seen: Vec<f64> = values.into_iter().filter(|value| !value.is_nan()).collect();
    let last = seen.len().checked_sub(1)?;
    Some(fractions.map(|fraction| {
        let index = (fraction * last as f64).round() as usize;
        *seen.select_nth_unstable_by(index.min(last), f64::total_cmp).1
    }))
}

/// Range of the middle nine tenths of the seen values; 0 where nothing was seen.
pub(super) fn spread(values: impl IntoIterator<Item = f64>) -> f64 {
    quantiles(values, [0.05, 0.95]).map_or(0.0, |[low, high]| high - low)
}

/// Standard deviation of the noise on a series, from the second differences of neighbours that were all seen: steady motion
/// cancels in them, and their median is not affected by the few samples at which a step begins or ends.
pub(super) fn noise(values: &[f64]) -> f64 {
    // Median of |x| is 0.6745 σ, and a second difference carries √6 times the noise of one value.
    const MEDIAN_TO_SIGMA: f64 = 0.674_49 * 2.449_49;
    let differences = values
        .windows(3)
        .map(|window| (window[0] - 2.0 * window[1] + window[2]).abs());
    quantile(differences, 0.5).unwrap_or(0.0) / MEDIAN_TO_SIGMA
}

/// A series that spreads less than this many times its noise stands still: noise alone spreads 3.3 times.
const STILL_NOISE: f64 = 5.0;
/// A series that spreads less than this stands still, m: half the smallest stroke that a worm may have.
const STILL_M: f64 = 5e-5;

/// Whether a series of positions, m, moves beyond its noise.
pub(super) fn moves(series: &[f64]) -> bool {
    spread(series.iter().copied()) > STILL_M.max(STILL_NOISE * noise(series))
}

#[cfg(test)]
mod tests;
