//! The search where only advances per cycle are known, and no positions.
//!
//! Often a few scalars are all there is: the advance per cycle on some slopes. They are few, and with a dozen quantities of any worm
//! uncertain, much explains them. So the model is recalibrated against them within the same priors as against recordings. Where it
//! still misses them by more than chance, every effect of the library that changes the advance of a steady crawl is fitted on top.
//! The answer is the set of all effects that bring the model within chance, and what to record to decide between them. A single effect
//! is named only where it is alone *and* there are more scalars than quantities that they have to determine; three scalars never are.
//!
//! What needs positions stays empty in the [`Answer`]: places of disagreement, maps, cycles, and all held-out figures.
//!
//! Pure, like the search on recordings, and deterministic without a seed.
//!
//! # Modules
//! - `table`: the scalars, what a hypothesis predicts of them, and its fit.
//! - `model_selection`: chance, the set, the verdict and its sentence.
//! - `next_experiment`: what to record.

mod model_selection;
mod next_experiment;
mod table;

use super::answer::{Answer, Doubt, Figures, RunSummary, Screened, ScreeningOutcome, Stage, StageKind};
use super::assemble::{add_unscreened, calibration, found_onset_in, named_effects};
use super::error::ExplainError;
use crate::experiment::Progress;
use crate::explain::search::fit::Fit;
use crate::explain::search::hypothesis::Hypothesis;
use crate::explain::search::judge::candidate::Candidate;
use crate::explain::search::parameter::{Free, Hypothesised, Onset};
use crate::explain::worm::nuisance::Nuisance;
use crate::explain::worm::plant::hypotheses;
use crate::recording::Advance;
use model_selection::{AdvanceKind, Selected};
use rayon::prelude::*;
use table::Table;
use worm_estimator::config::Config;
use worm_physics::effect::{Effect, LIBRARY};

/// Fewest advances that depend on more than the stroke.
const MIN_ADVANCES: usize = 2;
/// Severities that are tried before a fit, in notable changes from neutral to either side, and how many fits then start from the most
/// promising.
const SEVERITIES: [f64; 10] = [0.0, 1.0, 2.0, 4.0, 7.0, 10.0, 15.0, 25.0, 50.0, 100.0];
const STARTS: usize = 2;
/// Chi-squared by which a start may be worse than the most promising one.
const MAX_EXCESS: f64 = 20.0;
/// An effect that changes no advance by more than this, m, at any of these does not show in advances.
const VISIBLE_M: f64 = 1e-6;

/// Name of an advance, in the place of a recording's file name.
fn name(advance: &Advance) -> String {
    format!("the advance measured at {}°", advance.slope_deg).replace('-', "−")
}

/// Finds which effects the model may miss, by advances alone.
///
/// # Errors
/// [`ExplainError::FewAdvances`] for fewer than two, [`ExplainError::NoSigma`] for a standard error that is none,
/// [`ExplainError::SlidesDown`] where the configured worm could not have made one, and whatever is wrong with its configuration.
pub fn explain_advances(
    advances: &[Advance],
    config: &Config,
    progress: &mut dyn FnMut(Progress),
) -> Result<Answer, ExplainError> {
    let mut report = |stage: &'static str, fraction: f64| progress(Progress { stage, fraction });
    if advances.len() < MIN_ADVANCES {
        return Err(ExplainError::FewAdvances { found: advances.len() });
    }
    report("recalibration", 0.0);
    let table = Table::new(advances, config)?;
    let nuisances = nuisances(config.worm.cells, advances.len());
    let plain = Hypothesis::new(&nuisances, &[]);
    let nominal = table.evaluate(&plain, &plain.neutral());
    let recalibrated = table.fit(&plain, &plain.neutral());
    report("refit", 0.1);
    let hypothesised = hypotheses(config.worm.cells, false);
    let mut candidates: Vec<Option<Candidate>> = Vec::with_capacity(hypothesised.len());
    // A few at a time, to report progress.
    for some in hypothesised.chunks(8) {
        let some = some.par_iter();
        candidates.par_extend(some.map(|&hypothesised| refit(&table, &nominal, &recalibrated, hypothesised)));
        report("refit", 0.1 + 0.8 * candidates.len() as f64 / hypothesised.len() as f64);
    }
    report("judgement", 0.9);
    let screening = screening(&hypothesised, &candidates);
    let selected = model_selection::select_model(&table, &recalibrated, candidates.into_iter().flatten().collect());
    Ok(assemble(&table, config, &nominal, &recalibrated, screening, &selected))
}

