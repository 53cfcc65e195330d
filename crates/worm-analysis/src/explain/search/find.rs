//! The search itself, step by step.

use super::discrepancy::Discrepancy;
use super::fit::Fit;
use super::held_out::HeldOut;
use super::judge::candidate::{Candidate, kinds};
use super::judge::decision::{Selected, decide};
use super::judge::evidence::{InTime, evidence};
use super::judge::prior;
use super::judgement::{FALSE_NAMES, Judge, WORTH_A_LOOK, held_out};
use super::law::find::{FittedLaws, OfLibrary};
use super::law::fit::LawSearch;
use super::misstated::{Misstated, misstated};
use super::onset::{mean_cycles, with_onsets};
use super::parameter::Hypothesised;
use super::plant::Plant;
use super::problem::FitProblem;
use super::refit::{REFITTED, alone, pair_up, refit};
use super::score_test::{self, Expected, Screening};
use crate::explain::answer::Verdict;

/// Single effects from which pairs are tried.
const PAIR_SEEDS: usize = 2;
/// Odds of an effect that comes and goes against the best that stays: with two times to choose, it fits a little better than that where
/// nothing comes and goes at all.
const SPELL: f64 = 20.0;

/// Options of the search.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Seed of everything drawn: the same input and seed give the same answer.
    pub seed: u64,
    /// Scale of the discrepancy between the model and any worm, as a fraction of the mean largest deformation of the tips; above 0.
    /// Too small, and the model's own small errors get names; too large, and a wrong effect hides in it what it leaves.
    pub discrepancy: f64,
    /// Relative change of the advance or of the energy of a cycle below which an effect does not matter.
    pub matters: f64,
    /// Relative change of the advance that an effect is expected to make, give or take a factor of 2.5; above 0.
    pub expected_impact: f64,
    /// How much the friction of a tip usually differs from one cycle to the next, as a fraction, give or take a factor of two; above 0. What
    /// scatters by much more is something that is missing.
    pub scatter: f64,
    /// Names of effects that are left out of the search: what would it say if it did not know them?
    pub without: Vec<&'static str>,
    /// What of a worm's recordings is evidence.
    pub evidence: Evidence,
}

/// What of a worm's recordings is evidence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Evidence {
    /// The positions of its cells.
    #[default]
    Positions,
    /// Positions, and the forces that the motor's current shows; of a run without positions the current alone.
    PositionsAndCurrent,
    /// The motor's current alone: positions are not looked at.
    CurrentAlone,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            seed: 1,
            discrepancy: 0.004,
            matters: 0.02,
            expected_impact: 0.06,
            scatter: 0.01,
            without: Vec::new(),
            evidence: Evidence::Positions,
        }
    }
}

/// What was found.
pub(in crate::explain) struct Found {
    /// The model without recalibration, with derivatives.
    pub nominal: Fit,
    pub recalibrated_held_out: HeldOut,
    /// Every effect that was screened, most probable first.
    pub screened: Vec<Screening>,
    /// Names of the effects that the user left out.
    pub left_out: Vec<&'static str>,
    pub selected: Selected,
    /// Every effect and pair that was fitted.
    pub fitted: Vec<Candidate>,
    /// Fraction of the gap that the best candidate leaves open.
    pub open_share: f64,
    /// Improvement that the best of the library reaches by chance in one campaign of a hundred.
    pub threshold: f64,
    /// Laws that nobody listed, where they were weighed against the library or against conditions that are stated wrongly.
    pub laws: Option<FittedLaws>,
    /// The mistake in what is stated about the recordings that explains most, where one explains something.
    pub misstated: Option<Misstated>,
}

