//! The whole library at a glance: a score for every effect, and what score the best of them would reach by chance.
//!
//! At the recalibrated model, each effect is switched on in a few strengths (and shapes, where it has one) by a simulation each.
//! What that changes in the residuals, with everything that the nuisances could make of it projected out, is the effect's
//! direction; the score is how much of the misfit lies along it: the rise of twice the log likelihood if the change were
//! proportional to the strength.
//!
//! The best of many effects finds something in mere noise too. So noise is drawn on all directions together, with the
//! correlations they have, and the largest score noted: what it stays below nineteen times in twenty is the threshold.

use super::fit::{Fit, FitProblem};
use super::hypothesis::Hypothesis;
use super::parameter::Hypothesised;
use crate::least_squares::{dot, submatrix};
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use worm_physics::effect::{Effect, LIBRARY, Scope};

/// Strengths that are tried, in notable changes; a single one where an effect has a place, for there are many places to try.
const STRENGTHS: [f64; 4] = [1.0, 4.0, 12.0, 36.0];
const STRENGTHS_AT_A_PLACE: [f64; 1] = [4.0];
/// Trials of an effect from which fits begin.
const STARTS: usize = 2;
/// Strength of an effect from which a fit begins where nothing is known, in notable changes.
const STRONG: f64 = 8.0;
/// Draws of noise for the threshold.
const DRAWS: usize = 4000;
/// Share of the draws that the threshold lies above.
const CONFIDENCE: f64 = 0.95;
/// One effect on one cell, or on all that it concerns, screened.
#[derive(Debug, Clone)]
pub(super) struct Screening {
    pub hypothesised: Hypothesised,
    /// Rise of twice the log likelihood, to first order.
    pub score: f64,
    /// Values from which a fit may begin, best first.
    pub starts: Vec<Vec<f64>>,
}

/// Everything that may be supposed in a campaign.
pub(super) fn hypotheses(cells: usize, phase_recorded: bool) -> Vec<Hypothesised> {
    let mut all = Vec::new();
    for &effect in &LIBRARY {
        if !effect.is_visible_in_positions(phase_recorded) {
            continue;
        }
        if effect.scope != Scope::OneCell {
            all.push(Hypothesised { effect, cell: None });
        }
        if effect.scope != Scope::Worm {
            all.extend((0..cells).map(|cell| Hypothesised {
                effect,
                cell: Some(cell),
            }));
        }
    }
    all
}

