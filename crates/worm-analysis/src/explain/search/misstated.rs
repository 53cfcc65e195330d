//! Conditions of the recordings that are stated wrongly, weighed as an answer in place of a missing effect.
//!
//! What is stated is believed within its prior, and to see it as wrong by more is no effect of the machine. Of conditions that are far off
//! some effect makes the best, and then it is sure. So the usual mistakes are hypotheses of their own: the recalibrated model under
//! conditions as they may have been meant, without any effect.

use super::fit::Fit;
use super::judge::prior::{MISSTATED, MISSTATED_RUN, UNLIKE_RUN};
use super::judgement::Judge;
use super::misstatement::{Misstatement, Sort};
use super::plant::Plant;
use rayon::prelude::*;

/// Improvement over the recalibrated model from which it is worth looking for a mistake, and that one must reach.
const LEAST_IMPROVEMENT: f64 = 10.0;
/// Mistakes of a sort that are fitted, of those that look best before.
const FITTED: usize = 2;
/// Standard errors by which what must differ does.
const LEAST_SIGMAS: f64 = 2.0;

/// A mistake that explains the data, as far as it does.
#[derive(Debug, Clone)]
pub(in crate::explain) struct Misstated {
    /// The plant's number for it.
    pub what: usize,
    pub fit: Fit,
    /// Fall of chi-squared from the recalibrated model.
    pub improvement: f64,
    /// Logarithm of its prior probability times that of the data.
    pub ln_weight: f64,
}

/// Prior probability of all mistakes of a sort together.
fn prior_of_all(sort: Sort) -> f64 {
    match sort {
        Sort::Written => MISSTATED,
        Sort::OfOneRun => MISSTATED_RUN,
        Sort::UnlikeOthers => UNLIKE_RUN,
    }
}

/// The mistakes that explain something, best first; `best_improvement` is that of the best effect.
pub(in crate::explain) fn misstated(judge: &Judge<'_, impl Plant>, best_improvement: f64) -> Vec<Misstated> {
    let problem = judge.problem;
    if best_improvement < LEAST_IMPROVEMENT && !judge.none.is_open() {
        return Vec::new();
    }
    let all = problem.plant.misstatements(&judge.recalibrated.hypothesis);
    let sorts: Vec<Sort> = all.iter().map(|one| one.sort).collect();
    let prior_of = |sort: Sort| {
        let of_sort = sorts.iter().filter(|&&other| other == sort).count();
        prior_of_all(sort) / of_sort as f64
    };
    let mut starts: Vec<(Misstatement, f64)> = all
        .into_par_iter()
        .map(|one| {
            let chi_squared = problem.evaluate(&one.hypothesis, one.start.clone()).chi_squared;
            (one, chi_squared)
        })
        .filter(|(_, chi_squared)| chi_squared.is_finite())
        .collect();
    starts.sort_by(|a, b| a.0.sort.cmp(&b.0.sort).then(a.1.total_cmp(&b.1)));
    let best: Vec<&Misstatement> = starts
        .chunk_by(|a, b| a.0.sort == b.0.sort)
        .flat_map(|of_sort| of_sort.iter().map(|(one, _)| one).take(FITTED))
        .collect();
    let mut found: Vec<Misstated> = best
        .into_par_iter()
        .filter_map(|one| {
            let mut fit = problem.fit(&one.hypothesis, one.start.clone(), None);
            let improvement = judge.recalibrated.chi_squared
                - fit.chi_squared
                - problem.excess_of_repeating(judge.recalibrated, &fit);
            if improvement < LEAST_IMPROVEMENT {
                return None;
            }
            problem.compute_jacobian(&mut fit);
            let differs = one.must_differ.is_none_or(|(quantity, least)| {
                let off = (fit.at[quantity] - fit.hypothesis.free[quantity].quantity.centre).abs();
                off >= least.max(LEAST_SIGMAS * fit.sigmas()[quantity])
            });
            differs.then(|| Misstated {
                what: one.what,
                improvement,
                ln_weight: prior_of(one.sort).ln() + judge.evidence_of(&fit, &|_| None).usual,
                fit,
            })
        })
        .collect();
    found.sort_by(|a, b| b.ln_weight.total_cmp(&a.ln_weight));
    found
}
