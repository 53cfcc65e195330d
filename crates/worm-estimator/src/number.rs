//! Numbers as text: with as many digits as their error justifies.

/// Text for a missing value.
pub const NONE: &str = "—";

/// Most additional decimals for a small error.
const MORE_DECIMALS: usize = 1;

/// Most values that a sentence lists.
const MAX_LISTED: usize = 6;

/// A value with a fixed number of decimals and a true minus sign; [`NONE`] where it is not finite.
pub fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return NONE.to_owned();
    }
    let text = format!("{:.decimals$}", value.abs());
    let is_zero = text.bytes().all(|byte| matches!(byte, b'0' | b'.'));
    if value < 0.0 && !is_zero {
        format!("−{text}")
    } else {
        text
    }
}

/// A value with at most two decimals and no trailing zeros: `1000`, `0.25`.
pub fn shortest(value: f64) -> String {
    let text = fixed(value, 2);
    match text.split_once('.') {
        Some(_) => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        None => text,
    }
}

/// A value and its error: `2.00 ± 0.02`, with `decimals`, or with one more if the error needs it; a still smaller error is written as
/// `± <0.001`. Without a usable error the value alone.
pub fn with_error(value: f64, error: f64, decimals: usize) -> String {
    if !value.is_finite() || !error.is_finite() || error <= 0.0 {
        return fixed(value, decimals);
    }
    let wanted = (-error.log10().floor()).max(0.0) as usize;
    let decimals = wanted.clamp(decimals, decimals + MORE_DECIMALS);
    let shown = fixed(error, decimals);
    let smallest = 0.1f64.powi(decimals as i32);
    if error < 0.5 * smallest {
        return format!("{} ± <{}", fixed(value, decimals), fixed(smallest, decimals));
    }
    format!("{} ± {shown}", fixed(value, decimals))
}

/// A value and its error with two digits of the error: `0.620 ± 0.018`. Without a usable error the value alone, with three
/// digits.
pub fn to_error(value: f64, error: f64) -> String {
    if !error.is_finite() || error <= 0.0 {
        return significant(value, 3);
    }
    let decimals = decimals_for(error, 2);
    if value.is_finite() {
        format!("{} ± {}", fixed(value, decimals), fixed(error, decimals))
    } else {
        NONE.to_owned()
    }
}

/// A value with so many significant digits, and no exponent.
pub fn significant(value: f64, digits: usize) -> String {
    fixed(value, decimals_for(value, digits))
}

/// Most decimals that anything is shown with.
const MAX_DECIMALS: f64 = 6.0;

fn decimals_for(value: f64, digits: usize) -> usize {
    if value == 0.0 || !value.is_finite() {
        return digits.saturating_sub(1);
    }
    (digits as f64 - 1.0 - value.abs().log10().floor()).clamp(0.0, MAX_DECIMALS) as usize
}

/// A fraction as a percentage; near 0 and 100 % it shows that it is neither.
pub fn percent(fraction: f64) -> String {
    let percent = 100.0 * fraction;
    match percent {
        _ if 0.0 < percent && percent < 0.1 => "<0.1 %".to_owned(),
        _ if 99.9 < percent && percent < 100.0 => ">99.9 %".to_owned(),
        _ if !percent.is_finite() => NONE.to_owned(),
        _ if percent.abs() < 1.0 || (99.0 < percent && percent < 100.0) => format!("{} %", fixed(percent, 1)),
        _ => format!("{} %", fixed(percent, 0)),
    }
}

/// A list in words: `a, b and c`.
pub fn in_words(parts: &[String]) -> String {
    match parts {
        [] => String::new(),
        [only] => only.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// A few values in words, all of them: `1.90, 1.04 mm`; the range of many: `1.04 to 2.15 mm`.
pub fn list_or_range(values: &[f64], decimals: usize, unit: &str) -> String {
    let listed = |values: &[f64]| values.iter().map(|value| fixed(*value, decimals)).collect::<Vec<_>>();
    if values.len() <= MAX_LISTED {
        return format!("{} {unit}", listed(values).join(", "));
    }
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let ends = [
        finite().fold(f64::INFINITY, f64::min),
        finite().fold(f64::NEG_INFINITY, f64::max),
    ];
    format!("{} {unit}", listed(&ends).join(" to "))
}

/// A count with its noun: `1 cycle`, `12 cycles`.
pub fn count(number: usize, noun: &str) -> String {
    format!("{number} {noun}{}", if number == 1 { "" } else { "s" })
}

/// The mean of the finite values; `NaN` where there is none.
pub fn mean(values: &[f64]) -> f64 {
    let finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    finite.iter().sum::<f64>() / finite.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_error_gives_one_more_decimal_and_no_more() {
        for (error, text) in [(0.26, "59.8 ± 0.3"), (0.026, "59.78 ± 0.03"), (0.0026, "59.78 ± <0.01")] {
            assert_eq!(with_error(59.779, error, 1), text);
        }
    }

    #[test]
    fn numbers_are_rounded_to_what_their_error_leaves() {
        for (value, error, text) in [
            (2.0, 0.02, "2.00 ± 0.02"),
            (2.0, 0.0049, "2.000 ± 0.005"),
            (54.88, 1.24, "54.88 ± 1.24"),
            (-0.001, 0.05, "0.00 ± 0.05"),
            (-1.7, 0.05, "−1.70 ± 0.05"),
            (1234.0, 50.0, "1234.00 ± 50.00"),
            (2.0, 1e-5, "2.000 ± <0.001"),
            (2.0, f64::NAN, "2.00"),
            (2.0, 0.0, "2.00"),
            (f64::NAN, 0.1, NONE),
            (f64::INFINITY, f64::INFINITY, NONE),
        ] {
            assert_eq!(with_error(value, error, 2), text);
        }
    }

    #[test]
    fn an_error_of_any_size_leaves_two_digits() {
        for (value, error, text) in [
            (0.6204, 0.0183, "0.620 ± 0.018"),
            (-123.4, 12.0, "−123 ± 12"),
            (1234.0, 250.0, "1234 ± 250"),
            (3e-5, 4e-6, "0.000030 ± 0.000004"),
            (0.01234, 0.0, "0.0123"),
            (0.0, f64::NAN, "0.00"),
            (f64::NAN, 0.1, NONE),
        ] {
            assert_eq!(to_error(value, error), text);
        }
    }

    #[test]
    fn percentages_near_0_and_100_are_marked() {
        let fractions = [0.0, 1e-5, 0.004, 0.5, -0.2, 0.996, 0.99999, 1.0, 1.3, f64::NAN];
        let texts = [
            "0.0 %", "<0.1 %", "0.4 %", "50 %", "−20 %", "99.6 %", ">99.9 %", "100 %", "130 %", NONE,
        ];
        assert_eq!(fractions.map(percent), texts);
    }

    #[test]
    fn shortest_has_no_trailing_zeros() {
        let values = [1000.0, 0.25, 12.5, 0.0, -3.0, f64::NAN];
        assert_eq!(values.map(shortest), ["1000", "0.25", "12.5", "0", "−3", NONE]);
    }

    #[test]
    fn lists_read_as_sentences() {
        let parts = ["a", "b", "c"].map(str::to_owned);
        assert_eq!(in_words(&[]), "");
        assert_eq!(in_words(&parts[..1]), "a");
        assert_eq!(in_words(&parts), "a, b and c");
    }
}
