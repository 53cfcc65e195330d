//! The running median: a smoother that outliers do not move.

/// The running median over a window that shrinks at the ends.
pub(super) fn running_median(series: &[f64], window: usize) -> Vec<f64> {
    let half = window / 2;
    let mut sorted = Vec::with_capacity(window);
    (0..series.len())
        .map(|at| {
            let reach = half.min(at).min(series.len() - 1 - at);
            sorted.clear();
            sorted.extend_from_slice(&series[at - reach..=at + reach]);
            sorted.sort_by(f64::total_cmp);
            sorted[reach]
        })
        .collect()
}
