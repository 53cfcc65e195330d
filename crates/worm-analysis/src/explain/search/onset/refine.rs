//! When an effect begins and ends, fitted by values on grids.

use super::super::fit::Fit;
use super::super::judge::ln_sum::ln_sum;
use super::super::parameter::Onset;
use super::super::plant::Plant;
use super::super::problem::FitProblem;
use rayon::prelude::*;

/// Values of the onset that are tried about the best so far: their distance, cycles, how many to either side, and how often at most, as long as
/// the best moves: how strong an effect is depends on when it begins.
const GRIDS: [(f64, i32, usize); 4] = [(1.0, 6, 1), (0.25, 5, 1), (0.0625, 4, 3), (0.015625, 3, 1)];

/// The last effect of a fit at the same cycle of another run, or of every run, where that fits better as it is.
pub(super) fn in_best_run(problem: &FitProblem<'_, impl Plant>, fit: Fit) -> Fit {
    let runs = problem.plant.runs();
    let with_run = |run: Option<usize>| {
        let mut hypothesis = fit.hypothesis.clone();
        hypothesis.hypothesised.last_mut()?.onset.as_mut()?.run = run;
        Some(problem.evaluate(&hypothesis, fit.at.clone()))
    };
    let others = (0..runs).map(Some).chain((runs > 1).then_some(None));
    let best = others
        .filter_map(with_run)
        .min_by(|a, b| a.chi_squared.total_cmp(&b.chi_squared));
    match best {
        Some(best) if best.chi_squared < fit.chi_squared => problem.fit(&best.hypothesis, best.at, Some(&fit)),
        _ => fit,
    }
}

/// Fits when the last effect of a fit begins and ends. Returns the fit with derivatives, and the logarithm of the cycles that these may be
/// at by the data.
pub(super) fn refine(problem: &FitProblem<'_, impl Plant>, fit: Fit) -> (Fit, f64) {
    let begins: fn(&mut Onset) -> &mut Option<f64> = |onset| &mut onset.begins;
    let ends: fn(&mut Onset) -> &mut Option<f64> = |onset| &mut onset.ends;
    let (mut fit, mut ln_width) = (fit, 0.0);
    for which in [begins, ends] {
        let (refined, ln_width_of_one) = refine_one(problem, fit, which);
        fit = refined;
        ln_width += ln_width_of_one;
    }
    if fit.jacobian.is_empty() {
        problem.compute_jacobian(&mut fit);
    }
    (fit, ln_width)
}

/// Fits the beginning or the end of the last effect, where it has one.
fn refine_one(
    problem: &FitProblem<'_, impl Plant>,
    mut fit: Fit,
    which: fn(&mut Onset) -> &mut Option<f64>,
) -> (Fit, f64) {
    let onset_of = |fit: &Fit| fit.hypothesis.hypothesised.last().and_then(|last| last.onset);
    let end_of = |run: usize| {
        let bins = problem.plant.bins(run);
        bins.bins.last().map(|bin| bin.phase - bins.start_phase)
    };
    let last = (0..problem.plant.runs()).filter_map(end_of).fold(0.0, f64::max);
    let is_possible = |onset: &Onset| {
        let is_within = |cycle: f64| (0.0..last).contains(&cycle);
        onset.begins.into_iter().chain(onset.ends).all(is_within) && !onset.is_too_short()
    };
    let with_onset = |fit: &Fit, onset: Onset| {
        let mut hypothesis = fit.hypothesis.clone();
        if let Some(last) = hypothesis.hypothesised.last_mut() {
            last.onset = Some(onset);
        }
        hypothesis
    };
    let mut ln_width = 0.0;
    for (distance, count, times) in GRIDS {
        for _ in 0..times {
            let Some(onset) = onset_of(&fit) else {
                return (fit, 0.0);
            };
            let moved = |number: i32| {
                let mut moved = onset;
                let cycle = which(&mut moved).as_mut()?;
                *cycle += distance * f64::from(number);
                Some(moved).filter(is_possible)
            };
            let onsets: Vec<Onset> = (-count..=count).filter_map(moved).collect();
            let tried: Vec<f64> = onsets
                .par_iter()
                .map(|&onset| problem.evaluate(&with_onset(&fit, onset), fit.at.clone()).chi_squared)
                .collect();
            let Some(best) = (0..tried.len()).min_by(|&a, &b| tried[a].total_cmp(&tried[b])) else {
                return (fit, 0.0);
            };
            ln_width = ln_sum(tried.iter().map(|chi_squared| -0.5 * (chi_squared - tried[best]))) + distance.ln();
            let hypothesis = with_onset(&fit, onsets[best]);
            let next = if distance > GRIDS[GRIDS.len() - 1].0 {
                problem.fit_roughly(&hypothesis, fit.at.clone(), Some(&fit))
            } else {
                problem.fit(&hypothesis, fit.at.clone(), Some(&fit))
            };
            if next.chi_squared <= fit.chi_squared {
                fit = next;
            }
            if onset_of(&fit) == Some(onset) {
                break;
            }
        }
    }
    (fit, ln_width)
}
