//! A law that nobody listed.

use serde::Serialize;

/// One or two axes: a single value in the JSON where there is one.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum LawAxes<T> {
    /// Of one axis.
    One(T),
    /// Of two.
    Two([T; 2]),
}

impl<T> LawAxes<T> {
    /// Of the first axis.
    pub fn first(&self) -> &T {
        match self {
            Self::One(one) | Self::Two([one, _]) => one,
        }
    }

    /// Of all axes.
    pub fn all(&self) -> Vec<&T> {
        match self {
            Self::One(one) => vec![one],
            Self::Two(both) => both.iter().collect(),
        }
    }
}

/// What a law is about.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LawOver {
    /// What it gives: a `contact-force`, N, a `friction-factor`, or a `drive-displacement`, m; of a servo, a `motor-friction` or a
    /// `motor-torque`, N m.
    pub acts_on: &'static str,
    /// What it depends on, by the names that a table of the configuration has.
    pub axis: LawAxes<&'static str>,
    /// The cell that it is about, from 1; all for none.
    pub cell: Option<usize>,
    /// Width after which it repeats, in the unit of its first axis.
    pub period: Option<f64>,
    /// How far it remembers, s, where it depends on what was; left out of the JSON otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory_s: Option<f64>,
}

/// A law at the points of a grid, as `[[effect]] name = "table"` has it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FoundLaw {
    /// What it is about.
    #[serde(flatten)]
    pub over: LawOver,
    /// In a sentence.
    pub sentence: String,
    /// The points of each axis.
    pub grid: LawAxes<Vec<f64>>,
    /// The value at each point; of two axes those of the second for each point of the first, one after the other.
    pub value: Vec<f64>,
    /// 90 % band of each.
    pub band: Vec<[f64; 2]>,
    /// The nearest formula of few terms, in SI units, where one predicts as well.
    pub formula: Option<String>,
    /// Fraction of the squared gap after recalibration that it closes, down to the noise floor, on data that it was not fitted to; `NaN`, null in
    /// the JSON, where that is within its error.
    pub closure: f64,
    /// 90 % interval of that.
    pub closure_interval: [f64; 2],
    /// Rise of twice the log likelihood of data that it was not fitted to, against the recalibrated model.
    pub improvement: f64,
    /// Other laws that predict about as well.
    pub rivals: Vec<LawOver>,
    /// Where the data are on the first axis, for the figure.
    #[serde(skip)]
    pub seen: Vec<f64>,
}
