//! The verdict: agrees, explained, ambiguous, or outside the library.
//!
//! # The rules, in their order
//! 1. The best effect must be strong enough to matter, improve the fit by more than the best of the whole library would by chance
//!    (with a margin for what real pads and cams do), and keep most of that improvement on held-out data. Otherwise model and data
//!    **agree**, unless a free form shows that they do not.
//! 2. Effects are compared on held-out data. Those close to the best stay in the answer, for a small difference proves little between
//!    two models of which neither is quite right. Exact twins are one answer with several names.
//! 3. A pair of effects is preferred where the second is notable, too, and improves held-out data by much more than chance.
//! 4. What the best leaves must be noise: if a free form could still remove a good part of the gap, the cause is **outside the
//!    library**.
//! 5. With one answer left, the data are **explained**; with several, the answer is **ambiguous**.

use super::answer::Verdict;
use super::cross_validation::{Fold, HeldOut, hold_out as hold_out_fit};
use super::fit::{Fit, FitProblem};
use super::parameter::{Hypothesised, What};
use super::residual::Residual;

/// Effects that are scored on held-out data.
const HELD_OUT: usize = 6;
/// Fraction of the gap that may stay open, and the chi-squared below which it counts as closed anyway; of the whole campaign, and of
/// each run. Worms without a hidden effect leave up to 246 in all and 93 in a run, since their friction varies from cycle to cycle;
/// some with a hidden effect that is explained leave up to 267 and 124.
const OPEN: (f64, f64) = (0.25, 350.0);
const OPEN_IN_A_RUN: (f64, f64) = (0.5, 150.0);
/// Chi-squared of a run's gap that is negligible where no effect explains it.
const NEGLIGIBLE: f64 = 200.0;
/// By how many thresholds the second effect of a pair must improve the fit: a law that is not quite the hidden one leaves something
/// for others to improve.
const SECOND: f64 = 2.0;
/// Difference of the held-out scores up to which two effects explain the data equally well: absolute, and as a fraction of what the
/// best one gains; for a pair, of what it gains over its first effect alone.
const ALIKE: (f64, f64) = (14.0, 0.01);
/// Fraction of the best improvement that an answer must reach.
const COUNTS: f64 = 0.5;
/// Fraction of its improvement that an effect must keep on held-out data.
const HOLDS: f64 = 0.5;
/// Exponent on held-out likelihoods for probabilities: models are never quite right, so these are less certain.
const TEMPER: f64 = 0.5;

/// A fitted effect, or a pair.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    pub hypothesised: Vec<Hypothesised>,
    pub fit: Fit,
    /// Fall of chi-squared from the recalibrated model.
    pub improvement: f64,
    pub held_out: Option<HeldOut>,
}

impl Candidate {
    /// A fit, with its improvement over another.
    pub fn of(problem: &FitProblem<'_, '_>, base: &Fit, fit: Fit) -> Self {
        Self {
            improvement: base.chi_squared - fit.chi_squared - problem.excess_of_repeating(base, &fit),
            hypothesised: fit.hypothesis.hypothesised.clone(),
            held_out: None,
            fit,
        }
    }

    /// Whether every effect in it is strong enough to matter, with its shape off its limits: scatter from cycle to cycle looks like a
    /// little of many effects, and a shape driven to its limit fits something else.
    pub fn is_notable(&self) -> bool {
        let settings = self.fit.hypothesis.settings(&self.fit.at);
        let is_strong = settings.iter().all(|setting| {
            let severity = &setting.effect().parameters[0];
            (setting.values()[0] - severity.neutral).abs() >= severity.notable
        });
        let free = self.fit.hypothesis.free.iter().enumerate();
        let mut shapes = free.filter(|(_, free)| matches!(free.what, What::Effect { parameter: 1.., .. }));
        is_strong && shapes.all(|(quantity, _)| !self.fit.at_limit(quantity))
    }

    /// Whether it keeps most of its improvement on held-out data; `without` is the held-out score of the recalibrated model.
    fn holds(&self, without: f64) -> bool {
        without - self.held_out_chi_squared() > HOLDS * self.improvement
    }

    /// Whether a pair improves on a single effect by more than a threshold, and keeps most of that on held-out data.
    fn needs_both(&self, single: &Self, threshold: f64) -> bool {
        let gain = self.improvement - single.improvement;
        gain > threshold && single.held_out_chi_squared() - self.held_out_chi_squared() > HOLDS * gain
    }

