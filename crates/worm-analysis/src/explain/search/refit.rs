//! Fits effects to the end: alone, and in pairs.

use super::fit::Fit;
use super::hypothesis::Hypothesis;
use super::judge::candidate::Candidate;
use super::judge::chance::Chance;
use super::judgement::Judge;
use super::local_restart::restart_locally;
use super::parameter::{Hypothesised, What};
use super::plant::Plant;
use super::problem::FitProblem;
use super::score_test::{self, Expected, Screening};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Effects that are refitted; cells of one effect that are; and how near the next cell must come to the best, as a fraction of its gain.
pub(in crate::explain) const REFITTED: usize = 8;
const CELLS_REFITTED: usize = 2;
const NEXT_CELL: f64 = 0.5;
/// Effects that are fitted roughly: those most probable by the screening.
const ROUGHLY: usize = 10;
/// Fraction of the best rough gain, and the gain, from which an effect is fitted to the end; and how many are at least.
const PROMISING: (f64, f64) = (0.4, 8.0);
const AT_LEAST: usize = 2;
/// Strengths of effects about the nominal model, in notable changes; a fit starts from that which fits best once a step has recalibrated
/// the rest.
const STRONG: [f64; 4] = [4.0, 8.0, 16.0, 32.0];
/// Chi-squared of a start, as a multiple of that without the effect, up to which it is fitted with derivatives of its own where those
/// that are known lead nowhere.
const STUCK: f64 = 1.5;
/// Effects that are refitted on top of a single one, and how many of those that screened best are tried roughly before.
const PAIRED: usize = 3;
const SCREENED_FOR_PAIRS: usize = 8;
/// Log odds against the first effect alone, by the screening, from which a second is fitted.
const MIN_LN_ODDS: f64 = -1.0;
/// Improvement from which it is worth looking for a better minimum.
const MIN_TO_LEAP: f64 = 10.0;

/// Refits every effect, roughly from several starts, and the best of them to the end; best first.
///
/// The starts are those of the screening about the recalibrated model, and strong effects about the nominal one: a strong effect
/// drives the recalibration into a corner from which screening cannot see it.
pub(in crate::explain) fn refit(
    problem: &FitProblem<'_, impl Plant>,
    base: &Fit,
    nominal: &Fit,
    screened: &[Screening],
    max: usize,
) -> Vec<Candidate> {
    let effects_from = base.at.len() - score_test::effect_quantities(&base.hypothesis);
    let hypothesis_of = |hypothesised: Hypothesised| {
        let mut all = base.hypothesis.hypothesised.clone();
        all.push(hypothesised);
        Hypothesis::new(&base.hypothesis.free[..effects_from], &all)
    };
    let nominal_normal = nominal.normal(None);
    let roughly = |screening: &Screening| {
        let hypothesis = hypothesis_of(screening.hypothesised);
        let about_base = screening.starts.iter().map(|start| (base, start.clone()));
        let strong = score_test::strong(screening.hypothesised.effect, &STRONG).into_iter();
        let recalibrated = strong.map(|start| {
            let at = [&nominal.at[..], &start].concat();
            problem.step_of_first(problem.evaluate(&hypothesis, at), &nominal.jacobian, &nominal_normal)
        });
        let about_nominal = recalibrated.min_by(|a, b| a.chi_squared.total_cmp(&b.chi_squared));
        let about_nominal = about_nominal.map(|strong| (nominal, strong.at));
        let fits = about_base
            .map(|(from, start)| (from, [&from.at[..], &start].concat()))
            .chain(about_nominal)
            .map(|(from, at)| {
                let fit = problem.fit_roughly(&hypothesis, at.clone(), Some(from));
                // Derivatives from elsewhere may lead nowhere from a start that is nearly as good as anything without the effect.
                if fit.at == at && fit.chi_squared < STUCK * base.chi_squared {
                    return problem.fit(&hypothesis, at, None);
                }
                fit
            });
        fits.min_by(|a, b| a.chi_squared.total_cmp(&b.chi_squared))
    };
    let mut rough: Vec<Fit> = screened.par_iter().take(ROUGHLY).filter_map(roughly).collect();
    rough.sort_by(|a, b| a.chi_squared.total_cmp(&b.chi_squared));
    let to_the_end = |rough: &Fit| {
        let mut fit = problem.fit(&rough.hypothesis, rough.at.clone(), Some(rough));
        if base.chi_squared - fit.chi_squared > MIN_TO_LEAP {
            fit = restart_locally(problem, fit);
        }
        Candidate::of(problem, base, fit)
    };
    let chosen = choose(rough, base, max);
    let mut candidates: Vec<Candidate> = chosen.par_iter().map(to_the_end).collect();
    candidates.sort_by(|a, b| b.improvement.total_cmp(&a.improvement));
    candidates
}

