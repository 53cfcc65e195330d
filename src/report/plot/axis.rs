//! Axes with round ticks whose labels all have the same decimals.

use crate::report::number;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use std::ops::Range;

/// Values beyond this are not drawn: no quantity of a worm, in mm, mJ, N or s, comes near it.
const LARGEST: f64 = 1e9;
/// Narrowest axis, and as a share of the values on it: below that, ticks would differ by rounding only.
const NARROWEST: f64 = 1e-6;
/// Places that a picture has room for at least, so that a single bar does not fill it.
const FEW_PLACES: f64 = 3.0;
/// Room beyond the outermost values, as a share of their range.
const MARGIN: f64 = 0.05;

/// An axis: what it spans, where its ticks are and what they are called.
#[derive(Debug, Clone)]
pub struct Axis {
    low: f64, // finite, below high
    high: f64,
    ticks: Vec<f64>,
    labels: Labels,
}

#[derive(Debug, Clone)]
enum Labels {
    Decimals(usize),
    Names(Vec<String>),
}

impl Axis {
    /// Around the values that can be drawn, with a little room, and with about so many ticks. From 0 to 1 without values.
    pub fn around(values: impl IntoIterator<Item = f64>, ticks: usize) -> Self {
        let (low, high) = bounds(values);
        let room = MARGIN * (high - low);
        Self::spanning(low - room, high + room, ticks)
    }

    /// From `low` to `high`, as time runs through a window; from 0 to 1 where that is nothing.
    pub fn between(low: f64, high: f64, ticks: usize) -> Self {
        let ends = if low < high { [low, high] } else { [0.0, 1.0] };
        let (low, high) = bounds(ends);
        Self::spanning(low, high, ticks)
    }

    /// Around whole numbers that count something: ticks are never between them.
    pub fn counting(values: impl IntoIterator<Item = f64>, ticks: usize) -> Self {
        let (low, high) = bounds(values);
        let axis = Self::spanning(low - 0.5, high + 0.5, ticks);
        Self {
            ticks: axis
                .ticks
                .into_iter()
                .filter(|tick| (tick - tick.round()).abs() < 1e-9)
                .collect(),
            labels: Labels::Decimals(0),
            ..axis
        }
    }

    /// Places 0, 1, 2, … with names. Where there are few, some room is left at both ends.
    pub fn named(names: Vec<String>) -> Self {
        let places = names.len() as f64;
        let room = 0.5 + 0.5 * (FEW_PLACES - places).max(0.0);
        Self {
            low: -room,
            high: places - 1.0 + room,
            ticks: (0..names.len()).map(|place| place as f64).collect(),
            labels: Labels::Names(names),
        }
    }

    /// Whether a value can be drawn at all.
    pub fn can_show(value: f64) -> bool {
        value.abs() <= LARGEST
    }

    /// The smallest value on it.
    pub fn low(&self) -> f64 {
        self.low
    }

    /// The largest value on it.
    pub fn high(&self) -> f64 {
        self.high
    }

    fn spanning(low: f64, high: f64, ticks: usize) -> Self {
        let step = round_step((high - low) / ticks.max(1) as f64);
        let first = (low / step).ceil();
        let last = (high / step).floor();
        let count = (last - first).max(0.0) as usize + 1;
        Self {
            low,
            high,
            ticks: (0..count).map(|tick| (first + tick as f64) * step).collect(),
            labels: Labels::Decimals((-step.log10().floor()).clamp(0.0, 9.0) as usize),
        }
    }
}

/// The range of what can be drawn, never empty.
fn bounds(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let drawable = values.into_iter().filter(|value| Axis::can_show(*value));
    let (low, high) = drawable.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    if low > high {
        return (0.0, 1.0);
    }
    let narrowest = NARROWEST * low.abs().max(high.abs()).max(1.0);
    if high - low >= narrowest {
        (low, high)
    } else {
        (low - narrowest, high + narrowest)
    }
}

/// The next of 1, 2, 5, 10, … times a power of ten.
fn round_step(at_least: f64) -> f64 {
    let power = 10f64.powf(at_least.log10().floor());
    let steps = [1.0, 2.0, 5.0].map(|step| step * power);
    steps
        .into_iter()
        .find(|step| *step >= at_least * (1.0 - 1e-9))
        .unwrap_or(10.0 * power)
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let share = (value - self.low) / (self.high - self.low);
        (f64::from(limit.0) + share * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _hint: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> Range<f64> {
        self.low..self.high
    }
}

impl ValueFormatter<f64> for Axis {
    fn format_ext(&self, value: &f64) -> String {
        match &self.labels {
            Labels::Decimals(decimals) => number::fixed(*value, *decimals),
            Labels::Names(names) => names.get(value.round() as usize).cloned().unwrap_or_default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis) -> Vec<String> {
        axis.ticks.iter().map(|tick| axis.format_ext(tick)).collect()
    }

    #[test]
    fn ticks_are_round_and_written_alike() {
        assert_eq!(labels(&Axis::between(-2.2, 2.2, 4)), ["−2", "0", "2"]);
        assert_eq!(labels(&Axis::between(0.0, 1.1, 5)), ["0.0", "0.5", "1.0"]);
        assert_eq!(labels(&Axis::between(0.0, 30.1, 6)), ["0", "10", "20", "30"]);
        assert_eq!(labels(&Axis::named(vec!["0°".to_owned()])), ["0°"]);
    }

    #[test]
    fn a_window_of_nothing_runs_from_0_to_1() {
        for (low, high) in [(0.0, 0.0), (2.0, 1.0), (f64::NAN, 1.0), (0.0, f64::NAN)] {
            let axis = Axis::between(low, high, 2);
            assert_eq!(labels(&axis), ["0.0", "0.5", "1.0"], "{low} to {high}");
        }
    }

    #[test]
    fn no_values_and_absurd_values_still_give_an_axis() {
        for values in [
            vec![],
            vec![f64::NAN],
            vec![f64::INFINITY, 1e300],
            vec![7.0],
            vec![-1e9, 1e9],
        ] {
            let axis = Axis::around(values.iter().copied(), 5);
            assert!(
                axis.low < axis.high && axis.low.is_finite() && axis.high.is_finite(),
                "{values:?}: {axis:?}"
            );
            assert!((1..=12).contains(&axis.ticks.len()), "{values:?}: {axis:?}");
        }
    }
}
