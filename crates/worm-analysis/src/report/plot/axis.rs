//! Axes with round ticks whose labels all have the same decimals.

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use std::ops::Range;
use worm_estimator::number;

/// Values beyond this are not drawn: no quantity of a worm, in mm, mJ, N or s, comes near it.
const LARGEST: f64 = 1e9;
/// Narrowest axis, and as a fraction of the values on it: below that, ticks would differ only by rounding.
const NARROWEST: f64 = 1e-6;
/// Smallest number of places that an axis has room for, so that a single bar does not fill the picture.
const FEW_PLACES: f64 = 3.0;
/// Room beyond the outermost values, as a fraction of their range.
const MARGIN: f64 = 0.05;
/// Room beyond the largest value of a logarithmic axis, as a fraction of its decades: the text beside a bar must fit.
const ROOM_BEHIND: f64 = 0.16;
/// Most ticks of a logarithmic axis.
const MAX_POWERS: usize = 6;
/// Room beyond the outermost values of a logarithmic axis, as a factor.
const LOGARITHMIC_MARGIN: f64 = 1.05;
/// Room beyond the end of a logarithmic axis for half of the tick's label there, as a fraction of its decades.
const HALF_NAME: f64 = 0.02;
/// Fewer powers of ten than this leave an axis without scale: then twice and five times a power have ticks, too.
const FEW_POWERS: usize = 3;

/// An axis: what it spans, where its ticks are and what they are called.
#[derive(Debug, Clone)]
pub struct Axis {
    low: f64, // finite, below high
    high: f64,
    ticks: Vec<f64>,
    labels: Labels,
    is_logarithmic: bool, // then low is positive
}

#[derive(Debug, Clone)]
enum Labels {
    Decimals(usize),
    Names(Vec<String>),
    Powers,
    Thousands, // 20, 1k, 5M
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
            is_logarithmic: false,
        }
    }

    /// Rows with names in reading order: the first on top, at the highest place, the last at place 0.
    pub fn listed(mut names: Vec<String>) -> Self {
        names.reverse();
        Self {
            low: -0.5,
            high: names.len().max(1) as f64 - 0.5,
            ..Self::named(names)
        }
    }

    /// Logarithmic from `min`, a power of ten, to the largest value that can be drawn and some room beyond it.
    pub fn powers_of_ten(min: f64, values: impl IntoIterator<Item = f64>) -> Self {
        let drawable = values.into_iter().filter(|value| Self::is_drawable(*value));
        let largest = drawable.fold(10.0 * min, f64::max);
        let decades = (largest / min).log10();
        let high = min * 10f64.powf(decades * (1.0 + ROOM_BEHIND));
        let powers = (high / min).log10().floor() as usize;
        let every = powers / MAX_POWERS + 1;
        let ticks = (0..=powers).step_by(every);
        Self {
            low: min,
            high,
            ticks: ticks.map(|power| min * 10f64.powi(power as i32)).collect(),
            labels: Labels::Powers,
            is_logarithmic: true,
        }
    }

    /// Logarithmic around two positive values, out to the next of 1, 2 or 5 times a power of ten, with ticks at the powers of
    /// ten and thousands written as `k`. From 1 to 10 where the values are none that it can hold.
    pub fn logarithmic(min: f64, largest: f64) -> Self {
        let can_hold = 0.0 < min && min <= largest && Self::is_drawable(largest);
        let (low, high) = if can_hold {
            let low = 1.0 / round_step(LOGARITHMIC_MARGIN / min);
            (low, round_step(LOGARITHMIC_MARGIN * largest))
        } else {
            (1.0, 10.0)
        };
        let exponents = low.log10().floor() as i32..=high.log10().ceil() as i32;
        let lies_within = |tick: &f64| (low * (1.0 - 1e-9)..=high * (1.0 + 1e-9)).contains(tick);
        let powers = exponents.map(|exponent| 10f64.powi(exponent));
        let tens: Vec<f64> = powers.clone().filter(lies_within).collect();
        let ticks = if tens.len() < FEW_POWERS {
            let steps = powers.flat_map(|power| [1.0, 2.0, 5.0].map(|step| step * power));
            steps.filter(lies_within).collect()
        } else {
            let every = (tens.len() - 1) / MAX_POWERS + 1;
            tens.into_iter().step_by(every).collect()
        };
        Self {
            low,
            high: high * (high / low).powf(HALF_NAME),
            ticks,
            labels: Labels::Thousands,
            is_logarithmic: true,
        }
    }

    /// Characters of its longest name; 0 where its ticks are numbers.
    pub fn longest_name(&self) -> usize {
        let Labels::Names(names) = &self.labels else {
            return 0;
        };
        names.iter().map(|name| name.chars().count()).max().unwrap_or(0)
    }

    /// Whether a value can be drawn at all.
    pub fn is_drawable(value: f64) -> bool {
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
            is_logarithmic: false,
        }
    }

    /// Where a value lies between its ends, as a fraction; what a logarithmic axis cannot hold lies at its low end.
    pub(super) fn fraction(&self, value: f64) -> f64 {
        if self.is_logarithmic {
            return (value.max(self.low) / self.low).log10() / (self.high / self.low).log10();
        }
        (value - self.low) / (self.high - self.low)
    }
}

