//! The result of the search: the JSON contract of `wormd explain`, and what its page draws.
//!
//! Cells count from 1 here. Phases are fractions of a gait cycle, 0 to 1.

mod figures;
mod law;
mod next_experiment;
mod onset;
mod run;

use crate::recording::Repair;
pub use figures::{CycleSeries, Figures, ResidualMap, TorqueSeries};
pub use law::{FoundLaw, LawAxes, LawOver};
pub use next_experiment::{ExperimentChange, NextExperiment, Prediction, RunChange};
pub use onset::FoundOnset;
pub use run::{CurrentEvidence, RunSummary};
use serde::Serialize;
use std::collections::BTreeSet;

/// Probability from which an answer is that the conditions of the recordings are stated wrongly.
pub(in crate::explain) const MISSTATED: f64 = 0.5;

/// The verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Model and data agree, once the model is recalibrated within its priors.
    Agrees,
    /// One answer, up to its exact twins.
    Explained,
    /// Several effects explain the data about equally well.
    Ambiguous,
    /// No effect of the library explains the data.
    OutsideLibrary,
}

/// The whole answer.
#[derive(Debug, Clone, Serialize)]
pub struct Answer {
    /// The verdict.
    pub verdict: Verdict,
    /// The verdict in a sentence or two.
    pub sentence: String,
    /// The effects that explain the data: one, or a pair that acts together; empty unless explained or ambiguous.
    pub effects: Vec<NamedEffect>,
    /// Others that explain them about as well, best first.
    pub rivals: Vec<NamedEffect>,
    /// Where model and data disagree after recalibration, most significant first.
    pub r#where: Vec<Place>,
    /// The gap, stage by stage.
    #[serde(rename = "gap")]
    pub stages: Vec<Stage>,
    /// What is left, where nothing explains it.
    pub remainder: Option<Remainder>,
    /// A law that nobody listed, where no effect of the library explains the data and one predicts what it was not fitted to.
    pub law: Option<FoundLaw>,
    /// The experiment that would best decide between what is left open.
    pub next_experiment: Option<NextExperiment>,
    /// The recalibrated model: what was free within its prior, and the values found.
    pub calibration: Vec<Calibrated>,
    /// The same fitted without what no model file can hold, as it is written back; not part of the JSON.
    #[serde(skip)]
    pub written_back: Vec<Calibrated>,
    /// The screening of the whole library, most significant first.
    pub screening: Vec<Screened>,
    /// Improvement that the best of the whole library stays below in 99 of a hundred worms without an effect, drawn for this campaign.
    /// In units of twice the log likelihood. For advances alone, the chi-squared that a right model exceeds one time in twenty.
    pub threshold: f64,
    /// How probable it is that nothing, and that something else, is missing.
    #[serde(flatten)]
    pub doubt: Doubt,
    /// The recordings.
    pub runs: Vec<RunSummary>,
    /// Limitations of this answer.
    pub warnings: Vec<String>,
    /// What was repaired in the recordings, and what was noticed but left as it is.
    pub repairs: Vec<Repair>,
    /// Series and maps for figures; not part of the JSON.
    #[serde(skip)]
    pub figures: Figures,
}

impl Answer {
    /// Whether it is based on the motor's current alone: nobody saw the cells.
    pub fn is_by_current_alone(&self) -> bool {
        !self.runs.is_empty() && self.runs.iter().all(|run| !run.sees_positions)
    }

    /// Whether it is more probable than everything else together that conditions are stated wrongly.
    pub fn is_misstated(&self) -> bool {
        self.doubt
            .misstated_probability
            .is_some_and(|probability| probability > MISSTATED)
    }

    /// Whether it is based on advances alone, without a recording.
    pub fn is_by_advances(&self) -> bool {
        !self.runs.is_empty() && self.runs.iter().all(|run| run.advance_sigma_m.is_some())
    }
}

/// How probable it is that none of the effects is the answer, and what that rests on; `NaN` where it is not known.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Doubt {
    /// Probability that no effect is missing that changes what matters: the posterior one, less what recalibration can hide.
    pub null_probability: f64,
    /// Probability that something else is missing, alone or beside an effect: the posterior one, less effects that are unlike their laws.
    pub other_probability: f64,
    /// Probability that nothing is missing and the conditions of the recordings are stated wrongly; none where no mistake that is usual explains anything.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub misstated_probability: Option<f64>,
    /// The measured advance of a cycle and that of the model in the answer differ on no run by more than this, m, with a probability
    /// of 95 %.
    pub agrees_within_m: f64,
    /// Where the motor's current counts: the work of a cycle by it and by the model in the answer differ on no run by more than this, J,
    /// with a probability of 95 %, by the gears of that answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub agrees_within_j: Option<f64>,
    /// Standard deviation that the model is taken to be wrong by everywhere, m.
    pub discrepancy_m: f64,
    /// By how much of its friction each tip would have to differ from one cycle to the next to move the body as irregularly as the answer, or
    /// what comes nearest, leaves it; none where nobody saw the body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction_scatter: Option<f64>,
}