    /// Standard errors of all quantities: from noise, and from how they change when slopes or cycles are left out, for a law that is
    /// not quite the worm's is wrong in a different way on each.
    pub fn sigmas(&self) -> Vec<f64> {
        let of_noise = self.fit.sigmas();
        let Some(held_out) = &self.held_out else {
            return of_noise;
        };
        let partitions = held_out.partitions();
        let apart = |quantity: usize| {
            partitions
                .iter()
                .map(move |partition| jackknife(partition.iter().map(|(fit, _)| fit.at[quantity])))
        };
        let with_apart = of_noise.iter().enumerate();
        with_apart
            .map(|(quantity, sigma)| apart(quantity).fold(*sigma, f64::hypot))
            .collect()
    }

    /// Score on held-out data; infinite where there is none.
    pub fn held_out_chi_squared(&self) -> f64 {
        self.held_out
            .as_ref()
            .map_or(f64::INFINITY, |held_out| held_out.chi_squared)
    }
}

/// Standard error of an estimate from what it becomes when each part of the data is left out in turn (the jackknife of Quenouille and
/// Tukey).
fn jackknife(left_out: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = left_out.clone().count() as f64;
    let mean = left_out.clone().sum::<f64>() / count;
    let squares: f64 = left_out.map(|at| (at - mean).powi(2)).sum();
    ((count - 1.0) / count * squares).sqrt()
}

/// Whether no positions can distinguish two effects.
pub(super) fn are_twins(one: &Hypothesised, other: &Hypothesised) -> bool {
    one.cell.is_none() && other.cell.is_none() && one.effect.is_twin_of(other.effect)
}

/// Whether two answers are the same up to twins and cells.
fn are_alike(one: &Candidate, other: &Candidate) -> bool {
    let alike = |a: &Hypothesised, b: &Hypothesised| a.effect.name == b.effect.name || are_twins(a, b);
    one.hypothesised.len() == other.hypothesised.len()
        && one
            .hypothesised
            .iter()
            .all(|a| other.hypothesised.iter().any(|b| alike(a, b)))
}

/// The best of each kind, best first: twins and other cells of the same effect left out.
pub(super) fn kinds(candidates: &[Candidate]) -> Vec<&Candidate> {
    let mut kinds: Vec<&Candidate> = Vec::new();
    for candidate in candidates {
        if !kinds.iter().any(|kind| are_alike(kind, candidate)) {
            kinds.push(candidate);
        }
    }
    kinds
}

/// How much of chi-squared a free form could remove, in each run.
pub(super) struct Open {
    whole: Vec<f64>,
}

impl Open {
    /// The gap after recalibration.
    pub fn of(problem: &FitProblem<'_, '_>, recalibrated: &Fit) -> Self {
        Self {
            whole: explainable(problem, recalibrated),
        }
    }

    /// Whether a free form could remove next to nothing after recalibration.
    fn is_negligible(&self) -> bool {
        self.whole.iter().all(|whole| *whole < NEGLIGIBLE)
    }

    /// Fraction of it that a fit leaves open.
    pub fn fraction(&self, problem: &FitProblem<'_, '_>, fit: &Fit) -> f64 {
        let left: f64 = explainable(problem, fit).iter().sum();
        (left / self.whole.iter().sum::<f64>().max(1.0)).max(0.0)
    }

    /// Whether a fit leaves noise, or too little to matter, in every run: the right effect is right everywhere.
    pub fn is_closed(&self, problem: &FitProblem<'_, '_>, fit: &Fit) -> bool {
        let left = explainable(problem, fit);
        let in_every_run = left
            .iter()
            .zip(&self.whole)
            .all(|(left, whole)| *left < OPEN_IN_A_RUN.1.max(OPEN_IN_A_RUN.0 * whole));
        let (left, whole): (f64, f64) = (left.iter().sum(), self.whole.iter().sum());
        in_every_run && left < OPEN.1.max(OPEN.0 * whole)
    }
}

/// How much of each run's chi-squared a free form would remove beyond chance.
fn explainable(problem: &FitProblem<'_, '_>, fit: &Fit) -> Vec<f64> {
    let runs = problem.scene.observed.iter().enumerate();
    runs.map(|(run, observed)| {
        let predicted = problem.scene.predict(run, &fit.hypothesis, &fit.at);
        predicted.map_or(f64::INFINITY, |predicted| {
            problem.noise[run].explainable(observed, &Residual::new(observed, &predicted))
        })
    })
    .collect()
}

