//! The answer, put together from what was found.

mod calibration;
mod effects;
mod law;
mod runs;
mod screening;
mod stages;

use super::answer::{Answer, Doubt, Figures, NamedEffect, Remainder, ResidualMap, RunSummary, Verdict};
use super::experiment_design::propose;
use super::residual_map::{map, places};
use super::words;
use super::worm::gap::cycles;
use crate::explain::search::find::Found;
use crate::explain::search::fit::Fit;
use crate::explain::search::judge::candidate::Candidate;
use crate::explain::search::law::find::FoundLaw;
use crate::explain::search::parameter::{Free, Onset, What};
use crate::explain::worm::irregularity::friction_scatter;
use crate::explain::worm::misstated_conditions::in_words;
use crate::explain::worm::noise::RunNoise;
use crate::explain::worm::nuisance::Nuisance;
use crate::explain::worm::period::period;
use crate::explain::worm::recorded_worm::{RecordedWorm, WormProblem};
use crate::explain::worm::speed_droop::SpeedDroop;
use crate::explain::worm::torque_cycle::torque_cycles;
pub(super) use calibration::calibration;
pub(super) use effects::{found_onset_in, named_effects};
pub(super) use law::law_that_outdid;
pub(super) use screening::{add_unscreened, of_servo as screening_of_servo};
use worm_estimator::config::Config;

/// Places listed at most.
const PLACES: usize = 12;
/// Standard errors that a normal quantity stays below with a probability of 95 %.
const ONE_SIDED: f64 = 1.645;
/// Standard deviation that holds an effect where it was found, in steps of its derivatives.
const HELD: f64 = 1e-3;
/// Share of what the best effect improves the fit by from which a wrong slope is worth a word.
const AS_GOOD: f64 = 0.9;
/// Improvement from which a motor that droops is named: chance reaches 4 one time in twenty, and there is one such quantity.
const DROOPS: f64 = 16.0;

/// Everything that the answer is made of.
pub(super) struct Parts {
    pub recalibrated: Fit,
    pub found: Found,
    pub speed_droop: Option<SpeedDroop>,
    /// Standard deviation of the discrepancy, m.
    pub discrepancy_m: f64,
    /// Where no effect explains the data.
    pub law: Option<FoundLaw>,
}