/// The nuisances that change an advance: neither the clock nor those of the first moment of a slide.
fn nuisances(cells: usize, runs: usize) -> Vec<Free> {
    let within_a_cycle = |nuisance: Nuisance| {
        matches!(
            nuisance,
            Nuisance::Damping | Nuisance::Presliding | Nuisance::Viscosity | Nuisance::Breakaway
        )
    };
    let mut all = Nuisance::all(cells, runs, false);
    all.retain(|free| !Nuisance::of(free.what).is_some_and(within_a_cycle));
    all
}

/// An effect fitted on top of the recalibrated model, from the most promising of many severities; none where it does not show in
/// advances.
fn refit(table: &Table<'_>, nominal: &Fit, recalibrated: &Fit, hypothesised: Hypothesised) -> Option<Candidate> {
    let hypothesis = Hypothesis::new(&recalibrated.hypothesis.free, &[hypothesised]);
    let trial_values = trial_values(hypothesised.effect);
    if !trial_values
        .iter()
        .any(|values| table.shows(&hypothesis, nominal, values, VISIBLE_M))
    {
        return None;
    }
    let mut promising: Vec<(f64, Vec<f64>)> = trial_values
        .iter()
        .filter_map(|values| table.promise(&hypothesis, nominal, values))
        .collect();
    promising.sort_by(|a, b| a.0.total_cmp(&b.0));
    let limit = promising.first()?.0 + MAX_EXCESS;
    let mut fits: Vec<Fit> = promising
        .iter()
        .take(STARTS)
        .filter(|(promised, _)| *promised < limit)
        .map(|(_, from)| table.fit(&hypothesis, from))
        .collect();
    if fits.iter().all(|fit| fit.chi_squared > recalibrated.chi_squared) {
        // From neutral: an effect that is free to do nothing never fits worse than none.
        fits.push(table.fit(&hypothesis, &[&recalibrated.at[..], &trial_values[0]].concat()));
    }
    let fit = fits
        .into_iter()
        .min_by(|a, b| a.chi_squared.total_cmp(&b.chi_squared))?;
    Some(Candidate {
        hypothesised: vec![hypothesised],
        improvement: recalibrated.chi_squared - fit.chi_squared,
        held_out: None,
        trace: None,
        ln_onset: 0.0,
        evidence: None,
        fit,
    })
}

/// Values of an effect's parameters to try, with severities on either side of neutral.
fn trial_values(effect: &Effect) -> Vec<Vec<f64>> {
    let severity = effect.severity();
    let sides = SEVERITIES.iter().flat_map(|&notable| [notable, -notable]);
    sides
        .map(|notable| severity.neutral + notable * severity.notable)
        .filter(|value| (severity.min..=severity.max).contains(value))
        .map(|value| effect.values_with_neutral_shape(value))
        .collect()
}

/// What became of every hypothesis, best first, and of the effects that were none.
fn screening(hypothesised: &[Hypothesised], candidates: &[Option<Candidate>]) -> Vec<Screened> {
    let mut rows: Vec<Screened> = hypothesised
        .iter()
        .zip(candidates)
        .map(|(hypothesised, candidate)| Screened {
            name: hypothesised.effect.name.to_owned(),
            cell: hypothesised.cell.map(|cell| cell + 1),
            score: candidate.as_ref().map_or(0.0, |candidate| candidate.improvement),
            improvement: candidate
                .as_ref()
                .filter(|candidate| candidate.fit.converged)
                .map(|candidate| candidate.improvement),
            outcome: match candidate {
                None => ScreeningOutcome::NotVisible,
                Some(candidate) if candidate.fit.converged => ScreeningOutcome::Refitted,
                Some(_) => ScreeningOutcome::DidNotConverge,
            },
        })
        .collect();
    rows.sort_by(|a, b| b.score.total_cmp(&a.score));
    add_unscreened(&mut rows, &LIBRARY, |_| ScreeningOutcome::NotVisible);
    rows
}