/// The range of what can be drawn, never empty.
fn bounds(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let drawable = values.into_iter().filter(|value| Axis::is_drawable(*value));
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

/// A value of an axis that runs through many powers of ten: `0.05`, `20`, `1k`, `5M`.
fn in_thousands(value: f64) -> String {
    let (value, unit) = match value {
        _ if value >= 1e6 => (value * 1e-6, "M"),
        _ if value >= 1e3 => (value * 1e-3, "k"),
        _ => (value, ""),
    };
    let decimals = (-value.log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{}{unit}", number::fixed(value, decimals))
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        (f64::from(limit.0) + self.fraction(*value) * f64::from(limit.1 - limit.0)).round() as i32
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
            Labels::Powers => number::fixed(*value, (-value.log10()).ceil().clamp(0.0, 9.0) as usize),
            Labels::Thousands => in_thousands(*value),
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
        assert_eq!(
            labels(&Axis::listed(["a", "b"].map(str::to_owned).to_vec())),
            ["b", "a"]
        );
        assert_eq!(labels(&Axis::powers_of_ten(1.0, [350.0])), ["1", "10", "100"]);
        assert_eq!(labels(&Axis::powers_of_ten(0.1, [f64::NAN, -4.0])), ["0.1", "1"]);
    }

    #[test]
    fn a_logarithmic_axis_holds_what_it_cannot_show_at_its_end() {
        let axis = Axis::powers_of_ten(1.0, [100.0]);
        let places = [-5.0, 0.0, 1.0, 10.0, 100.0].map(|value| axis.map(&value, (0, 232)));
        assert_eq!(places, [0, 0, 0, 100, 200]);
    }

    #[test]
    fn a_logarithmic_axis_has_a_scale_however_far_it_reaches() {
        let table: [(f64, f64, &[&str]); 8] = [
            (1.0, 9000.0, &["1", "10", "100", "1k", "10k"]),
            (0.03, 40.0, &["0.1", "1", "10"]),
            (0.06, 0.3, &["0.05", "0.1", "0.2", "0.5"]),
            (900.0, 1100.0, &["500", "1k", "2k"]),
            (7.0, 7.0, &["5", "10"]),
            (0.6, 4e6, &["1", "100", "10k", "1M"]),
            (f64::NAN, 10.0, &["1", "2", "5", "10"]),
            (0.0, f64::INFINITY, &["1", "2", "5", "10"]),
        ];
        for (min, largest, expected) in table {
            let axis = Axis::logarithmic(min, largest);
            assert_eq!(labels(&axis), expected, "{min} to {largest}");
            assert!(axis.low < axis.high, "{min} to {largest}");
        }
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
