//! Durations, counted in a histogram of the HDR kind: every duration to two digits, however rare it is.

use hdrhistogram::Histogram;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use worm_estimator::time::microseconds;

/// Longest duration that is told apart, ns: ten seconds. What takes longer counts as that.
const LONGEST_NS: u64 = 10_000_000_000;

/// Digits that are told apart: 1 % of the value.
const DIGITS: u8 = 2;

/// Durations in ns.
#[derive(Debug, Clone)]
pub struct Durations(Histogram<u64>);

impl Default for Durations {
    fn default() -> Self {
        // The bounds are constants, and valid.
        Self(Histogram::new_with_max(LONGEST_NS, DIGITS).unwrap_or_else(|error| unreachable!("{error}")))
    }
}

impl Durations {
    /// Counts one duration.
    pub fn record(&mut self, ns: u64) {
        self.0.saturating_record(ns);
    }

    /// Counts a lateness of something that is due once every `period_ns`, and with it the latenesses of those that were due
    /// meanwhile and never came: each is a period less late than the one before. Without them one stop of a second would
    /// count as one late tick among thousands of good ones, where a thousand ticks were late ("coordinated omission").
    pub fn record_due(&mut self, ns: u64, period_ns: u64) {
        let ns = ns.min(LONGEST_NS);
        if self.0.record_correct(ns, period_ns.max(1)).is_err() {
            self.0.saturating_record(ns);
        }
    }

    /// How many were counted.
    pub fn count(&self) -> u64 {
        self.0.len()
    }

    /// Whether nothing was counted.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The percentiles; zeros when nothing was counted.
    pub fn percentiles(&self) -> Percentiles {
        let us = |quantile| microseconds(self.0.value_at_quantile(quantile));
        Percentiles {
            p50: us(0.5),
            p90: us(0.9),
            p99: us(0.99),
            p99_9: us(0.999),
            max: microseconds(self.0.max()),
        }
    }

    /// The percentiles, where anything was counted.
    pub fn measured(&self) -> Option<Percentiles> {
        (!self.is_empty()).then(|| self.percentiles())
    }

    /// The histogram's bars: longest duration of the bar, µs, and how many are in it. Empty bars are left out.
    pub fn bars(&self) -> impl Iterator<Item = (f64, u64)> + '_ {
        self.0
            .iter_recorded()
            .map(|bar| (microseconds(bar.value_iterated_to()), bar.count_at_value()))
    }
}

/// The percentiles, how many were counted, and the bars as pairs of the longest duration in µs and the count.
#[derive(Serialize, Deserialize)]
struct Told {
    #[serde(flatten)]
    percentiles: Percentiles,
    count: u64,
    histogram: Vec<(f64, u64)>,
}

/// As an object of percentiles, count and bars; null when nothing was counted.
impl Serialize for Durations {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let told = (!self.is_empty()).then(|| Told {
            percentiles: self.percentiles(),
            count: self.count(),
            histogram: self.bars().collect(),
        });
        told.serialize(serializer)
    }
}

/// From the bars of that object: the same histogram, as far as its bars are wide.
impl<'de> Deserialize<'de> for Durations {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let told = Option::<Told>::deserialize(deserializer)?;
        let mut durations = Self::default();
        for (us, count) in told.into_iter().flat_map(|told| told.histogram) {
            durations.0.saturating_record_n((us * 1e3).round() as u64, count);
        }
        Ok(durations)
    }
}

/// Percentiles of a duration, µs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Percentiles {
    /// Median.
    pub p50: f64,
    /// 90th percentile.
    pub p90: f64,
    /// 99th percentile.
    pub p99: f64,
    /// 99.9th percentile.
    pub p99_9: f64,
    /// Largest.
    pub max: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_counts_for_all_that_was_due_in_it() {
        // (latenesses in ms at a period of 1 ms, how many are counted, median and largest in ms)
        let table: [(&[u64], u64, f64, f64); 3] = [
            (&[0, 0, 0, 0], 4, 0.0, 0.0),
            // 10 ms late: nine more that were due meanwhile, 9 to 1 ms late.
            (&[10], 10, 5.0, 10.0),
            (&[1, 1, 4], 6, 1.0, 4.0),
        ];
        for (ms, count, median_ms, largest_ms) in table {
            let mut durations = Durations::default();
            ms.iter().for_each(|ms| durations.record_due(ms * 1_000_000, 1_000_000));
            let told = durations.percentiles();
            assert_eq!(durations.count(), count, "{ms:?}");
            assert!(
                (told.p50 / 1e3 - median_ms).abs() <= 0.01 * median_ms,
                "{ms:?}: {told:?}"
            );
            assert!(
                (told.max / 1e3 - largest_ms).abs() <= 0.01 * largest_ms,
                "{ms:?}: {told:?}"
            );
        }
    }

    #[test]
    fn what_is_beyond_the_longest_counts_as_the_longest() {
        let mut durations = Durations::default();
        durations.record(u64::MAX);
        durations.record_due(u64::MAX, 5_000_000_000);
        assert_eq!(durations.count(), 3);
        assert!((durations.percentiles().max / 1e7 - 1.0).abs() < 0.01);
    }

    #[test]
    fn as_json_and_back_it_is_the_same() {
        let mut durations = Durations::default();
        (0..1000_u64).for_each(|number| durations.record(number * number * 7));
        let text = serde_json::to_string(&durations).expect("can be written");
        let read: Durations = serde_json::from_str(&text).expect("can be read");
        assert_eq!(read.bars().collect::<Vec<_>>(), durations.bars().collect::<Vec<_>>());
        assert_eq!(read.percentiles(), durations.percentiles());
        let nothing = serde_json::to_string(&Durations::default()).expect("can be written");
        assert_eq!(nothing, "null");
        assert!(serde_json::from_str::<Durations>(&nothing).is_ok_and(|read| read.is_empty()));
    }
}
