//! A score for every effect of the library, the evidence that it makes, and what chance would make of noise.
//!
//! At the recalibrated model, each effect is simulated at a few strengths (and shapes, where it has one). The change in the residuals
//! is the effect's direction; everything that the nuisances could explain is projected out. With I the square of the direction and s
//! its product with what the residuals lack, a change of α times the trial's raises the log likelihood by α s − ½ α² I. Integrated over
//! α with the prior of the severity, and summed over trials, this is the Bayes factor of the effect against none, to first order in the
//! nuisances and along the curve of its severities. What it comes to by chance is drawn ([`super::judge::chance`]).

use super::directions::{Directions, Projector};
use super::discrepancy::Discrepancy;
use super::fit::Fit;
use super::hypothesis::Hypothesis;
use super::judge::chance::Chance;
use super::judge::ln_sum::ln_sum;
use super::judge::prior::SeverityPrior;
use super::parameter::Hypothesised;
use super::plant::Plant;
use super::problem::FitProblem;
use crate::least_squares::dot;
use rayon::prelude::*;
use std::f64::consts::TAU;
use worm_physics::effect::Effect;

/// Strengths that are tried, in notable changes; a single one where an effect has a place, for there are many places to try.
const STRENGTHS: [f64; 4] = [1.0, 4.0, 12.0, 36.0];
const STRENGTHS_AT_A_PLACE: [f64; 1] = [4.0];
/// Best trials of an effect from which fits start.
const STARTS: usize = 2;
/// Factors on the change of a trial up to which its direction stands for others, where several strengths are tried and where one is.
const BETWEEN: (f64, f64) = (0.55, 1.75);
const AT_A_PLACE: (f64, f64) = (0.1, 4.5);
/// The same below the weakest and above the strongest.
const BEYOND: (f64, f64) = (0.3, 3.0);

/// Trials that are simulated before they are projected.
const AT_ONCE: usize = 256;

/// One effect on one cell, or on all that it concerns, screened.
#[derive(Debug, Clone)]
pub(in crate::explain) struct Screening {
    pub hypothesised: Hypothesised,
    /// Logarithm of the Bayes factor against the fit without it, to first order in everything else that is free.
    pub ln_bayes: f64,
    pub prior: SeverityPrior,
    /// Rise of twice the log likelihood, to first order.
    pub score: f64,
    /// Values from which a fit may begin, best first.
    pub starts: Vec<Vec<f64>>,
}

/// Values at which an effect is tried: strengths times shapes. The first of each shape is the weakest.
fn trials(effect: &Effect, stretch_m: (f64, f64)) -> Vec<Vec<f64>> {
    let severity = effect.severity();
    let strengths: &[f64] = if effect.has_place() {
        &STRENGTHS_AT_A_PLACE
    } else {
        &STRENGTHS
    };
    let mut trials = Vec::new();
    for shape in effect.starting_shapes(stretch_m) {
        for &strength in strengths {
            for sign in [1.0, -1.0] {
                let value = severity.neutral + sign * strength * severity.notable;
                if value > severity.min && value < severity.max {
                    trials.push([&[value], &shape[..]].concat());
                }
            }
        }
    }
    trials
}

/// Strong effects from which a fit may begin where nothing is known: changes of so many notable ones to either side.
pub(in crate::explain) fn strong(effect: &Effect, strengths: &[f64]) -> Vec<Vec<f64>> {
    if effect.has_place() {
        return Vec::new(); // no place is more likely than another
    }
    let severity = effect.severity();
    let both = |strength: f64| [1.0, -1.0].map(|sign| severity.neutral + sign * strength * severity.notable);
    strengths
        .iter()
        .flat_map(|&strength| both(strength))
        .filter(|value| (severity.min..severity.max).contains(value))
        .map(|value| effect.values_with_neutral_shape(value))
        .collect()
}

/// Number of quantities that belong to effects of a hypothesis.
pub(in crate::explain) fn effect_quantities(hypothesis: &Hypothesis) -> usize {
    hypothesis
        .hypothesised
        .iter()
        .map(|hypothesised| hypothesised.effect.parameters.len())
        .sum()
}

/// One trial of an effect.
struct Trial {
    hypothesised: usize,
    values: Vec<f64>,
    /// Largest relative change of an outcome.
    impact: f64,
    /// Factors on its change of the severity for which it stands.
    stands_for: (f64, f64),
}

/// Trials of all effects against the residuals of a fit.
struct Trials {
    all: Vec<Trial>,
    priors: Vec<SeverityPrior>,
    /// Logarithm of the prior probability of each hypothesis, and of each of its shapes given it.
    ln_prior: Vec<f64>,
    ln_shape: Vec<f64>,
    /// Square of each direction, everything that is free projected out.
    squares: Vec<f64>,
}

