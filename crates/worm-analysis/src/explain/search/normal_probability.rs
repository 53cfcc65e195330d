//! The probability of a normal quantity.

use std::f64::consts::SQRT_2;

/// Probability that a standard normal quantity is below a value: Abramowitz and Stegun's 7.1.26, to 1e-7.
pub(in crate::explain) fn normal_probability(value: f64) -> f64 {
    let x = value.abs() / SQRT_2;
    let t = 1.0 / (1.0 + 0.327_591_1 * x);
    let series = [
        0.254_829_592,
        -0.284_496_736,
        1.421_413_741,
        -1.453_152_027,
        1.061_405_429,
    ];
    let sum = series.iter().rev().fold(0.0, |sum, term| (sum + term) * t);
    let above = 0.5 * sum * (-x * x).exp();
    if value < 0.0 { above } else { 1.0 - above }
}