/// Puts the answer together.
pub(super) fn assemble(problem: &WormProblem<'_, '_>, config: &Config, parts: &Parts) -> Answer {
    let worm = problem.plant;
    let found = &parts.found;
    let selected = &found.selected;
    let speed_droop = parts
        .speed_droop
        .as_ref()
        .filter(|speed_droop| speed_droop.improvement > DROOPS);
    let named: &[Candidate] = match selected.verdict {
        Verdict::Explained | Verdict::Ambiguous => &selected.candidates,
        Verdict::Agrees | Verdict::OutsideLibrary => &[],
    };
    let of_law = parts.law.as_ref().and_then(|found| {
        let without = &parts.found.recalibrated_held_out;
        let closure = law::closure_of_worm(worm, &parts.recalibrated, without, &found.law);
        Some((&found.law, law::law(found, closure, "cycles")?))
    });
    let gap = stages::Gap::measure(worm, parts, named, of_law.as_ref().map(|(law, _)| *law));
    let verdict = match (selected.verdict, speed_droop) {
        (Verdict::Agrees, Some(_)) => Verdict::Explained,
        (verdict, _) => verdict,
    };
    let mut effects = Vec::new();
    let mut rivals = Vec::new();
    for (place, candidate) in named.iter().enumerate() {
        let found = named_effects(
            &|onset| effects::found_onset(&worm.scene.observed, onset),
            candidate,
            selected.probability[place],
            gap.closure[place],
            gap.margin(place),
        );
        if place == 0 {
            effects = found;
        } else {
            // An effect that the first answer names is no rival of it.
            let is_new = |effect: &NamedEffect| {
                !effects
                    .iter()
                    .any(|named: &NamedEffect| named.in_words() == effect.in_words())
            };
            rivals.extend(found.into_iter().filter(is_new));
        }
    }
    effects.extend(speed_droop.map(effects::droop_effect));
    let meant = found.misstated.as_ref().filter(|_| selected.is_misstated());
    let without_effects = meant.map_or(&parts.recalibrated, |misstated| &misstated.fit);
    let final_fit = named.first().map_or(without_effects, |candidate| &candidate.fit);
    let maps_before = maps(worm, &parts.recalibrated);
    let best = selected.candidates.first().map(|candidate| &candidate.fit);
    let maps_after = match verdict {
        Verdict::Agrees => Vec::new(),
        _ => best.map_or_else(Vec::new, |fit| maps(worm, fit)),
    };
    let torque = torque_cycles(worm, &parts.recalibrated, named.first().map(|candidate| &candidate.fit));
    let change = selected.change.map(|change| {
        let onset = Onset::from(change.cycle as f64, change.run);
        effects::found_onset(&worm.scene.observed, onset)
    });
    let of_best = best
        .filter(|_| verdict != Verdict::Agrees)
        .unwrap_or(&parts.recalibrated);
    let scatter = friction_scatter(worm, &worm.predictions(of_best));
    let remainder = (verdict == Verdict::OutsideLibrary).then(|| {
        let places = places(&maps_after, PLACES);
        let period = period(worm, of_best);
        Remainder {
            description: match worm.sees_positions() {
                true => words::remainder(found.open_share, &places),
                false => words::remainder_of_torque(worm, found.open_share, &torque),
            },
            open_share: found.open_share,
            onset: change.clone(),
            period_cycles: period.cycles,
            period_m: period.displacement_m,
            places,
        }
    });
    let cycle_s = config.gait.cycle_s;
    let next_experiment = match verdict {
        Verdict::Ambiguous => {
            let fits: Vec<&Fit> = named.iter().map(|candidate| &candidate.fit).collect();
            propose(worm, &fits, cycle_s)
        }
        _ => None,
    };
    let runs = runs::runs(worm, parts, named.first());
    let written_back = as_written(problem, of_law.as_ref().map_or(final_fit, |(law, _)| &law.fit));
    let misstated = found.misstated.as_ref().map(|misstated| in_words(worm, misstated));
    let misstated = misstated.as_ref().map(|(what, what_to_do)| (&what[..], *what_to_do));
    let suspicion = misstated.and_then(|what| words::suspicion(what, verdict, selected, is_as_good(found)));
    let verdict_in_words = match misstated {
        Some(what) if selected.is_misstated() => words::misstated(what, selected.misstated_probability),
        _ => {
            let sentence = words::sentence(
                verdict,
                &effects,
                &rivals,
                selected,
                found.open_share,
                change.as_ref(),
                "cycles",
            );
            let irregular = scatter.filter(|_| verdict == Verdict::OutsideLibrary && selected.is_irregular);
            let sentence = sentence + &irregular.map_or_else(String::new, words::irregularity);
            let but = suspicion.as_ref().map(|suspicion| format!(" But {suspicion}."));
            sentence + &but.unwrap_or_default()
        }
    };
    let mut warnings = words::warnings(worm, final_fit, named.first(), config.self_sensing.calibrated.is_some());
    if let Some(suspicion) = suspicion {
        warnings.insert(0, suspicion);
    }
    Answer {
        verdict,
        sentence: verdict_in_words + &words::of_pads(worm, final_fit).unwrap_or_default(),
        r#where: places(&maps_before, PLACES),
        effects,
        rivals,
        stages: gap.stages,
        remainder,
        next_experiment,
        calibration: calibration(final_fit, config),
        written_back: calibration(&written_back, config),
        law: of_law.map(|(_, law)| law),
        screening: screening::of_worm(found, speed_droop.is_some()),
        threshold: found.threshold,
        doubt: Doubt {
            null_probability: selected.null_probability(),
            other_probability: selected.other_probability(),
            misstated_probability: misstated.is_some().then_some(selected.misstated_probability),
            agrees_within_m: agrees_within_m(problem, &runs, final_fit, !named.is_empty()),
            agrees_within_j: agrees_within_j(worm, &runs, final_fit, !named.is_empty()),
            discrepancy_m: parts.discrepancy_m,
            friction_scatter: scatter,
        },
        warnings,
        repairs: words::repairs(worm),
        runs,
        figures: Figures {
            maps_before,
            maps_after,
            cycles: cycles(
                worm,
                &found.nominal,
                &parts.recalibrated,
                named.first().map(|candidate| &candidate.fit),
            ),
            torque,
            model_diff: Vec::new(),
        },
    }
}

