//! In words, how far and how long the battery lasts.

use super::RangeSummary;

/// Range and time with their 90 % intervals, and the charge.
pub(crate) fn text(range: &RangeSummary) -> String {
    let (time_unit, scale) = if range.time_high_s >= 7200.0 {
        ("h", 3600.0)
    } else {
        ("min", 60.0)
    };
    let distance = if range.range_m.is_finite() {
        format!(
            "{:.1} m ({:.1} to {:.1})",
            range.range_m, range.range_low_m, range.range_high_m
        )
    } else {
        format!(
            "{:.0} gait cycles, how far is not known without positions",
            range.cycles
        )
    };
    format!(
        "range  {distance}, {:.1} {time_unit} ({:.1} to {:.1}), battery {:.0} ± {:.0} %",
        range.time_s / scale,
        range.time_low_s / scale,
        range.time_high_s / scale,
        100.0 * range.charge_share,
        100.0 * range.charge_sigma_share,
    )
}
