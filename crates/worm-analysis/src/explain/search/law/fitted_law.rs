//! A law fitted to the end, with what it does on data held out and its band.

use super::super::fit::Fit;
use super::super::held_out::HeldOut;
use super::shape::LawShape;
use std::sync::Arc;

/// A law that was fitted.
#[derive(Debug, Clone)]
pub(in crate::explain) struct FittedLaw {
    /// With derivatives.
    pub fit: Fit,
    pub held_out: HeldOut,
    /// Fall of the score on data held out.
    pub gain: f64,
    pub shape: Arc<LawShape>,
    pub value: Vec<f64>,
    /// Values beyond neutral at the points of the offered grid.
    pub beyond: Vec<f64>,
    /// 90 % band at every point.
    pub band: Vec<[f64; 2]>,
    /// Where the data are on the first axis.
    pub seen: Vec<f64>,
}

impl FittedLaw {
    /// Whether its 90 % band is away from no law anywhere: else what is free besides does what it seems to do.
    pub fn says_something(&self) -> bool {
        let neutral = self.shape.acts_on.neutral();
        self.band.iter().any(|[low, high]| *low > neutral || *high < neutral)
    }

    /// Adds the same to the law everywhere.
    pub fn shift(&mut self, by: f64) {
        let mut shape = (*self.shape).clone();
        shape.centre.iter_mut().for_each(|centre| *centre += by);
        self.shape = Arc::new(shape);
        self.fit.hypothesis.law = Some(Arc::clone(&self.shape));
        self.value.iter_mut().for_each(|value| *value += by);
        self.beyond.iter_mut().for_each(|beyond| *beyond += by);
        self.band.iter_mut().flatten().for_each(|end| *end += by);
    }
}