/// Searches for the effect that the model of a plant lacks, beside a discrepancy; the recalibrated fit has its derivatives. Reports each
/// stage with the fraction of the work that is done.
pub(in crate::explain) fn find<P: Plant>(
    problem: &FitProblem<'_, P>,
    discrepancy: &Discrepancy,
    recalibrated: &Fit,
    options: &Options,
    report: &mut dyn FnMut(&'static str, f64),
) -> Found {
    report("screening", 0.15);
    let plant = problem.plant;
    let mut hypothesised = plant.hypotheses();
    hypothesised.retain(|one| !options.without.contains(&one.effect.name));
    let in_time = plant.has_cycles().then(|| InTime::new(plant, discrepancy));
    let judge = Judge {
        problem,
        discrepancy,
        in_time: in_time.as_ref(),
        recalibrated,
        none: evidence(discrepancy, in_time.as_ref(), recalibrated, &|_| None)
            .with_body_motion(plant.body_motion(recalibrated, options.scatter)),
        campaign: prior::Campaign {
            channels: plant.channels(),
            runs: plant.runs(),
            cycles: mean_cycles(plant),
            families: prior::families(&hypothesised),
        },
        limit: options.matters,
        expected_impact: options.expected_impact,
        scatter: options.scatter,
    };
    let ln_prior = |one: &Hypothesised| judge.ln_prior(&[*one]) - prior::NONE.ln();
    let expected = Expected {
        ln_prior: &ln_prior,
        impact: options.expected_impact,
        scales: judge.none.scales(),
    };
    let (screened, chance) = score_test::screen(
        problem,
        discrepancy,
        recalibrated,
        &hypothesised,
        &expected,
        options.seed,
    );
    report("refit", 0.3);
    let nominal = problem.with_derivatives(&recalibrated.hypothesis, recalibrated.hypothesis.neutral());
    let mut candidates = refit(problem, recalibrated, &nominal, &screened, REFITTED);
    judge.weigh(&mut candidates, &screened);
    let best = candidates.first().filter(|best| judge.ln_odds(best) > 0.0);
    let best = best.and_then(|best| best.evidence).unwrap_or(judge.none);
    if problem.plant.has_cycles() {
        report("onsets", 0.6);
        candidates = with_onsets(&judge, &nominal, &screened, candidates, judge.may_change(&best));
    }
    report("pairs", 0.65);
    let mut pairs: Vec<(Candidate, f64)> = Vec::new();
    // What comes and goes fits a little of much that is something else; with a second effect beside it, nearly all of it.
    let lasting: Vec<Candidate> = candidates.iter().filter(|one| !one.comes_and_goes()).cloned().collect();
    let mut seeds: Vec<Candidate> = kinds(&lasting).into_iter().take(PAIR_SEEDS).cloned().collect();
    // What seems to begin in mid-run may be there from the start, with a second effect that hides that.
    let throughout = seeds.iter().filter_map(|seed| {
        let is_throughout = |one: &&Candidate| one.hypothesised[0].onset.is_none();
        let same = candidates
            .iter()
            .filter(|one| one.hypothesised[0].is_same_effect(&seed.hypothesised[0]));
        seed.hypothesised[0]
            .onset
            .and_then(|_| same.clone().find(is_throughout).cloned())
    });
    let throughout: Vec<Candidate> = throughout.collect();
    seeds.extend(throughout);
    for first in &seeds {
        let beyond = judge.ln_odds_as_screened(first, None) - chance.ln_odds(FALSE_NAMES);
        let is_near = judge.ln_odds(first) > judge.ln_odds(&candidates[0]) - WORTH_A_LOOK;
        if beyond < 0.0 || !is_near && judge.is_closed_by(&candidates[0]) {
            continue;
        }
        let (found, chance) = pair_up(&judge, first, &hypothesised, &screened, options.seed);
        let beyond = found.into_iter().map(|pair| {
            let beyond = judge.ln_odds_as_screened(&pair, Some(first)) - chance.ln_odds(FALSE_NAMES);
            (pair, beyond)
        });
        pairs.extend(beyond);
    }
    pairs.sort_by(|a, b| judge.ln_odds(&b.0).total_cmp(&judge.ln_odds(&a.0)));
    let lasting = lasting.iter().chain(pairs.iter().map(|(pair, _)| pair));
    let of_lasting = lasting.map(|one| judge.ln_odds(one)).fold(f64::NEG_INFINITY, f64::max);
    candidates.retain(|one| !one.comes_and_goes() || judge.ln_odds(one) - of_lasting > SPELL.ln());
    if let Some((best, _)) = pairs.first()
        && let Some(single) = candidates.first()
        && let Some(alone) = alone(problem, recalibrated, single, best)
    {
        candidates[0] = alone;
        judge.weigh(&mut candidates[..1], &screened);
    }
    report("held-out selection", 0.8);
    let folds = plant.folds();
    let recalibrated_held_out = held_out(problem, recalibrated, &folds);
    report("judgement", 0.9);
    let judged = judge.judge(candidates, pairs, &chance, &folds, &recalibrated_held_out);
    let tried: Vec<&Hypothesised> = judged.iter().flat_map(|one| &one.candidate.hypothesised).collect();
    // What the rough fits dismissed counts by its prior at most: first order promises strong effects too much.
    let unfitted: Vec<f64> = screened
        .iter()
        .filter(|screening| !tried.contains(&&screening.hypothesised))
        .map(|screening| judge.none.usual + judge.ln_prior(&[screening.hypothesised]) + screening.ln_bayes.min(0.0))
        .collect();
    let best = judged.iter().map(|one| one.candidate.improvement).fold(0.0, f64::max);
    let misstated = misstated(&judge, best);
    let of_misstated: Vec<f64> = misstated.iter().map(|one| one.ln_weight).collect();
    let mut selected = decide(judge.none, &judged, &unfitted, &of_misstated);
    // What nobody listed can look like an effect, a pair or wrong conditions, and may be what is missing as well as they.
    let has_answer = matches!(selected.verdict, Verdict::Explained | Verdict::Ambiguous) || selected.is_misstated();
    let search = LawSearch {
        problem,
        discrepancy,
        recalibrated,
        without: &recalibrated_held_out,
        folds: &folds,
    };
    let mut laws =
        (has_answer || plant.weighs_laws()).then(|| search.fit(&mut |fraction| report("laws", 0.9 + 0.05 * fraction)));
    let names_pair = has_answer && selected.candidates.first().is_some_and(Candidate::is_pair);
    // Singles that predict as well as a pair, but are far less probable, are no reason for the pair.
    let gains = judged
        .iter()
        .filter(|one| one.holds && (one.candidate.is_pair() || !names_pair))
        .filter_map(|one| Some(recalibrated_held_out.chi_squared - one.candidate.held_out.as_ref()?.chi_squared));
    let gain = gains.fold(0.0, f64::max);
    let of_law = laws.as_mut().and_then(|laws| {
        if !names_pair {
            return laws.ln_evidence(discrepancy, OfLibrary::Single(gain));
        }
        search.fit_best_anew(laws);
        laws.ln_evidence(discrepancy, OfLibrary::Pair(gain))
    });
    if of_law.is_some() {
        selected = decide(judge.none.with_law(of_law), &judged, &unfitted, &of_misstated);
    }
    // What stands beside it in the answer is judged on the same data.
    if let Some(wrong) = &mut selected.best_wrong
        && wrong.held_out.is_none()
    {
        wrong.held_out = Some(held_out(problem, &wrong.fit, &folds));
    }
    for candidate in &mut selected.candidates {
        candidate.fit = plant.with_whole_effects(candidate.fit.clone());
    }
    // What repeats and is smooth, beyond noise.
    let gap = |fit: &Fit| {
        let residual = problem.without_discrepancy(&fit.hypothesis, &fit.at);
        discrepancy.beyond_noise(&residual)
    };
    let open_share = selected
        .candidates
        .first()
        .map_or(1.0, |candidate| gap(&candidate.fit) / gap(recalibrated).max(1.0));
    let threshold = chance.improvement(FALSE_NAMES);
    Found {
        nominal,
        recalibrated_held_out,
        screened,
        left_out: options.without.clone(),
        selected,
        fitted: judged.into_iter().map(|one| one.candidate).collect(),
        open_share,
        threshold,
        laws,
        misstated: misstated.into_iter().next(),
    }
}
