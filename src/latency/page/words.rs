//! Durations and ratios as people read them.

use worm_estimator::number::{fixed, significant};

/// Shown where nothing was measured.
pub(super) const NOT_MEASURED: &str = "not measured";

/// From here on, in µs, a duration is shown in milliseconds.
const MILLISECONDS: f64 = 10_000.0;

/// A duration with three digits, and its unit.
pub(super) fn duration(us: f64) -> (String, &'static str) {
    if us >= MILLISECONDS {
        (significant(us * 1e-3, 3), "ms")
    } else {
        (significant(us, 3), "µs")
    }
}

/// The same as one text.
pub(super) fn with_unit(us: f64) -> String {
    let (value, unit) = duration(us);
    format!("{value} {unit}")
}

/// A duration in a column of µs.
pub(super) fn us(us: f64) -> String {
    fixed(us, 1)
}

/// A ratio.
pub(super) fn times(ratio: Option<f64>) -> String {
    fixed(ratio.unwrap_or(f64::NAN), 2)
}
