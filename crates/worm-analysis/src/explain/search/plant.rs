//! What the search needs to know of the machine whose model it judges.
//!
//! Nothing in [`super`] knows of worms. A plant was recorded in some runs, on some channels that are compared with a model's in bins of its
//! motion; it has nuisances, effects of the library that its recordings can show, and predictions of both.

use super::bins::Bins;
use super::discrepancy;
use super::fit::{Fit, FitWithout};
use super::folds::Folds;
use super::hypothesis::Hypothesis;
use super::impact::Impact;
use super::law::fitted_law::FittedLaw;
use super::law::offer::Offer;
use super::misstatement::Misstatement;
use super::parameter::{Free, Hypothesised};
use crate::explain::error::ExplainError;
use nalgebra::DMatrix;
use std::ops::Range;

/// The recordings of a machine, as the statistics see them.
pub(in crate::explain) trait Recorded: Sync {
    /// Number of runs.
    fn runs(&self) -> usize;
    /// Channels that are compared with the model's: for a worm, the positions of its cells. An effect may concern one of them.
    fn channels(&self) -> usize;
    /// The condition that differs from run to run, of the order of 1: for a worm, the sine of the slope.
    fn condition(&self, run: usize) -> f64;
    /// The bins of the gap in a run.
    fn bins(&self, run: usize) -> &Bins;
    /// The bin that each row of a run's residuals is in.
    fn bin_of_rows(&self, run: usize) -> Vec<usize>;
    /// The rows, whitened by the noise, of a pattern that every channel shows in every bin of a run: `[bin][channel]`, flat, in the unit of
    /// the discrepancy's scale.
    fn rows_of(&self, run: usize, pattern: &[f64]) -> Vec<f64>;
    /// What is left of rows of a run where they count in some bins alone.
    fn within(&self, run: usize, rows: &[f64], bins: Range<usize>) -> Vec<f64>;

    /// The condition of every run.
    fn conditions(&self) -> Vec<f64> {
        (0..self.runs()).map(|run| self.condition(run)).collect()
    }

    /// The bins of every run.
    fn all_bins(&self) -> Vec<&Bins> {
        (0..self.runs()).map(|run| self.bins(run)).collect()
    }

    /// Whether it does the same in every cycle, so that changes in mid-run and rhythms can be told from the rest.
    fn has_cycles(&self) -> bool {
        true
    }

    /// The discrepancy's columns, whitened by the noise, at a scale: what the model may be wrong by everywhere is their sum with standard
    /// normal coefficients. For a machine that does the same in every cycle it repeats with them.
    fn discrepancy_columns(&self, scale: f64) -> DMatrix<f64>
    where
        Self: Sized,
    {
        let rows_of = |run: usize, pattern: &[f64]| self.rows_of(run, pattern);
        discrepancy::repeating_columns(self.channels(), &self.all_bins(), &self.conditions(), scale, rows_of)
    }

    /// The parts that are left out in turn to see how a hypothesis predicts what it was not fitted to.
    fn folds(&self) -> Folds
    where
        Self: Sized,
    {
        Folds::of_runs_and_cycles(&self.all_bins())
    }

    /// Steps of a refit without such a part.
    fn steps_without(&self) -> usize {
        2
    }
}

/// What a hypothesis predicts for a run.
pub(in crate::explain) struct PredictedRun {
    /// Residuals, whitened by the noise; large throughout where the machine could not have made the run.
    pub residuals: Vec<f64>,
    /// What anybody asks of the run: for a worm, its advance in a cycle, m. `NaN` where it could not have made the run.
    pub outcome: f64,
}

/// Logarithms of the Bayes factors of motions of the whole machine that do not go with its cycles, against scatter as usual; none where it
/// cannot be told.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::explain) struct BodyMotion {
    /// A rhythm from cycle to cycle, or along the way.
    pub from_cycle_to_cycle: Option<f64>,
    /// A rhythm within the cycles.
    pub within_cycles: Option<f64>,
    /// Something irregular.
    pub irregular: Option<f64>,
}

/// A machine with its model.
pub(in crate::explain) trait Plant: Recorded {
    /// Everything that is not known exactly and that no effect is about, with its prior.
    fn nuisances(&self) -> Vec<Free>;
    /// Whether a nuisance concerns a run.
    fn concerns(&self, nuisance: usize, run: usize) -> bool;
    /// Every hypothesis about a single effect that the recordings can show.
    fn hypotheses(&self) -> Vec<Hypothesised>;
    /// The stretch along which an effect that has a place may act, m.
    fn stretch_m(&self) -> (f64, f64);