impl Trials {
    /// Logarithm of the Bayes factor that a trial gives by its score: the integral of the likelihood over the severities it stands
    /// for, by the height and width of its peak.
    fn ln_bayes(&self, number: usize, score: f64) -> f64 {
        let trial = &self.all[number];
        let prior = &self.priors[trial.hypothesised];
        ln_bayes(prior, trial.values[0], trial.stands_for, score, self.squares[number])
            + self.ln_shape[trial.hypothesised]
    }

    /// Improvement that a trial promises by its score.
    fn improvement(&self, number: usize, score: f64) -> f64 {
        score.max(0.0).powi(2) / self.squares[number]
    }

    /// Logarithm of the Bayes factor of every hypothesis.
    fn ln_bayes_of_each(&self, scores: &[f64]) -> Vec<f64> {
        let mut each: Vec<Vec<f64>> = vec![Vec::new(); self.priors.len()];
        for (number, trial) in self.all.iter().enumerate() {
            each[trial.hypothesised].push(self.ln_bayes(number, scores[number]));
        }
        each.iter().map(|trials| ln_sum(trials.iter().copied())).collect()
    }

    /// The largest log odds of a hypothesis, and the largest improvement of a trial.
    fn largest(&self, scores: &[f64]) -> (f64, f64) {
        let each = self.ln_bayes_of_each(scores);
        let odds = each.iter().zip(&self.ln_prior).map(|(bayes, prior)| bayes + prior);
        let improvements = (0..scores.len()).map(|number| self.improvement(number, scores[number]));
        (odds.fold(f64::NEG_INFINITY, f64::max), improvements.fold(0.0, f64::max))
    }
}

/// Logarithm of the Bayes factor of a change of a severity to `value`, by its score and the square of its direction, integrated over
/// the factors on it for which its direction stands.
pub(in crate::explain) fn ln_bayes(
    prior: &SeverityPrior,
    value: f64,
    (low, high): (f64, f64),
    score: f64,
    square: f64,
) -> f64 {
    let factor = (score / square).clamp(low, high);
    let steepness = (score - factor * square).abs();
    let width = ((high - low).recip() + steepness + (square / TAU).sqrt()).recip();
    let density = prior.ln_density_of_logarithm(prior.scaled(value, factor));
    factor * score - 0.5 * factor * factor * square + density - factor.ln() + width.ln()
}

/// What is expected of effects before they are screened.
pub(in crate::explain) struct Expected<'e> {
    /// Logarithm of the prior odds of each against the fit without it.
    pub ln_prior: &'e dyn Fn(&Hypothesised) -> f64,
    /// Median of the impact.
    pub impact: f64,
    /// Probabilities of the discrepancy's scales.
    pub scales: [f64; 4],
}

/// Screens effects on top of a fit with derivatives. Returns them most probable first, with what chance would do.
pub(in crate::explain) fn screen(
    problem: &FitProblem<'_, impl Plant>,
    discrepancy: &Discrepancy,
    fit: &Fit,
    hypothesised: &[Hypothesised],
    expected: &Expected<'_>,
    seed: u64,
) -> (Vec<Screening>, Chance) {
    let Some(projector) = Projector::new(discrepancy, fit) else {
        return (Vec::new(), Chance::default());
    };
    let (all, directions) = simulate(problem, fit, hypothesised, &projector);
    // Those that the nuisances explain completely stay, for the evidence against them is that of their prior.
    let (scores, squares) = (directions.scores.clone(), directions.squares.clone());
    let (products, along) = (directions.products(), directions.along());
    drop(directions);
    let impacts = |number: usize| -> Vec<(f64, f64)> {
        let neutral = hypothesised[number].effect.severity().neutral;
        let mine = all.iter().filter(|trial| trial.hypothesised == number);
        mine.map(|trial| (trial.values[0] - neutral, trial.impact)).collect()
    };
    let shapes =
        |hypothesised: &Hypothesised| hypothesised.effect.starting_shapes(problem.plant.stretch_m()).len() as f64;
    let trials = Trials {
        priors: hypothesised
            .iter()
            .enumerate()
            .map(|(number, one)| SeverityPrior::new(one.effect, expected.impact, &impacts(number)))
            .collect(),
        ln_prior: hypothesised.iter().map(expected.ln_prior).collect(),
        ln_shape: hypothesised.iter().map(|one| -shapes(one).ln()).collect(),
        all,
        squares,
    };
    let chance = Chance::draw(discrepancy, &products, &along, expected.scales, seed, |scores| {
        trials.largest(scores)
    });
    let ln_bayes = trials.ln_bayes_of_each(&scores);
    let mut screened: Vec<Screening> = hypothesised
        .iter()
        .enumerate()
        .map(|(number, &hypothesised)| {
            let mut mine: Vec<usize> = (0..trials.all.len())
                .filter(|&trial| trials.all[trial].hypothesised == number)
                .collect();
            let improvement = |trial: usize| trials.improvement(trial, scores[trial]);
            mine.sort_by(|&a, &b| improvement(b).total_cmp(&improvement(a)));
            let severity = hypothesised.effect.severity();
            let starts = mine
                .iter()
                .take(STARTS)
                .filter(|&&trial| scores[trial] > 0.0)
                .map(|&trial| {
                    let mut values = trials.all[trial].values.clone();
                    let fraction = (scores[trial] / trials.squares[trial]).clamp(0.2, 3.0);
                    values[0] = (severity.neutral + fraction * (values[0] - severity.neutral))
                        .clamp(severity.min, severity.max);
                    values
                });
            Screening {
                hypothesised,
                ln_bayes: ln_bayes[number],
                prior: trials.priors[number],
                score: mine.first().map_or(0.0, |&trial| improvement(trial)),
                starts: starts.collect(),
            }
        })
        .collect();
    let ln_odds = |screening: &Screening| {
        let number = hypothesised.iter().position(|one| *one == screening.hypothesised);
        screening.ln_bayes + number.map_or(0.0, |number| trials.ln_prior[number])
    };
    screened.sort_by(|a, b| ln_odds(b).total_cmp(&ln_odds(a)));
    (screened, chance)
}

