//! The search itself, step by step.

use super::answer::Answer;
use super::assemble;
use super::cross_validation;
use super::error::ExplainError;
use super::hypothesis::Hypothesis;
use super::model_selection::{self, Open};
use super::parameter::Nuisance;
use super::prepare::{prepare, recalibrate};
use super::refit::{REFITTED, alone, pair_up, refit};
use super::score_test;
use super::speed_droop::speed_droop;
use crate::experiment::{Progress, RecordedRun};
use worm_estimator::config::Config;

/// Single effects from which pairs are tried where the best leaves a gap; from the best alone where it leaves none.
const PAIR_SEEDS: usize = 2;
/// Factor on the improvement that chance reaches one time in twenty, and the smallest threshold: real pads, cams and tips are not quite
/// those of the model. Chosen on the development split.
const SAFETY: f64 = 2.5;
const MIN_IMPROVEMENT: f64 = 26.0;

/// Options of the search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Seed of everything drawn: the same input and seed give the same answer.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { seed: 1 }
    }
}

/// Searches for the effect that the model lacks.
///
/// # Errors
/// [`ExplainError`] names the recording and the remedy.
pub fn explain(
    runs: &[RecordedRun<'_>],
    config: &Config,
    options: &Options,
    progress: &mut dyn FnMut(Progress),
) -> Result<Answer, ExplainError> {
    let mut report = |stage: &'static str, fraction: f64| progress(Progress { stage, fraction });
    report("gait", 0.0);
    let scene = prepare(runs, config)?;
    let phase_recorded = scene.observed.iter().any(|observed| observed.phase_recorded);
    report("recalibration", 0.03);
    let nuisances = Nuisance::all(config.worm.cells, runs.len(), phase_recorded);
    let (problem, recalibrated) = recalibrate(&scene, &Hypothesis::new(&nuisances, &[]))?;
    report("screening", 0.15);
    let hypothesised = score_test::hypotheses(config.worm.cells, phase_recorded);
    let (screened, chance) = score_test::screen(&problem, &recalibrated, &hypothesised, options.seed);
    report("refit", 0.3);
    let nominal = problem.with_derivatives(&recalibrated.hypothesis, recalibrated.hypothesis.neutral());
    let mut candidates = refit(
        &problem,
        &recalibrated,
        &nominal,
        &screened,
        REFITTED,
        &mut |fraction| report("refit", 0.3 + 0.35 * fraction),
    );
    let threshold = (SAFETY * chance).max(MIN_IMPROVEMENT);
    report("held-out selection", 0.65);
    let folds = cross_validation::folds(&problem);
    let recalibrated_held_out = cross_validation::hold_out(&problem, &recalibrated, &folds);
    model_selection::hold_out(&problem, &recalibrated, &mut candidates, &folds);
    report("pairs", 0.75);
    let open = Open::of(&problem, &recalibrated);
    let mut pairs = Vec::new();
    if let Some(best) = candidates.first().filter(|best| best.improvement > threshold) {
        let seeds = if open.is_closed(&problem, &best.fit) {
            1
        } else {
            PAIR_SEEDS
        };
        let seeds = model_selection::kinds(&candidates).into_iter().take(seeds);
        pairs = pair_up(&problem, &recalibrated, seeds, &hypothesised, threshold, options.seed);
        model_selection::hold_out(&problem, &recalibrated, &mut pairs, &folds);
        if let Some(alone) = pairs
            .first()
            .and_then(|pair| alone(&problem, &recalibrated, &candidates[0], pair))
        {
            candidates[0] = alone;
            model_selection::hold_out(&problem, &recalibrated, &mut candidates[..1], &folds);
        }
    }
    report("judgement", 0.9);
    let selected = model_selection::select_model(
        &problem,
        &open,
        candidates,
        pairs,
        threshold,
        recalibrated_held_out.chi_squared,
    );
    let cycles_s: Vec<f64> = runs
        .iter()
        .map(|run| run.cycle_s.unwrap_or(config.gait.cycle_s))
        .collect();
    let speed_droop = speed_droop(
        &scene,
        selected
            .candidates
            .first()
            .map_or(&recalibrated, |candidate| &candidate.fit),
        &cycles_s,
    );
    report("localisation", 0.93);
    let parts = assemble::Parts {
        nominal,
        recalibrated,
        recalibrated_held_out,
        screened,
        selected,
        speed_droop,
        threshold,
    };
    Ok(assemble::assemble(&problem, config, &parts))
}
