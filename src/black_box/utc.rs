//! The wall-clock time in names of files, and in files. Nothing is judged by it.

use std::time::{SystemTime, UNIX_EPOCH};

/// The time as `20261124T201533Z`.
pub(super) fn compact(time: SystemTime) -> String {
    let ([year, month, day], [hour, minute, second]) = parts(time);
    format!("{year:04}{month:02}{day:02}T{hour:02}{minute:02}{second:02}Z")
}

/// The time as `2026-11-24T20:15:33Z`, RFC 3339.
pub(crate) fn rfc3339(time: SystemTime) -> String {
    let ([year, month, day], [hour, minute, second]) = parts(time);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}

/// The time as `2026-11-24 20:15:33 UTC`.
pub(crate) fn readable(time: SystemTime) -> String {
    let ([year, month, day], [hour, minute, second]) = parts(time);
    format!("{year:04}-{month:02}-{day:02} {hour:02}:{minute:02}:{second:02} UTC")
}

fn parts(time: SystemTime) -> ([u64; 3], [u64; 3]) {
    // A clock before 1970 is not set.
    let seconds = time.duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
    let (days, second_of_day) = (seconds / 86_400, seconds % 86_400);
    (
        civil(days),
        [second_of_day / 3600, second_of_day / 60 % 60, second_of_day % 60],
    )
}

/// Year, month and day of the day with this number since 1970-01-01, by Howard Hinnant's `civil_from_days`
/// (<https://howardhinnant.github.io/date_algorithms.html>).
const fn civil(days: u64) -> [u64; 3] {
    let from_march = days + 719_468; // since 0000-03-01
    let era = from_march / 146_097;
    let day_of_era = from_march % 146_097;
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 {
        month_from_march + 3
    } else {
        month_from_march - 9
    };
    let year = year_of_era + era * 400 + if month <= 2 { 1 } else { 0 };
    [year, month, day]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn dates_are_those_of_the_calendar() {
        for (seconds, text) in [
            (0, "19700101T000000Z"),
            (951_782_400, "20000229T000000Z"),
            (1_732_479_333, "20241124T201533Z"),
            (4_107_542_400, "21000301T000000Z"),
        ] {
            assert_eq!(compact(UNIX_EPOCH + Duration::from_secs(seconds)), text);
        }
    }
}