/// The verdict, and what it rests on.
pub(super) struct Selected {
    pub verdict: Verdict,
    /// What explains the data, best first, without twins and other cells of the same effect. Holds the best candidate even where
    /// nothing is named.
    pub candidates: Vec<Candidate>,
    /// Probability of each candidate.
    pub probability: Vec<f64>,
    /// The best effect of another kind that is no candidate.
    pub best_wrong: Option<Candidate>,
    /// Fraction of the gap that the best leaves open.
    pub open_share: f64,
    /// Whether a free form could remove next to nothing after recalibration.
    pub gap_is_negligible: bool,
    /// Every effect and pair that was fitted.
    pub all: Vec<Candidate>,
}

/// Scores the best candidates on held-out data and sorts all by that, notable ones before others.
pub(super) fn hold_out(problem: &FitProblem<'_, '_>, recalibrated: &Fit, candidates: &mut [Candidate], folds: &[Fold]) {
    for candidate in candidates.iter_mut().take(HELD_OUT) {
        let mut held_out = hold_out_fit(problem, &candidate.fit, folds);
        held_out.chi_squared += problem.excess_of_repeating(recalibrated, &candidate.fit);
        candidate.held_out = Some(held_out);
    }
    candidates.sort_by(|a, b| a.held_out_chi_squared().total_cmp(&b.held_out_chi_squared()));
    candidates.sort_by_key(|candidate| !candidate.is_notable());
}

/// Reaches the verdict; `singles` and `pairs` are best first.
pub(super) fn select_model(
    problem: &FitProblem<'_, '_>,
    open: &Open,
    singles: Vec<Candidate>,
    pairs: Vec<Candidate>,
    threshold: f64,
    recalibrated_held_out: f64,
) -> Selected {
    let mut all = singles.clone();
    all.extend(pairs.iter().cloned());
    let is_sound = |candidate: &Candidate| candidate.is_notable() && candidate.holds(recalibrated_held_out);
    let sound = |candidates: Vec<Candidate>| candidates.into_iter().filter(is_sound).collect::<Vec<_>>();
    let (mut candidates, pairs) = (sound(singles), sound(pairs));
    let improves = candidates.iter().any(|candidate| candidate.improvement > threshold);
    let mut closed = true;
    // What all answers have in common favours none of them.
    let mut shared = 0.0;
    if improves {
        let single = &candidates[0];
        if pairs
            .first()
            .is_some_and(|pair| pair.needs_both(single, SECOND * threshold))
        {
            shared = single.improvement;
            candidates = pairs;
        }
        closed = open.is_closed(problem, &candidates[0].fit);
    }
    let max = candidates
        .iter()
        .map(|candidate| candidate.improvement)
        .fold(0.0, f64::max);
    // What hardly improves the fit is no candidate, however well it does by chance on held-out data.
    candidates.sort_by_key(|candidate| candidate.improvement < COUNTS * max);
    let mut kinds: Vec<Candidate> = kinds(&candidates).into_iter().cloned().collect();
    let best = kinds.first().map_or(f64::INFINITY, Candidate::held_out_chi_squared);
    let gain = kinds.first().map_or(0.0, |candidate| candidate.improvement);
    let alike = ALIKE.0 + ALIKE.1 * (gain - shared);
    let is_candidate = |candidate: &&Candidate| {
        candidate.held_out_chi_squared() - best < alike && candidate.improvement >= COUNTS * max
    };
    let count = kinds.iter().take_while(is_candidate).count();
    let others = kinds.split_off(count.max(usize::from(!kinds.is_empty())));
    let weight = |candidate: &Candidate| (-0.5 * TEMPER * (candidate.held_out_chi_squared() - best)).exp();
    let whole: f64 = kinds.iter().chain(&others).map(weight).sum();
    let verdict = if !improves && open.is_negligible() {
        Verdict::Agrees
    } else if !improves || !closed {
        Verdict::OutsideLibrary
    } else if kinds.len() > 1 {
        Verdict::Ambiguous
    } else {
        Verdict::Explained
    };
    Selected {
        verdict,
        probability: kinds.iter().map(|candidate| weight(candidate) / whole).collect(),
        open_share: kinds
            .first()
            .map_or(0.0, |candidate| open.fraction(problem, &candidate.fit)),
        gap_is_negligible: open.is_negligible(),
        best_wrong: others.into_iter().next(),
        candidates: kinds,
        all,
    }
}
