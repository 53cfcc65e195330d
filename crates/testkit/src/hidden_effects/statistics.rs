//! Proportions with exact intervals, and medians.

use std::fmt;

/// Probability left out at either end of a 95 % interval.
const TAIL: f64 = 0.025;
/// Halvings of an interval's end: to less than any digit that is printed.
const HALVINGS: usize = 60;

/// A proportion: hits among a number of cases.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Proportion {
    pub hits: usize,
    pub of: usize,
}

impl Proportion {
    /// Counts the true ones among those that are not `None`.
    pub fn count(each: impl Iterator<Item = Option<bool>>) -> Self {
        each.flatten().fold(Self::default(), |fraction, hit| Self {
            hits: fraction.hits + usize::from(hit),
            of: fraction.of + 1,
        })
    }

    /// The 95 % interval of Clopper and Pearson (1934); 0 to 1 where there is nothing to count.
    pub fn interval(self) -> [f64; 2] {
        let Self { hits, of } = self;
        let low = if hits == 0 {
            0.0
        } else {
            solve(|p| at_least(hits, of, p) > TAIL)
        };
        let high = if hits == of {
            1.0
        } else {
            solve(|p| 1.0 - at_least(hits + 1, of, p) < TAIL)
        };
        [low, high]
    }
}

/// The probability from which on a condition holds.
fn solve(holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if holds(middle) { high = middle } else { low = middle }
    }
    high
}

/// Probability of so many hits or more among `of` cases.
fn at_least(hits: usize, of: usize, p: f64) -> f64 {
    let mut log_choose = 0.0;
    let mut sum = 0.0;
    for count in 0..=of {
        if count > 0 {
            log_choose += ((of + 1 - count) as f64 / count as f64).ln();
        }
        if count >= hits {
            sum += (log_choose + count as f64 * p.ln() + (of - count) as f64 * (1.0 - p).ln()).exp();
        }
    }
    sum
}

impl fmt::Display for Proportion {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.of == 0 {
            return write!(out, "none");
        }
        let percent = |fraction: f64| 100.0 * fraction;
        let [low, high] = self.interval().map(percent);
        let fraction = percent(self.hits as f64 / self.of as f64);
        write!(
            out,
            "{:>3}/{:<3} {fraction:5.1} % ({low:.0} to {high:.0})",
            self.hits, self.of
        )
    }
}

/// The middle of values; none of none.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let upper = values.get(values.len() / 2)?;
    let lower = values[(values.len() - 1) / 2];
    Some(0.5 * (lower + upper))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_those_of_the_textbook() {
        // R: binom.test(hits, of)$conf.int.
        for (hits, of, expected) in [
            (0, 122, [0.0, 0.0298]),
            (9, 10, [0.5550, 0.9975]),
            (81, 263, [0.2527, 0.3676]),
            (5, 5, [0.4782, 1.0]),
            (0, 0, [0.0, 1.0]),
        ] {
            let interval = Proportion { hits, of }.interval();
            for (found, expected) in interval.into_iter().zip(expected) {
                assert!((found - expected).abs() < 2e-4, "{hits} of {of}: {interval:?}");
            }
        }
    }

    #[test]
    fn a_median_lies_between_the_two_in_the_middle() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(median(Vec::new()), None);
    }
}
