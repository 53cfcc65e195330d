//! What a plant offers as a law.

use super::shape::LawShape;

/// A quantity on which a law may depend.
#[derive(Debug, Clone)]
pub(in crate::explain) struct Offer {
    /// A coefficient for each point of its grid.
    pub shape: LawShape,
    /// Where the points are on the scale on which the law is smooth, for each axis: about 0 to 1.
    pub scaled: Vec<Vec<f64>>,
    /// Period of the law on that scale, where it is known.
    pub period: Option<f64>,
    /// Shortest and longest period that it may have besides, in the axis's unit.
    pub periods: Option<[f64; 2]>,
    /// What is typical of the values beyond the neutral one: four scales.
    pub sigmas: [f64; 4],
    /// What part of its variance is a value that is the same everywhere.
    pub constant: f64,
    /// Values beyond the neutral one, at the points of its grid, from which it is looked for where they do better than none: what can be read
    /// from the recordings without a fit.
    pub guess: Option<Vec<f64>>,
    /// Where the data are on the first axis.
    pub seen: Vec<f64>,
}

impl Offer {
    /// That part where nothing else is known of it.
    pub const CONSTANT: f64 = 0.5;
}
