//! A found value as a file has it: no more digits than mean something.

use toml_edit::{Formatted, Value};

/// A value and its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Figure {
    pub value: f64,
    pub sigma: f64,
}

/// Significant digits that every value keeps, and that are kept of the error: the last digit is then some hundredth of it.
const MIN_DIGITS: i32 = 3;
/// Significant digits of a value without an error.
const DIGITS_WITHOUT_ERROR: i32 = 6;
/// Significant digits of an error.
const DIGITS_OF_ERROR: i32 = 2;
/// More decimals than these no double of everyday size has.
const MAX_DECIMALS: i32 = 15;

impl Figure {
    /// The value in digits, always with a decimal point.
    pub fn digits(&self) -> String {
        let decimals = match self.sigma() {
            Some(sigma) => decimals(sigma, MIN_DIGITS).max(decimals(self.value, MIN_DIGITS)),
            None => decimals(self.value, DIGITS_WITHOUT_ERROR),
        };
        fixed(self.value, decimals)
    }

    /// The error in digits, where there is one.
    pub fn error_digits(&self) -> Option<String> {
        self.sigma().map(|sigma| fixed(sigma, decimals(sigma, DIGITS_OF_ERROR)))
    }

    /// The value as it will be read from its digits.
    pub fn rounded(&self) -> f64 {
        self.digits().parse().unwrap_or(self.value)
    }

    /// Whether the digits say something else than `nominal`.
    pub fn differs_from(&self, nominal: f64) -> bool {
        let nominal = Self {
            value: nominal,
            sigma: self.sigma,
        };
        self.digits() != nominal.digits()
    }

    /// The digits as a value of a file.
    pub fn to_value(self) -> Value {
        let plain = || Value::Float(Formatted::new(self.value));
        self.digits().parse().unwrap_or_else(|_| plain())
    }

    fn sigma(&self) -> Option<f64> {
        Some(self.sigma).filter(|sigma| sigma.is_finite() && *sigma > 0.0)
    }
}

/// Decimals with which a number has so many significant digits.
fn decimals(number: f64, digits: i32) -> i32 {
    if number == 0.0 {
        return 1;
    }
    // The conversion saturates where the logarithm is none; the clamp below takes care of that.
    (digits - 1).saturating_sub(number.abs().log10().floor() as i32)
}

fn fixed(number: f64, decimals: i32) -> String {
    let decimals = decimals.clamp(1, MAX_DECIMALS) as usize;
    let digits = format!("{number:.decimals$}");
    let short = digits.trim_end_matches('0');
    if short.ends_with('.') {
        format!("{short}0")
    } else {
        short.to_owned()
    }
}
