//! In words, how far and how long the battery lasts.

use super::RangeSummary;

/// The unit that fits the time, and its seconds.
fn time_unit(range: &RangeSummary) -> (&'static str, f64) {
    if range.time_high_s >= 7200.0 {
        ("h", 3600.0)
    } else {
        ("min", 60.0)
    }
}

/// Range and time, their 90 % intervals alone: `24.1 to 27.3 m, 55 to 63 min`.
pub(crate) fn brief(range: &RangeSummary) -> String {
    let (unit, scale) = time_unit(range);
    let digits = usize::from(unit == "h");
    let distance = match range.range_m.is_finite() {
        true => format!("{:.1} to {:.1} m", range.range_low_m, range.range_high_m),
        false => format!("{:.0} gait cycles", range.cycles),
    };
    let (low, high) = (range.time_low_s / scale, range.time_high_s / scale);
    format!("{distance}, {low:.digits$} to {high:.digits$} {unit}")
}

/// The charge that is left: `battery 99 %`.
pub(crate) fn charge(range: &RangeSummary) -> String {
    format!("battery {:.0} %", 100.0 * range.charge_share)
}

/// Range and time with their 90 % intervals, and the charge.
pub(crate) fn text(range: &RangeSummary) -> String {
    let (time_unit, scale) = time_unit(range);
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