/// Values at which an effect is tried: strengths times shapes. The first of each shape is the weakest.
fn trials(effect: &Effect, canal_m: (f64, f64)) -> Vec<Vec<f64>> {
    let severity = effect.severity();
    let strengths: &[f64] = if effect.has_place() {
        &STRENGTHS_AT_A_PLACE
    } else {
        &STRENGTHS
    };
    let mut trials = Vec::new();
    for shape in effect.starting_shapes(canal_m) {
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

/// Strong effects from which a fit may begin where nothing is known.
pub(super) fn strong(effect: &Effect) -> Vec<Vec<f64>> {
    if effect.has_place() {
        return Vec::new(); // no place is more likely than another
    }
    let severity = effect.severity();
    let values = [1.0, -1.0].map(|sign| severity.neutral + sign * STRONG * severity.notable);
    values
        .into_iter()
        .filter(|value| (severity.min..severity.max).contains(value))
        .map(|value| effect.values_with_neutral_shape(value))
        .collect()
}

/// Where nuisances and effects that are already supposed lead, so that it can be taken out.
struct Projection<'f> {
    fit: &'f Fit,
    open: Vec<usize>,
    inverse: DMatrix<f64>,
}

impl<'f> Projection<'f> {
    fn new(fit: &'f Fit) -> Self {
        let open: Vec<usize> = (0..fit.at.len()).filter(|&quantity| !fit.at_limit(quantity)).collect();
        let normal = fit.normal(None);
        let mut matrix = submatrix(&normal, &open);
        for row in 0..open.len() {
            matrix[(row, row)] += 1e-9 * (1.0 + matrix[(row, row)]);
        }
        let identity = DMatrix::identity(open.len(), open.len());
        let inverse = matrix.cholesky().map_or(identity, |factor| factor.inverse());
        Self { fit, open, inverse }
    }

    /// How a direction lies to those that are taken out.
    fn shadow(&self, direction: &[f64]) -> DVector<f64> {
        let columns = self
            .open
            .iter()
            .map(|&quantity| dot(&self.fit.jacobian[quantity], direction, None));
        DVector::from_iterator(self.open.len(), columns)
    }

    /// Scalar product of what is left of two directions.
    fn product(&self, a: &[f64], a_shadow: &DVector<f64>, b: &[f64], b_shadow: &DVector<f64>) -> f64 {
        dot(a, b, None) - a_shadow.dot(&(&self.inverse * b_shadow))
    }
}

/// One trial of an effect.
struct Tried {
    hypothesised: usize,
    values: Vec<f64>,
    score: f64,
    fraction: f64,
    /// The direction and its shadow, for the weakest trial of each shape and sense.
    direction: Option<(Vec<f64>, DVector<f64>, f64)>,
}

/// Screens effects on top of a fit, whose derivatives must be there; best first, with the threshold of chance.
pub(super) fn screen(
    problem: &FitProblem<'_, '_>,
    fit: &Fit,
    hypothesised: &[Hypothesised],
    seed: u64,
) -> (Vec<Screening>, f64) {
    let projection = Projection::new(fit);
    let residual_shadow = projection.shadow(&fit.residual);
    let canal_m = canal(problem);
    let tasks: Vec<(usize, Vec<f64>, bool)> = hypothesised
        .iter()
        .enumerate()
        .flat_map(|(number, hypothesised)| {
            let trials = trials(hypothesised.effect, canal_m);
            let notable = hypothesised.effect.parameters[0].notable;
            let neutral = hypothesised.effect.parameters[0].neutral;
            let weakest = trials
                .iter()
                .map(|values| (values[0] - neutral).abs())
                .fold(f64::INFINITY, f64::min);
            trials.into_iter().map(move |values| {
                let is_weakest = (values[0] - neutral).abs() <= weakest + 1e-9 * notable;
                (number, values, is_weakest)
            })
        })
        .collect();
    let try_out = |(number, values, is_weakest): &(usize, Vec<f64>, bool)| {
        let hypothesised = hypothesised[*number];
        let mut all = fit.hypothesis.hypothesised.clone();
        all.push(hypothesised);
        let nuisances: Vec<_> = fit.hypothesis.free[..fit.at.len() - effect_quantities(&fit.hypothesis)].to_vec();
        let hypothesis = Hypothesis::new(&nuisances, &all);
        let mut at = fit.at.clone();
        at.extend(values);
        let mut direction = problem.residuals(&hypothesis, &at);
        for (value, here) in direction.iter_mut().zip(&fit.residual) {
            *value -= here;
        }
        let shadow = projection.shadow(&direction);
        let own = projection.product(&direction, &shadow, &direction, &shadow);
        let whole = dot(&direction, &direction, None);
        // What the nuisances imitate entirely shows nothing.
        if !(own > 1e-6 * whole && own > 1e-9) {
            return None;
        }
        let along = projection.product(&direction, &shadow, &fit.residual, &residual_shadow);
        let fraction = -along / own;
        Some(Tried {
            hypothesised: *number,
            values: values.clone(),
            score: if fraction > 0.0 { along * along / own } else { 0.0 },
            fraction,
            direction: is_weakest.then_some((direction, shadow, own)),
        })
    };
    let tried: Vec<Tried> = tasks.par_iter().filter_map(try_out).collect();
    let threshold = threshold(&projection, &tried, seed);
    let mut screened: Vec<Screening> = hypothesised
        .iter()
        .enumerate()
        .map(|(number, &hypothesised)| {
            let mut mine: Vec<&Tried> = tried.iter().filter(|tried| tried.hypothesised == number).collect();
            mine.sort_by(|a, b| b.score.total_cmp(&a.score));
            let severity = &hypothesised.effect.parameters[0];
            let starts = mine
                .iter()
                .take(STARTS)
                .filter(|tried| tried.score > 0.0)
                .map(|tried| {
                    let mut values = tried.values.clone();
                    let fraction = tried.fraction.clamp(0.2, 3.0);
                    values[0] = (severity.neutral + fraction * (values[0] - severity.neutral))
                        .clamp(severity.min, severity.max);
                    values
                })
                .collect();
            Screening {
                hypothesised,
                score: mine.first().map_or(0.0, |tried| tried.score),
                starts,
            }
        })
        .collect();
    screened.sort_by(|a, b| b.score.total_cmp(&a.score));
    (screened, threshold)
}

/// Quantities of effects in a hypothesis.
pub(super) fn effect_quantities(hypothesis: &Hypothesis) -> usize {
    hypothesis
        .hypothesised
        .iter()
        .map(|hypothesised| hypothesised.effect.parameters.len())
        .sum()
}

/// Where tips have been, m.
fn canal(problem: &FitProblem<'_, '_>) -> (f64, f64) {
    let seen = problem
        .scene
        .observed
        .iter()
        .flat_map(|observed| observed.position_m.iter().flatten());
    let (min, max) = seen
        .filter(|at_m| at_m.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), &at_m| {
            (f64::min(min, at_m), f64::max(max, at_m))
        });
    (min - 0.02, max)
}

/// What the best score stays below by chance, nineteen times in twenty.
fn threshold(projection: &Projection<'_>, tried: &[Tried], seed: u64) -> f64 {
    let directions: Vec<&(Vec<f64>, DVector<f64>, f64)> =
        tried.iter().filter_map(|tried| tried.direction.as_ref()).collect();
    let count = directions.len();
    if count == 0 {
        return 0.0;
    }
    let correlations = |row: usize| -> Vec<f64> {
        let (a, a_shadow, a_own) = directions[row];
        let with_others = directions[..=row].iter();
        with_others
            .map(|(b, b_shadow, b_own)| projection.product(a, a_shadow, b, b_shadow) / (a_own * b_own).sqrt())
            .collect()
    };
    let rows: Vec<Vec<f64>> = (0..count).into_par_iter().map(correlations).collect();
    let mut gram = DMatrix::from_fn(count, count, |row, column| rows[row.max(column)][row.min(column)]);
    for row in 0..count {
        gram[(row, row)] += 1e-6;
    }
    let Some(factor) = gram.cholesky() else {
        return f64::INFINITY;
    };
    let lower = factor.l();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut largest: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let noise = DVector::from_iterator(count, (0..count).map(|_| StandardNormal.sample(&mut rng)));
            let scores = &lower * noise;
            // A direction counts one way only: the other way is a trial of its own, where there is one.
            scores
                .iter()
                .fold(0.0, |max: f64, &score: &f64| max.max(score.max(0.0).powi(2)))
        })
        .collect();
    largest.sort_by(f64::total_cmp);
    largest[(CONFIDENCE * (DRAWS - 1) as f64) as usize]
}
