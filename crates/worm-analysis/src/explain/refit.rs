//! Fits effects to the end: alone, and in pairs.

use super::fit::{Fit, FitProblem};
use super::hypothesis::Hypothesis;
use super::local_restart::restart_locally;
use super::model_selection::{self, Candidate};
use super::parameter::{Hypothesised, What};
use super::score_test::{self, Screening};
use std::collections::BTreeSet;

/// Effects that are refitted; cells of one effect that are; and how near the next cell must come to the best, as a fraction of its gain.
pub(super) const REFITTED: usize = 8;
const CELLS_REFITTED: usize = 2;
const NEXT_CELL: f64 = 0.5;
/// Effects that are refitted on top of a single one, and how many of those that screened best are tried roughly before.
const PAIRED: usize = 3;
const SCREENED_FOR_PAIRS: usize = 8;
/// Improvement from which it is worth looking for a better minimum.
const MIN_TO_LEAP: f64 = 10.0;

/// Refits every effect, roughly from several starts, and the best of them to the end; best first.
///
/// The starts are those of the screening about the recalibrated model, and strong effects about the nominal one: a strong effect
/// drives the recalibration into a corner from which screening cannot see it.
pub(super) fn refit(
    problem: &FitProblem<'_, '_>,
    base: &Fit,
    nominal: &Fit,
    screened: &[Screening],
    max: usize,
    progress: &mut dyn FnMut(f64),
) -> Vec<Candidate> {
    let effects_from = base.at.len() - score_test::effect_quantities(&base.hypothesis);
    let hypothesis_of = |hypothesised: Hypothesised| {
        let mut all = base.hypothesis.hypothesised.clone();
        all.push(hypothesised);
        Hypothesis::new(&base.hypothesis.free[..effects_from], &all)
    };
    let mut rough: Vec<Fit> = Vec::with_capacity(screened.len());
    for (done, screening) in screened.iter().enumerate() {
        progress(0.5 * done as f64 / screened.len() as f64);
        let hypothesis = hypothesis_of(screening.hypothesised);
        let about_base = screening.starts.iter().map(|start| (base, start.clone()));
        let strong = score_test::strong(screening.hypothesised.effect);
        let about_nominal = strong.into_iter().map(|start| (nominal, start));
        let fits = about_base.chain(about_nominal).map(|(from, start)| {
            let mut at = from.at.clone();
            at.extend(start);
            problem.fit_roughly(&hypothesis, at, from)
        });
        rough.extend(fits.min_by(|a, b| a.chi_squared.total_cmp(&b.chi_squared)));
    }
    rough.sort_by(|a, b| a.chi_squared.total_cmp(&b.chi_squared));
    let chosen = choose(rough, base, max);
    let mut candidates: Vec<Candidate> = Vec::with_capacity(chosen.len());
    for (done, rough) in chosen.iter().enumerate() {
        progress(0.5 + 0.5 * done as f64 / chosen.len() as f64);
        let mut fit = problem.fit(&rough.hypothesis, rough.at.clone(), Some(rough));
        if base.chi_squared - fit.chi_squared > MIN_TO_LEAP {
            fit = restart_locally(problem, fit);
        }
        candidates.push(Candidate::of(problem, base, fit));
    }
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
pub(super) fn alone(
    problem: &FitProblem<'_, '_>,
    recalibrated: &Fit,
    single: &Candidate,
    pair: &Candidate,
) -> Option<Candidate> {
    let hypothesis = &single.fit.hypothesis;
    let place_in_pair = pair.hypothesised.iter().position(|one| single.hypothesised == [*one])?;
    let from_pair = |what: What| {
        let what = match what {
            What::Effect { parameter, .. } => What::Effect {
                place: place_in_pair,
                parameter,
            },
            nuisance => nuisance,
        };
        let place = pair.fit.hypothesis.free.iter().position(|free| free.what == what)?;
        Some(pair.fit.at[place])
    };
    let at: Option<Vec<f64>> = hypothesis.free.iter().map(|free| from_pair(free.what)).collect();
    let candidate = Candidate::of(problem, recalibrated, problem.fit(hypothesis, at?, None));
    (candidate.improvement > single.improvement).then_some(candidate)
}

/// Pairs of effects: each of the best single ones with those that screen best on top of it, and above the threshold.
pub(super) fn pair_up<'f>(
    problem: &FitProblem<'_, '_>,
    recalibrated: &Fit,
    seeds: impl Iterator<Item = &'f Candidate>,
    hypothesised: &[Hypothesised],
    threshold: f64,
    seed: u64,
) -> Vec<Candidate> {
    let mut pairs: Vec<Candidate> = Vec::new();
    for first in seeds {
        let others: Vec<Hypothesised> = hypothesised
            .iter()
            .filter(|other| {
                !first.hypothesised.contains(other) && !model_selection::are_twins(other, &first.hypothesised[0])
            })
            .copied()
            .collect();
        let base = problem.with_derivatives(&first.fit.hypothesis, first.fit.at.clone());
        let mut at = first.fit.hypothesis.neutral();
        let effects_from = at.len() - score_test::effect_quantities(&first.fit.hypothesis);
        at[effects_from..].copy_from_slice(&first.fit.at[effects_from..]);
        let about = problem.with_derivatives(&first.fit.hypothesis, at);
        let (mut promising, _) = score_test::screen(problem, &base, &others, seed);
        promising.retain(|screening| screening.score > threshold);
        promising.truncate(SCREENED_FOR_PAIRS);
        for candidate in refit(problem, &base, &about, &promising, PAIRED, &mut |_| ()) {
            let candidate = Candidate::of(problem, recalibrated, candidate.fit);
            let is_new = !pairs
                .iter()
                .any(|pair| pair.hypothesised.iter().all(|one| candidate.hypothesised.contains(one)));
            if is_new {
                pairs.push(candidate);
            }
        }
    }
    pairs.sort_by(|a, b| b.improvement.total_cmp(&a.improvement));
    pairs
}