    /// What a hypothesis predicts for a run.
    fn predict(&self, run: usize, hypothesis: &Hypothesis, at: &[f64]) -> PredictedRun;
    /// Whether what repeats is predicted once, which is not quite what predicting all of it gives.
    fn repeats(&self, hypothesis: &Hypothesis, at: &[f64]) -> bool;
    /// The least outcome of a run that changes of it are relative to.
    fn least_outcome(&self, run: usize) -> f64;
    /// What the effect in some place of a fitted hypothesis changes; `limit` is the relative change of outcome and energy that matters.
    fn impact(&self, fit: &Fit, place: usize, limit: f64) -> Impact;
    /// Evidence of motions that do not go with the gait in what a fit leaves; `usual_scatter` is what such a machine usually differs by from
    /// cycle to cycle, as a fraction of what holds it. None unless the plant says so.
    fn body_motion(&self, _fit: &Fit, _usual_scatter: f64) -> BodyMotion {
        BodyMotion::default()
    }
    /// 90 % interval of the fraction of the squared gap that one fit leaves open and another closes on data held out, down to noise and the
    /// discrepancy's scale; none where that is within its error.
    fn closed(&self, open: (&Fit, &[&FitWithout]), left: (&Fit, &[&FitWithout]), discrepancy: f64) -> Option<[f64; 2]>;
    /// Whether a second effect must close some of the gap that the first one alone leaves, as [`closed`](Self::closed) counts it: where
    /// much of the gap is nothing that an effect could close, a pair may be more probable than one effect and yet no nearer to the data.
    fn asks_seconds_to_close(&self) -> bool {
        false
    }
    /// A fit with what nuisances have of an effect's law moved into the effect; it predicts the same.
    fn with_whole_effects(&self, fit: Fit) -> Fit;

    /// Measures the noise by what a hypothesis leaves of the data.
    ///
    /// # Errors
    /// [`ExplainError`] where the machine could not have made a run.
    fn measure_noise(&mut self, hypothesis: &Hypothesis, at: &[f64]) -> Result<(), ExplainError>;
    /// Judges anew, by a recalibrated model, what is assumed about the runs. Returns whether any of it is new.
    fn judge_assumptions(&mut self, hypothesis: &Hypothesis, at: &[f64]) -> bool;
    /// Keeps what makes predictions near a hypothesis quicker.
    fn settle(&mut self, hypothesis: &Hypothesis, at: &[f64]);
    /// Values from which a recalibration may reach another minimum than that at some values.
    fn another_start(&self, hypothesis: &Hypothesis, at: &[f64]) -> Vec<f64>;
    /// Values from which the model is recalibrated besides, wherever the nominal ones are: for residuals with many minima. They lie within the
    /// limits.
    fn recalibration_starts(&self, _hypothesis: &Hypothesis) -> Vec<Vec<f64>> {
        Vec::new()
    }
    /// Values from which every fit is tried again, about those at which it ended: for residuals with many minima. They lie within the limits.
    fn other_starts(&self, _hypothesis: &Hypothesis, _at: &[f64]) -> Vec<Vec<f64>> {
        Vec::new()
    }
    /// Mistakes that may have been made in what is stated about the runs, each as hypotheses with these nuisances; none unless the plant says so.
    fn misstatements(&self, _base: &Hypothesis) -> Vec<Misstatement> {
        Vec::new()
    }
    /// What a law that nobody listed may depend on, over where the plant goes by a fit: the recalibrated one, or one with such a law that is
    /// to be fitted anew. Nothing unless the plant says so.
    fn laws(&self, _fit: &Fit) -> Vec<Offer> {
        Vec::new()
    }
    /// Whether such laws are weighed as what else may be missing in any case, and not only where the answer would be an effect or wrong
    /// conditions: where the discrepancy that every model has could hide them.
    fn weighs_laws(&self) -> bool {
        false
    }
    /// A law with what nuisances have of it moved into it, or the other way round; it predicts the same.
    fn with_whole_law(&self, law: FittedLaw) -> FittedLaw {
        law
    }
    /// What the discrepancy's scale is a fraction of: for a worm, the mean largest deformation of its tips, m.
    fn discrepancy_unit(&self) -> f64;
}