/// Simulates every trial of every effect on top of a fit. Returns those that do something, and the directions of each.
fn simulate(
    problem: &FitProblem<'_, impl Plant>,
    fit: &Fit,
    hypothesised: &[Hypothesised],
    projector: &Projector<'_>,
) -> (Vec<Trial>, Directions) {
    let stretch_m = problem.plant.stretch_m();
    let tasks: Vec<(usize, Vec<f64>, (f64, f64))> = hypothesised
        .iter()
        .enumerate()
        .flat_map(|(number, hypothesised)| {
            let severity = hypothesised.effect.severity();
            let has_place = hypothesised.effect.has_place();
            trials(hypothesised.effect, stretch_m).into_iter().map(move |values| {
                let change = values[0] - severity.neutral;
                let strength = change.abs() / severity.notable;
                let reach = if change > 0.0 {
                    severity.max - severity.neutral
                } else {
                    severity.neutral - severity.min
                };
                let (low, high) = if has_place { AT_A_PLACE } else { BETWEEN };
                let low = if strength < 2.0 * STRENGTHS[0] { BEYOND.0 } else { low };
                let high = if 3.0 * strength > STRENGTHS[3] {
                    BEYOND.1.max(high)
                } else {
                    high
                };
                (number, values, (low, high.min(reach / change.abs())))
            })
        })
        .collect();
    let (without, outcomes) = problem.residuals_and_outcomes(&fit.hypothesis, &fit.at);
    let evaluate = |(number, values, stands_for): &(usize, Vec<f64>, (f64, f64))| {
        let mut all = fit.hypothesis.hypothesised.clone();
        all.push(hypothesised[*number]);
        let nuisances = &fit.hypothesis.free[..fit.at.len() - effect_quantities(&fit.hypothesis)];
        let hypothesis = Hypothesis::new(nuisances, &all);
        let mut at = fit.at.clone();
        at.extend(values);
        let (mut change, with_effect) = problem.residuals_and_outcomes(&hypothesis, &at);
        for (value, here) in change.iter_mut().zip(&without) {
            *value -= here;
        }
        let square = dot(&change, &change, None);
        // An effect that does nothing, and a machine that could not have moved.
        let is_possible = square > 1e-9 && with_effect.iter().all(|outcome| outcome.is_finite());
        is_possible.then(|| {
            let trial = Trial {
                hypothesised: *number,
                values: values.clone(),
                impact: problem.largest_change(&outcomes, &with_effect),
                stands_for: *stands_for,
            };
            (trial, change)
        })
    };
    let (mut trials, mut directions) = (Vec::with_capacity(tasks.len()), projector.none());
    for some in tasks.chunks(AT_ONCE) {
        let evaluated: Vec<(Trial, Vec<f64>)> = some.par_iter().filter_map(evaluate).collect();
        let (of_some, changes): (Vec<Trial>, Vec<Vec<f64>>) = evaluated.into_iter().unzip();
        trials.extend(of_some);
        projector.append(problem.whiten_all(changes), &mut directions);
    }
    (trials, directions)
}
