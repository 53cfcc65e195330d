//! The answer on a servo, put together from what was found.

use super::answer::{FrictionRemainder, RunSeries, ServoAnswer, ServoFigures, ServoRun, ServoStage, Supply};
use super::calibration::{calibration, far_off};
use super::friction_map::{map, places};
use super::gap::{Stages, closed, mean_absolute, residual_rad};
use super::next_experiment::propose;
use super::predict::predict;
use super::present_current::decide;
use super::recorded_servo::{RecordedServo, ServoProblem};
use crate::bench::ServoModel;
use crate::explain::answer::{NamedEffect, StageKind, Verdict};
use crate::explain::assemble::{found_onset_in, law_that_outdid, named_effects, screening_of_servo};
use crate::explain::search::cross_validation::hold_out;
use crate::explain::search::find::Found;
use crate::explain::search::fit::Fit;
use crate::explain::search::folds::Folds;
use crate::explain::search::judge::candidate::Candidate;
use crate::explain::search::law::find::FoundLaw;
use crate::explain::search::law::fitted_law::FittedLaw;
use crate::explain::search::parameter::{Onset, What};
use crate::explain::words;
use worm_estimator::number::significant;

/// Places listed at most.
const PLACES: usize = 12;
/// What everything is judged on.
const HELD_OUT: &str = "trajectories and gains";

/// Everything that the answer is made of.
pub(super) struct Parts {
    pub folds: Folds,
    pub recalibrated: Fit,
    pub found: Found,
    /// Where no effect explains the data.
    pub law: Option<FoundLaw>,
    /// Standard deviation of the discrepancy, rad.
    pub discrepancy_rad: f64,
}

/// Puts the answer together.
pub(super) fn assemble(problem: &ServoProblem<'_, '_>, nominal: &ServoModel, parts: &Parts) -> ServoAnswer {
    let servo = problem.plant;
    let (found, recalibrated) = (&parts.found, &parts.recalibrated);
    let selected = &found.selected;
    let named: &[Candidate] = match selected.verdict {
        Verdict::Explained | Verdict::Ambiguous => &selected.candidates,
        Verdict::Agrees | Verdict::OutsideLibrary => &[],
    };
    let without = &found.recalibrated_held_out;
    let closure = |candidate: &Candidate| {
        let held_out = candidate.held_out.as_ref();
        let (left, open) = held_out.map_or_else(Default::default, |held_out| held_out.determined_beside(without));
        closed(servo, (recalibrated, &open), (&candidate.fit, &left), servo.scatter_rad)
    };
    let closures: Vec<(f64, [f64; 2])> = named.iter().map(closure).collect();
    let of_wrong = selected.best_wrong.as_ref().map_or(0.0, |wrong| closure(wrong).0);
    let margin = |place: usize| {
        let others = closures.iter().enumerate().filter(|(other, _)| *other != place);
        closures[place].0 - others.map(|(_, other)| other.0).fold(of_wrong, f64::max)
    };
    // No effect of a servo begins in mid-run.
    let when = |onset: Onset| found_onset_in(None, onset, |_| f64::NAN);
    let of_each: Vec<Vec<NamedEffect>> = named
        .iter()
        .enumerate()
        .map(|(place, candidate)| {
            named_effects(
                &when,
                candidate,
                selected.probability[place],
                closures[place],
                margin(place),
            )
        })
        .collect();
    let effects = of_each.first().cloned().unwrap_or_default();
    let is_new = |rival: &NamedEffect| !effects.iter().any(|effect| effect.name == rival.name);
    let mut rivals: Vec<NamedEffect> = of_each
        .iter()
        .skip(1)
        .flatten()
        .filter(|rival| is_new(rival))
        .cloned()
        .collect();
    if of_each.len() > 1 && rivals.is_empty() {
        rivals = of_each[1..].concat();
    }
    let of_law = parts
        .law
        .as_ref()
        .filter(|found| found.law.says_something())
        .and_then(|found| {
            let (left, open) = found.law.held_out.determined_beside(without);
            let closure = closed(servo, (recalibrated, &open), (&found.law.fit, &left), servo.scatter_rad);
            Some((&found.law, law_that_outdid(found, closure, HELD_OUT)?))
        });
    let fitted_law = of_law.as_ref().map(|(law, _)| *law);
    let verdict = selected.verdict;
    let best = selected.candidates.first().map(|candidate| &candidate.fit);
    // What the answer adds to the model: an effect, or a law.
    let with_answer = named
        .first()
        .map(|candidate| &candidate.fit)
        .or(fitted_law.map(|law| &law.fit));
    let final_fit = with_answer.unwrap_or(recalibrated);
    let map_before = map(servo, &servo.physics(recalibrated));
    let map_after = match (verdict, with_answer.or(best)) {
        (Verdict::Agrees, _) | (_, None) => Vec::new(),
        (_, Some(best)) => map(servo, &servo.physics(best)),
    };
    let mut where_before = places(servo, &map_before);
    where_before.truncate(PLACES);
    let remainder = (verdict == Verdict::OutsideLibrary).then(|| {
        let best = map(servo, &servo.physics(best.unwrap_or(recalibrated)));
        let mut places = places(servo, &best);
        places.truncate(PLACES);
        FrictionRemainder {
            description: remainder_in_words(found.open_share, &places),
            open_share: found.open_share,
            places,
        }
    });
    let current = decide(&servo.observed, &servo.physics(final_fit));
    let runs = runs(servo, parts, with_answer);
    let agrees = |run: &ServoRun| run.mean_absolute_error_rad[if with_answer.is_none() { 1 } else { 2 }];
    let mut sentence = words::sentence(verdict, &effects, &rivals, selected, found.open_share, None, HELD_OUT);
    if let Some((_, law)) = &of_law {
        sentence = format!("{sentence} {}", law.sentence);
    }
    sentence = format!("{sentence} {}", current.sentence);
    let mut model = written(servo, nominal, final_fit);
    let far_off = far_off(servo, final_fit);
    model.current = current.measures.unwrap_or(nominal.current);
    ServoAnswer {
        plant: "servo-bench",
        verdict,
        sentence,
        r#where: where_before,
        effects,
        rivals,
        stages: stages(problem, parts, named, fitted_law),
        law: of_law.map(|(_, law)| law),
        remainder,
        next_experiment: match verdict {
            Verdict::Ambiguous => propose(servo, named, parts.discrepancy_rad),
            _ => None,
        },
        calibration: calibration(servo, final_fit),
        far_off: far_off.clone(),
        screening: screening_of_servo(found),
        threshold: found.threshold,
        null_probability: selected.null_probability(),
        other_probability: selected.other_probability(),
        agrees_within_rad: runs.iter().map(agrees).fold(0.0, f64::max),
        discrepancy_rad: parts.discrepancy_rad,
        current,
        supply: servo.supply.map(|reading| Supply {
            unloaded_v: reading.unloaded_v,
            ohm: reading.ohm,
            sigma_ohm: reading.sigma_ohm,
        }),
        warnings: far_off
            .into_iter()
            .map(|one| one.description)
            .chain(warnings(servo, final_fit, &parts.folds))
            .collect(),
        repairs: Vec::new(),
        figures: ServoFigures {
            map_before,
            map_after,
            runs: series(servo, recalibrated, with_answer),
            model_diff: Vec::new(),
            model,
        },
        runs,
    }
}