/// Whether a mistake in the conditions improves the fit by nearly as much as the best effect: what is left may be no law's.
fn is_as_good(found: &Found) -> bool {
    let best = found
        .selected
        .candidates
        .first()
        .map_or(0.0, |candidate| candidate.improvement);
    found
        .misstated
        .as_ref()
        .is_some_and(|one| one.improvement >= AS_GOOD * best)
}

/// The fit of a model file: what it cannot hold keeps the values that every simulation has, and the effects stay as they were found.
fn as_written(problem: &WormProblem<'_, '_>, fit: &Fit) -> Fit {
    let is_written = |free: &Free| Nuisance::of(free.what).is_none_or(Nuisance::is_of_model_file);
    let mut hypothesis = fit.hypothesis.clone();
    hypothesis.free.clear();
    let mut at = Vec::new();
    for (free, &value) in fit
        .hypothesis
        .free
        .iter()
        .zip(&fit.at)
        .filter(|(free, _)| is_written(free))
    {
        let mut free = *free;
        if matches!(free.what, What::Effect { .. } | What::Law(_)) {
            (free.quantity.centre, free.quantity.sigma) = (value, HELD * free.quantity.step);
        }
        hypothesis.free.push(free);
        at.push(value);
    }
    problem.fit(&hypothesis, at, None)
}

/// The measured advances and those of the recalibrated or the named model differ on no run by more than this, m, with a probability of
/// 95 %: the measured mean has the error of the body's random walk, the model's that of its parameters.
fn agrees_within_m(problem: &WormProblem<'_, '_>, runs: &[RunSummary], fit: &Fit, is_named: bool) -> f64 {
    let of_run = |((run, noise), of_model_m): ((&RunSummary, &RunNoise), f64)| {
        let [measured_m, recalibrated_m, named_m] = run.advance_m;
        let model_m = if is_named { named_m } else { recalibrated_m };
        let of_mean_m = noise.drift_per_cycle_m() / (run.cycles as f64).sqrt();
        (measured_m - model_m).abs() + ONE_SIDED * of_mean_m.hypot(of_model_m)
    };
    let with_noise = runs.iter().zip(&problem.plant.noise);
    let all = with_noise.zip(problem.outcome_sigmas(fit)).map(of_run);
    largest(all.filter(|within_m| within_m.is_finite())).unwrap_or(f64::NAN)
}

/// The same of the work of a cycle, J, where the motor's current counts: the mean has the error of the scatter of the cycles.
fn agrees_within_j(worm: &RecordedWorm<'_>, runs: &[RunSummary], fit: &Fit, is_named: bool) -> Option<f64> {
    let of_run = |(number, run): (usize, &RunSummary)| {
        let [shown_j, recalibrated_j, named_j] = run.current?.work_j;
        let model_j = if is_named { named_j } else { recalibrated_j };
        let of_mean_j = runs::sigma_of_shown_j(worm, number, fit)?;
        Some((shown_j - model_j).abs() + ONE_SIDED * of_mean_j)
    };
    largest(runs.iter().enumerate().filter_map(of_run))
}

fn largest(values: impl Iterator<Item = f64>) -> Option<f64> {
    values.reduce(f64::max)
}

fn maps(worm: &RecordedWorm<'_>, fit: &Fit) -> Vec<ResidualMap> {
    (0..worm.scene.observed.len()).map(|run| map(worm, run, fit)).collect()
}