impl Default for Doubt {
    /// Nothing is known.
    fn default() -> Self {
        Self {
            null_probability: f64::NAN,
            other_probability: f64::NAN,
            misstated_probability: None,
            agrees_within_m: f64::NAN,
            agrees_within_j: None,
            discrepancy_m: f64::NAN,
            friction_scatter: None,
        }
    }
}

/// An effect with its values.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NamedEffect {
    /// Its name in the library.
    pub name: String,
    /// Names and descriptions of what no positions can distinguish from it.
    pub twins: Vec<String>,
    /// Its parameters.
    pub parameters: Vec<FoundParameter>,
    /// The cell it acts on, from 1; none for all.
    pub cell: Option<usize>,
    /// When it begins or ends; none where it acts throughout.
    pub onset: Option<FoundOnset>,
    /// The other effects of the same answer, in words: a pair explains the data only together.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub together_with: Vec<String>,
    /// Fraction of the squared gap after recalibration that it closes, down to the noise floor, on cycles that it was not fitted to.
    /// `NaN` where the gap is within its own error.
    pub closure: f64,
    /// 90 % interval of that.
    pub closure_interval: [f64; 2],
    /// Its closure less that of the best effect of another kind.
    pub margin: f64,
    /// Posterior probability of its class, none and something else being counted: of the effect on any cell, and of its exact twins.
    pub probability: f64,
    /// Improvement over the recalibrated model: rise of twice the log likelihood.
    pub improvement: f64,
    /// Which experiment distinguishes it from its neighbours.
    pub separated_by: String,
}

impl NamedEffect {
    /// Its name, and its cell where it acts on one.
    pub fn in_words(&self) -> String {
        with_cell(&self.name, self.cell)
    }
}

/// An effect with its cell, from 1, where it acts on one: `unequal-clamping of cell 2`.
pub fn with_cell(name: &str, cell: Option<usize>) -> String {
    match cell {
        Some(cell) => format!("{name} of cell {cell}"),
        None => name.to_owned(),
    }
}

/// Rivals in words, one entry for each answer: those of a pair are one answer.
pub fn answers_in_words(rivals: &[NamedEffect]) -> Vec<String> {
    let mut answers: Vec<(BTreeSet<&str>, String)> = Vec::new();
    let names: Vec<String> = rivals.iter().map(NamedEffect::in_words).collect();
    for (rival, name) in rivals.iter().zip(&names) {
        let with = rival.together_with.iter().map(String::as_str);
        let all: BTreeSet<&str> = with.clone().chain([name.as_str()]).collect();
        if !answers.iter().any(|(other, _)| *other == all) {
            let in_order: Vec<&str> = with.chain([name.as_str()]).collect();
            answers.push((all, in_order.join(" together with ")));
        }
    }
    answers.into_iter().map(|(_, words)| words).collect()
}

/// A parameter and the value found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FoundParameter {
    /// Name in files.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Its standard error; a severity's counts what its law may be wrong by.
    pub sigma: f64,
    /// Its unit; empty for none.
    pub unit: String,
    /// The cell it acts on, from 1; none for all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cell: Option<usize>,
}

/// A place where model and data disagree.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Place {
    /// The cell that is not where the model has it, from 1.
    pub cell: usize,
    /// The cell that steps meanwhile, from 1.
    pub stepping_cell: usize,
    /// Gait phase at the middle of the bin, 0 to 1.
    pub phase: f64,
    /// Slope of the run, degrees.
    pub slope_deg: f64,
    /// Displacement of the cell within the bin beyond the model's, m in each cycle.
    pub residual_m: f64,
    /// That in standard errors, by bootstrap over blocks of cycles.
    pub significance: f64,
}

/// A model in the order in which the gap between model and data shrinks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StageKind {
    /// The nominal model.
    Baseline,
    /// Fitted within the priors of what is not known exactly, without an effect.
    Recalibrated,
    /// The best effect of another kind than the one named.
    BestWrong,
    /// One effect of a pair that is named, alone: a step on the way.
    Step,
    /// The effect named, or the best of several candidates.
    Named,
    /// A law that nobody listed, where no effect explains the data.
    Law,
    /// A correction of any form: about as much as any model could explain.
    FreeForm,
    /// The noise floor, which no model can fall below.
    Floor,
}