fn assemble(
    table: &Table<'_>,
    config: &Config,
    nominal: &Fit,
    recalibrated: &Fit,
    screening: Vec<Screened>,
    selected: &Selected,
) -> Answer {
    // None of these begins in mid-run, for a table has no cycles.
    let when = |onset: Onset| found_onset_in(None, onset, |_| f64::NAN);
    let mut named = selected
        .set
        .iter()
        .zip(&selected.probability)
        .flat_map(|(kind, &probability)| {
            let mut named = named_effects(&when, &kind.candidate, probability, (f64::NAN, [f64::NAN; 2]), f64::NAN);
            // The parameters are still those of one cell, and name it.
            named
                .iter_mut()
                .filter(|_| kind.is_any_cell())
                .for_each(|named| named.cell = None);
            named
        });
    let effects: Vec<_> = named.by_ref().take(1).collect();
    let rivals: Vec<_> = named.collect();
    let stage = |stage: StageKind, kind: Option<&AdvanceKind>, fit: &Fit| Stage {
        stage,
        effect: kind.map(AdvanceKind::name),
        fit_rms_m: f64::NAN,
        held_out_rms_m: f64::NAN,
        held_out_interval_m: [f64::NAN; 2],
        torque: None,
        advance_error_m: table.mean_error_m(fit),
        advance_error_interval_m: [f64::NAN; 2],
        energy_error_j: f64::NAN,
    };
    let mut stages = vec![
        stage(StageKind::Baseline, None, nominal),
        stage(StageKind::Recalibrated, None, recalibrated),
    ];
    let wrong = selected.others.first();
    stages.extend(wrong.map(|kind| stage(StageKind::BestWrong, Some(kind), &kind.candidate.fit)));
    let best = selected.set.first();
    stages.extend(best.map(|kind| stage(StageKind::Named, Some(kind), &kind.candidate.fit)));
    // An effect that is not proven is not written into the model.
    let kept = best
        .filter(|_| selected.is_proven)
        .map_or(recalibrated, |kind| &kind.candidate.fit);
    let runs = table.advances.iter().enumerate().map(|(run, advance)| RunSummary {
        recording: name(advance),
        slope_deg: advance.slope_deg,
        payload_kg: advance.payload_kg,
        cycles: 0,
        cycle_s: advance.cycle_s.unwrap_or(config.gait.cycle_s),
        phase_recorded: false,
        laid_down: false,
        sees_positions: true,
        noise_m: f64::NAN,
        drift_per_cycle_m: f64::NAN,
        advance_m: [
            advance.advance_m,
            table.advance_m(run, recalibrated),
            best.map_or(f64::NAN, |kind| table.advance_m(run, &kind.candidate.fit)),
        ],
        current: None,
        advance_sigma_m: Some(advance.sigma_m),
    });
    Answer {
        verdict: selected.verdict,
        sentence: selected.sentence(recalibrated),
        effects,
        rivals,
        r#where: Vec::new(),
        stages,
        remainder: selected.remainder(table, recalibrated),
        law: None,
        next_experiment: next_experiment::propose(table, recalibrated, selected),
        calibration: calibration(kept, config),
        written_back: calibration(kept, config),
        screening,
        threshold: model_selection::chance(table.advances.len()),
        doubt: Doubt::default(),
        runs: runs.collect(),
        warnings: selected.warnings(kept),
        repairs: Vec::new(),
        figures: Figures::default(),
    }
}
