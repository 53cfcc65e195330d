//! Times and durations of the clock, which counts nanoseconds, as floating-point numbers.

/// Nanoseconds in seconds: the nearest `f64`, so that up to 10¹⁵ ns it prints with the clock's own digits (`0.454655`).
///
/// A multiplication by `1e-9` would not do, because `1e-9` itself is not exact: it makes `0.45465500000000003` of that time.
pub fn seconds(ns: u64) -> f64 {
    ns as f64 / 1e9
}

/// Nanoseconds in microseconds, as exactly as [`seconds`].
pub fn microseconds(ns: u64) -> f64 {
    ns as f64 / 1e3
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The longest time that is exact, ns: eleven days.
    const MAX_NS: u64 = 1_000_000_000_000_000;

    fn decimals(text: &str) -> usize {
        text.split_once('.').map_or(0, |(_, decimals)| decimals.len())
    }

    #[test]
    fn a_time_prints_with_the_digits_of_the_clock() {
        for (ns, text) in [
            (0, "0"),
            (1, "0.000000001"),
            (454_655_000, "0.454655"),
            (20_045_465_001, "20.045465001"),
            (MAX_NS - 1, "999999.999999999"),
            (MAX_NS, "1000000"),
        ] {
            assert_eq!(seconds(ns).to_string(), text);
        }
        assert_eq!(microseconds(454_655).to_string(), "454.655");
    }

    proptest! {
        #[test]
        fn every_time_survives_printing_and_parsing(ns in prop_oneof![0..=MAX_NS, 0..=2_000_000_000_u64]) {
            for (value, unit_ns, most_decimals) in [(seconds(ns), 1e9, 9), (microseconds(ns), 1e3, 3)] {
                let text = value.to_string();
                prop_assert!(decimals(&text) <= most_decimals, "{ns} ns: {text}");
                let json = serde_json::to_string(&value).expect("a finite number can be written");
                for printed in [text.parse::<f64>().expect("a number"), serde_json::from_str(&json).expect("a number")] {
                    prop_assert_eq!(printed, value);
                    prop_assert_eq!((printed * unit_ns).round() as u64, ns);
                }
            }
        }
    }
}