/// One stage of the shrinking gap.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stage {
    /// Which one.
    pub stage: StageKind,
    /// The effect, where the stage has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub effect: Option<String>,
    /// Root mean square of the positions' residual within cycles, on the data it was fitted to, m.
    pub fit_rms_m: f64,
    /// The same on cycles that it was not fitted to, m.
    pub held_out_rms_m: f64,
    /// 90 % interval of that, by the scatter from cycle to cycle, m.
    pub held_out_interval_m: [f64; 2],
    /// Mean over the runs of how far the advance per cycle is off, m.
    pub advance_error_m: f64,
    /// 90 % interval of that, m.
    pub advance_error_interval_m: [f64; 2],
    /// Mean over the runs of how far the energy per cycle (11) is off, J.
    pub energy_error_j: f64,
    /// The gap of the torque, where the motor's current counts as evidence. Where no positions were recorded beside it the figures in
    /// metres are `NaN`, and closures are those of the torque.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque: Option<TorqueGap>,
}

/// How far a stage's torque on the cam is off.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TorqueGap {
    /// Root mean square of the residual in each bin of the phase, on the data it was fitted to, N m.
    pub fit_rms_n_m: f64,
    /// The same on cycles that it was not fitted to, N m.
    pub held_out_rms_n_m: f64,
    /// 90 % interval of that, by the scatter from cycle to cycle, N m.
    pub held_out_interval_n_m: [f64; 2],
}

/// What no effect explains.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Remainder {
    /// In words: cells, phases, slopes and period.
    pub description: String,
    /// Fraction of the gap that stays open after the best effect.
    pub open_share: f64,
    /// Where something begins in mid-run, to the nearest cycle.
    pub onset: Option<FoundOnset>,
    /// Period in cycles, where it repeats in time.
    pub period_cycles: Option<f64>,
    /// Period along the canal, m, where it repeats in space.
    pub period_m: Option<f64>,
    /// Where it is largest.
    pub places: Vec<Place>,
}

/// A parameter of the recalibrated model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Calibrated {
    /// What it is.
    pub name: String,
    /// The nominal value.
    #[serde(rename = "believed")]
    pub nominal: f64,
    /// The value found.
    pub found: f64,
    /// Its standard error; a severity's counts what its law may be wrong by.
    pub sigma: f64,
    /// Its unit; empty for none.
    pub unit: &'static str,
    /// It lies on a limit of its prior.
    pub at_limit: bool,
}

/// What became of an effect in the screening.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ScreeningOutcome {
    /// Not refitted, for others promised more.
    ScreenedOut,
    /// Refitted, and the fit converged.
    Refitted,
    /// Refitted, and the fit did not converge.
    DidNotConverge,
    /// These data cannot show it.
    NotVisible,
    /// The user left it out of the search.
    LeftOut,
}

/// One effect's score at zero severity, other parameters projected out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Screened {
    /// The effect.
    pub name: String,
    /// The cell it acts on, from 1; none for all.
    pub cell: Option<usize>,
    /// Expected rise of twice the log likelihood, to first order.
    pub score: f64,
    /// Rise of twice the log likelihood by the refit; none where it was not refitted or did not converge.
    pub improvement: Option<f64>,
    /// What became of it.
    pub outcome: ScreeningOutcome,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// They are part of the JSON contract.
    #[test]
    fn names_in_json_are_fixed() {
        fn check<T: Serialize>(names: &[(T, &str)]) {
            for (value, name) in names {
                assert_eq!(serde_json::to_value(value).expect("JSON"), *name);
            }
        }
        check(&[
            (Verdict::Agrees, "agrees"),
            (Verdict::Explained, "explained"),
            (Verdict::Ambiguous, "ambiguous"),
            (Verdict::OutsideLibrary, "outside-library"),
        ]);
        check(&[
            (StageKind::Baseline, "baseline"),
            (StageKind::Recalibrated, "recalibrated"),
            (StageKind::BestWrong, "best-wrong"),
            (StageKind::Step, "step"),
            (StageKind::Named, "named"),
            (StageKind::Law, "law"),
            (StageKind::FreeForm, "free-form"),
            (StageKind::Floor, "floor"),
        ]);
        check(&[
            (ExperimentChange::Run(RunChange::Slope), "slope_deg"),
            (ExperimentChange::Run(RunChange::Cycle), "cycle_s"),
            (ExperimentChange::Run(RunChange::Start), "start_m"),
            (ExperimentChange::Run(RunChange::Payload), "payload_kg"),
            (ExperimentChange::Run(RunChange::Cycles), "cycles"),
            (ExperimentChange::Run(RunChange::Dwell), "dwell_s"),
            (ExperimentChange::Measurement("cut the tether"), "cut the tether"),
        ]);
        check(&[
            (ScreeningOutcome::ScreenedOut, "screened-out"),
            (ScreeningOutcome::Refitted, "refitted"),
            (ScreeningOutcome::DidNotConverge, "did-not-converge"),
            (ScreeningOutcome::NotVisible, "not-visible"),
            (ScreeningOutcome::LeftOut, "left-out"),
        ]);
    }
}