/// The best effects, each with its best cell and, where they come close, the next.
fn choose(rough: Vec<Fit>, base: &Fit, max: usize) -> Vec<Fit> {
    let mut chosen: Vec<Fit> = Vec::new();
    let name = |fit: &Fit| {
        fit.hypothesis
            .hypothesised
            .last()
            .map_or("", |hypothesised| hypothesised.effect.name)
    };
    for fit in rough {
        let same: Vec<&Fit> = chosen.iter().filter(|other| name(other) == name(&fit)).collect();
        let names: BTreeSet<&str> = chosen.iter().map(name).collect();
        let gain = |fit: &Fit| base.chi_squared - fit.chi_squared;
        let best_gain = chosen.first().map_or(0.0, gain);
        if chosen.len() >= AT_LEAST && gain(&fit) < PROMISING.1.max(PROMISING.0 * best_gain) {
            break;
        }
        let is_wanted = match same.first() {
            None => names.len() < max,
            Some(best) => same.len() < CELLS_REFITTED && gain(&fit) > NEXT_CELL * gain(best),
        };
        if is_wanted {
            chosen.push(fit);
        }
    }
    chosen
}

/// A single effect refitted from its values in a pair, where that is a better fit: the pair's gain may come from a better minimum of its
/// first effect, and not from the second.
pub(in crate::explain) fn alone(
    problem: &FitProblem<'_, impl Plant>,
    recalibrated: &Fit,
    single: &Candidate,
    pair: &Candidate,
) -> Option<Candidate> {
    let place = pair.hypothesised.iter().position(|one| single.hypothesised == [*one])?;
    from_values_of(problem, recalibrated, single, (pair, place))
}

/// A single effect refitted from the values of another candidate, in which it has this place, where that is a better fit.
pub(in crate::explain) fn from_values_of(
    problem: &FitProblem<'_, impl Plant>,
    recalibrated: &Fit,
    single: &Candidate,
    (other, place_in_other): (&Candidate, usize),
) -> Option<Candidate> {
    let hypothesis = &single.fit.hypothesis;
    let from_other = |what: What| {
        let what = match what {
            What::Effect { parameter, .. } => What::Effect {
                place: place_in_other,
                parameter,
            },
            nuisance => nuisance,
        };
        let place = other.fit.hypothesis.free.iter().position(|free| free.what == what)?;
        Some(other.fit.at[place])
    };
    let at: Option<Vec<f64>> = hypothesis.free.iter().map(|free| from_other(free.what)).collect();
    let candidate = Candidate {
        ln_onset: single.ln_onset,
        ..Candidate::of(problem, recalibrated, problem.fit(hypothesis, at?, None))
    };
    (candidate.improvement > single.improvement).then_some(candidate)
}

/// Pairs of effects: a single one with those that screen best on top of it; with what chance makes of the screening.
pub(in crate::explain) fn pair_up(
    judge: &Judge<'_, impl Plant>,
    first: &Candidate,
    hypothesised: &[Hypothesised],
    screened: &[Screening],
    seed: u64,
) -> (Vec<Candidate>, Chance) {
    let problem = judge.problem;
    let others: Vec<Hypothesised> = hypothesised
        .iter()
        .filter(|other| !other.is_same_effect(&first.hypothesised[0]) && !other.is_twin_of(&first.hypothesised[0]))
        .copied()
        .collect();
    let single = judge.ln_prior(&first.hypothesised);
    let ln_prior = |other: &Hypothesised| judge.ln_prior(&[first.hypothesised[0], *other]) - single;
    let expected = Expected {
        ln_prior: &ln_prior,
        impact: judge.expected_impact,
        scales: first.evidence.unwrap_or(judge.none).scales(),
    };
    let base = problem.with_derivatives(&first.fit.hypothesis, first.fit.at.clone());
    let (mut promising, chance) = score_test::screen(problem, judge.discrepancy, &base, &others, &expected, seed);
    promising.retain(|screening| screening.ln_bayes + ln_prior(&screening.hypothesised) > MIN_LN_ODDS);
    promising.truncate(SCREENED_FOR_PAIRS);
    let mut at = first.fit.hypothesis.neutral();
    let effects_from = at.len() - score_test::effect_quantities(&first.fit.hypothesis);
    at[effects_from..].copy_from_slice(&first.fit.at[effects_from..]);
    let about = problem.with_derivatives(&first.fit.hypothesis, at);
    let refitted = refit(problem, &base, &about, &promising, PAIRED);
    let mut pairs: Vec<Candidate> = refitted
        .into_iter()
        .map(|candidate| Candidate {
            ln_onset: first.ln_onset,
            ..Candidate::of(problem, judge.recalibrated, candidate.fit)
        })
        .collect();
    judge.weigh(&mut pairs, screened);
    (pairs, chance)
}