/// The gap in the order in which it closes: the effects of a pair alone come before it.
fn stages(
    problem: &ServoProblem<'_, '_>,
    parts: &Parts,
    named: &[Candidate],
    law: Option<&FittedLaw>,
) -> Vec<ServoStage> {
    let servo = problem.plant;
    let found = &parts.found;
    let measured = Stages::new(servo, &parts.folds);
    let names = |candidate: &Candidate| {
        let names: Vec<&str> = candidate.named().map(|(_, one)| one.effect.name).collect();
        Some(names.join(" + "))
    };
    let stage = |kind: StageKind, candidate: &Candidate| {
        let held_out = candidate.held_out.clone().unwrap_or_else(|| {
            let fit = problem.with_derivatives(&candidate.fit.hypothesis, candidate.fit.at.clone());
            hold_out(problem, &fit, &parts.folds)
        });
        measured.stage(kind, names(candidate), &candidate.fit, Some(&held_out))
    };
    let mut stages = vec![
        measured.stage(StageKind::Baseline, None, &found.nominal, None),
        measured.stage(
            StageKind::Recalibrated,
            None,
            &parts.recalibrated,
            Some(&found.recalibrated_held_out),
        ),
    ];
    let is_named = |single: &Candidate| {
        let all = named.first().map_or(&[][..], |first| &first.hypothesised);
        single.hypothesised.iter().all(|one| all.contains(one))
    };
    let singles = || found.fitted.iter().filter(|one| one.hypothesised.len() == 1);
    let is_pair = named.first().is_some_and(|first| first.is_pair());
    let mut steps: Vec<ServoStage> = singles()
        .filter(|single| is_pair && is_named(single))
        .map(|single| stage(StageKind::Step, single))
        .collect();
    steps.sort_by(|a, b| b.fit_mean_absolute_error_rad.total_cmp(&a.fit_mean_absolute_error_rad));
    stages.extend(steps);
    // The best single effect that is no part of the answer.
    let wrong = singles()
        .filter(|single| !is_named(single))
        .min_by(|a, b| a.fit.chi_squared.total_cmp(&b.fit.chi_squared));
    stages.extend(wrong.map(|wrong| stage(StageKind::BestWrong, wrong)));
    stages.extend(named.first().map(|candidate| stage(StageKind::Named, candidate)));
    stages.extend(law.map(|law| {
        let name = Some(law.shape.to_string());
        measured.stage(StageKind::Law, name, &law.fit, Some(&law.held_out))
    }));
    stages.push(measured.free_form(problem, &parts.recalibrated, &parts.folds));
    stages.push(measured.floor());
    stages
}

