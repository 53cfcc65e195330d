//! What a model predicts for recordings, without any search.

use super::error::ExplainError;
use crate::experiment::RecordedRun;
use crate::explain::search::find::Evidence;
use crate::explain::search::hypothesis::Hypothesis;
use crate::explain::worm::predict::Scene;
use crate::explain::worm::prepare::prepare;
use worm_estimator::config::Config;

/// The configured worm, ready to predict the positions in recordings of it.
pub struct Prediction<'a> {
    scene: Scene<'a>,
    nominal: Hypothesis,
}

impl<'a> Prediction<'a> {
    /// Prepares one prediction for each run: finds the gait, and where each recording begins.
    ///
    /// # Errors
    /// [`ExplainError`] where there is no run, or a recording is not of the configured worm.
    pub fn new(runs: &[RecordedRun<'a>], config: &Config) -> Result<Self, ExplainError> {
        Ok(Self {
            scene: prepare(runs, config, Evidence::Positions)?,
            nominal: Hypothesis::default(),
        })
    }

    /// Predicted positions of a run, m: cell by cell for each sample, one sample after the other. None where the configured
    /// worm cannot hold itself on the slope of the run.
    pub fn positions_m(&self, run: usize) -> Option<Vec<f64>> {
        let predicted = self.scene.predict(run, &self.nominal, &[])?;
        Some(predicted.position_m)
    }
}