fn runs(servo: &RecordedServo<'_>, parts: &Parts, with_answer: Option<&Fit>) -> Vec<ServoRun> {
    let of_run = |run: usize| {
        let observed = &servo.observed[run];
        let error = |fit: &Fit| mean_absolute(&residual_rad(servo, run, fit));
        let energy = |fit: &Fit| predict(observed, &servo.physics(fit)).energy.electrical_j;
        let of_answer = |of: &dyn Fn(&Fit) -> f64| with_answer.map_or(f64::NAN, of);
        ServoRun {
            recording: observed.name(),
            trajectory: observed.trajectory_name.clone(),
            position_p_gain: observed.gain,
            readings: observed.recording.readings(),
            duration_s: observed.recording.duration_s(),
            mean_absolute_error_rad: [
                error(&parts.found.nominal),
                error(&parts.recalibrated),
                of_answer(&error),
            ],
            electrical_j: [energy(&parts.recalibrated), of_answer(&energy)],
        }
    };
    (0..servo.observed.len()).map(of_run).collect()
}

fn series(servo: &RecordedServo<'_>, recalibrated: &Fit, with_answer: Option<&Fit>) -> Vec<RunSeries> {
    let of_run = |observed: &super::observed::Observed<'_>| RunSeries {
        name: format!("{}, gain {}", observed.trajectory_name, observed.gain),
        time_s: observed.recording.time_s.clone(),
        goal_rad: observed.recording.goal_rad.clone(),
        measured_rad: observed.recording.position_rad.clone(),
        recalibrated_rad: predict(observed, &servo.physics(recalibrated)).angle_rad,
        named_rad: with_answer.map_or_else(Vec::new, |fit| predict(observed, &servo.physics(fit)).angle_rad),
    };
    servo.observed.iter().map(of_run).collect()
}

/// The model with a fit in it.
fn written(servo: &RecordedServo<'_>, nominal: &ServoModel, fit: &Fit) -> ServoModel {
    let mut plain = fit.hypothesis.clone();
    plain.hypothesised.clear();
    plain.law = None;
    let (free, at): (Vec<_>, Vec<f64>) = fit
        .hypothesis
        .free
        .iter()
        .zip(&fit.at)
        .filter(|(free, _)| matches!(free.what, What::Nuisance(_)))
        .map(|(free, at)| (*free, *at))
        .unzip();
    plain.free = free;
    let physics = super::predict::physics(&servo.nominal, &plain, &at);
    let mut effects = nominal.effects.clone();
    effects.extend(fit.hypothesis.settings(&fit.at));
    ServoModel {
        name: nominal.name.clone(),
        motor: physics.motor,
        zero_rad: physics.pendulum.zero_rad,
        current: nominal.current,
        effects,
    }
}

fn remainder_in_words(open_share: f64, places: &[super::answer::FrictionPlace]) -> String {
    let whole = format!("{:.0} % of the gap stays open", 100.0 * open_share);
    match places.first() {
        Some(place) => format!(
            "{whole}; friction is most wrong at {} to {} rad/s under {} to {} N m on the gears: {:+.1} mN m ({:.1} standard errors)",
            place.speed_rad_s[0],
            place.speed_rad_s[1],
            place.load_n_m[0],
            place.load_n_m[1],
            1e3 * place.residual_n_m,
            place.significance
        ),
        None => format!("{whole}; friction is wrong at no one speed and load"),
    }
}

fn warnings(servo: &RecordedServo<'_>, fit: &Fit, folds: &Folds) -> Vec<String> {
    let mut warnings = Vec::new();
    if folds.partitions < 2.0 {
        warnings.push(
            "all runs have the same goals or the same gain: whether the answer holds for others is not known; record several of both"
                .to_owned(),
        );
    }
    let limits = fit.hypothesis.free.iter().enumerate();
    let at_limit = limits
        .filter(|(at, free)| matches!(free.what, What::Nuisance(_)) && fit.would_go_beyond(*at))
        .count();
    if at_limit > 0 {
        warnings.push(format!(
            "{at_limit} of the recalibrated values lie at the end of what their priors allow: see the calibration"
        ));
    }
    if let Some(reading) = &servo.supply {
        let asked = fit.hypothesis.settings(&fit.at);
        let sag = asked.iter().find(|setting| setting.effect().name == "supply-sag");
        if let Some(sag) = sag {
            warnings.push(format!(
                "supply-sag asks for {} Ω, and the reported voltages show {} ± {} Ω",
                significant(sag.values()[0], 2),
                significant(reading.ohm, 2),
                significant(reading.sigma_ohm, 2)
            ));
        }
    }
    warnings
}
