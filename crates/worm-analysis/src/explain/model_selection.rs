//! The judgement: agree, explain, leave it open, or admit that the library has no name for it.
//!
//! # The rules, in their order
//! 1. The best effect must be as strong as is worth telling, and improve the fit by more than the best of the whole library would
//!    by chance, with a margin for what real pads and cams do, and keep most of that on data left out; else model and data
//!    **agree**, unless a free form shows that they do not.
//! 2. Effects are compared by what they say of data that they were not fitted to. Those close to the best stay in the answer, for
//!    a small difference proves nothing between two models of which neither is quite right; exact twins are one answer with
//!    several names.
//! 3. A pair of effects is preferred where the second, too, is notable and gives much more to data left out than chance.
//! 4. What the best leaves must be noise: if a free form could still take away a good part of the gap, the cause is **outside the
//!    library**.
//! 5. One answer left is **explained**, several are **ambiguous**.

use super::answer::Verdict;
use super::cross_validation::{Fold, HeldOut, hold_out as hold_out_fit};
use super::fit::{Fit, FitProblem};
use super::parameter::{Hypothesised, What};
use super::residual::Residual;

/// Effects that are held against data they were not fitted to.
const HELD_OUT: usize = 6;
/// Share of the whole gap that may stay open, and how much of its misfit at least counts as open; the same of each run's. Worms
/// in which nothing is hidden leave up to 246 in all and 93 in a run, of what their friction does from cycle to cycle, and some
/// in which something is that is explained leave more: up to 267 and 124.
const OPEN: (f64, f64) = (0.25, 350.0);
const OPEN_IN_A_RUN: (f64, f64) = (0.5, 150.0);
/// Misfit of a run that counts as nothing where no effect explains it.
const NOTHING: f64 = 200.0;
/// How much more than a single effect's threshold the second of a pair must improve the fit: a law that is not quite the hidden
/// one's leaves something for others to mend.
const SECOND: f64 = 2.0;
/// Difference of the held-out misfits up to which two effects explain the data equally well: absolute, and as a share of what
/// the best one gains, a pair on its first effect alone.
const ALIKE: (f64, f64) = (14.0, 0.01);
/// Share of the best improvement that an answer must reach.
const COUNTS: f64 = 0.5;
/// Share of its improvement that an effect must keep on data that it was not fitted to.
const HOLDS: f64 = 0.5;
/// How much less certain probabilities are than held-out likelihoods say, for models that are never quite right.
const TEMPER: f64 = 0.5;

/// Effects that were fitted.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    pub hypothesised: Vec<Hypothesised>,
    pub fit: Fit,
    /// Fall of the misfit from the recalibrated model.
    pub improvement: f64,
    pub held_out: Option<HeldOut>,
}

impl Candidate {
    /// A fit, and what it improves on another.
    pub fn of(problem: &FitProblem<'_, '_>, base: &Fit, fit: Fit) -> Self {
        Self {
            improvement: base.chi_squared - fit.chi_squared - problem.excess_of_repeating(base, &fit),
            hypothesised: fit.hypothesis.hypothesised.clone(),
            held_out: None,
            fit,
        }
    }

    /// Whether every effect in it is as strong as is worth telling, and of a shape within its range: what scatters from cycle to
    /// cycle looks like a little of many effects, and what drives a shape to its end is something else.
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

    /// Whether it says of data left out most of what it says of those that it was fitted to; `without` is what the recalibrated
    /// model leaves of them.
    fn holds(&self, without: f64) -> bool {
        without - self.held_out_misfit() > HOLDS * self.improvement
    }

    /// Whether a pair says more than a single effect by so much, and most of that of data left out, too.
    fn needs_both(&self, single: &Self, threshold: f64) -> bool {
        let gain = self.improvement - single.improvement;
        gain > threshold && single.held_out_misfit() - self.held_out_misfit() > HOLDS * gain
    }

    /// Standard errors of all quantities: of noise, and of how they come apart when slopes or cycles are left out, for a law that is
    /// not quite the worm's is wrong otherwise on each.
    pub fn sigmas(&self) -> Vec<f64> {
        let of_noise = self.fit.sigmas();
        let Some(held_out) = &self.held_out else {
            return of_noise;
        };
        let ways = held_out.ways();
        let apart = |quantity: usize| {
            ways.iter()
                .map(move |way| jackknife(way.iter().map(|(fit, _)| fit.at[quantity])))
        };
        let with_apart = of_noise.iter().enumerate();
        with_apart
            .map(|(quantity, sigma)| apart(quantity).fold(*sigma, f64::hypot))
            .collect()
    }

    /// Misfit on data that it was not fitted to.
    pub fn held_out_misfit(&self) -> f64 {
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

/// Whether two answers are the same up to twins, or the same effect on another cell.
fn are_alike(one: &Candidate, other: &Candidate) -> bool {
    let alike = |a: &Hypothesised, b: &Hypothesised| a.effect.name == b.effect.name || are_twins(a, b);
    one.hypothesised.len() == other.hypothesised.len()
        && one
            .hypothesised
            .iter()
            .all(|a| other.hypothesised.iter().any(|b| alike(a, b)))
}

/// The best of each kind, best first: twins and other cells of the same effect left out.
pub(super) fn kinds(finds: &[Candidate]) -> Vec<&Candidate> {
    let mut kinds: Vec<&Candidate> = Vec::new();
    for find in finds {
        if !kinds.iter().any(|kind| are_alike(kind, find)) {
            kinds.push(find);
        }
    }
    kinds
}

/// How much of the misfit a free form could take away, in each run.
pub(super) struct Open {
    whole: Vec<f64>,
}

impl Open {
    /// What is open after recalibration.
    pub fn of(problem: &FitProblem<'_, '_>, recalibrated: &Fit) -> Self {
        Self {
            whole: explainable(problem, recalibrated),
        }
    }

    /// Whether recalibration left nothing that a free form could take away.
    fn is_nothing(&self) -> bool {
        self.whole.iter().all(|whole| *whole < NOTHING)
    }

    /// Share of it that a fit leaves open.
    pub fn fraction(&self, problem: &FitProblem<'_, '_>, fit: &Fit) -> f64 {
        let left: f64 = explainable(problem, fit).iter().sum();
        (left / self.whole.iter().sum::<f64>().max(1.0)).max(0.0)
    }

    /// Whether what a fit leaves is noise, or too little to matter, in every run: an effect that is the right one is right
    /// everywhere.
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

/// How much of each run's misfit a free form would take away beyond chance.
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

/// The outcome.
pub(super) struct Judged {
    pub verdict: Verdict,
    /// What explains the data, best first, twins and other cells of the same effect left out; the best find even where nothing is
    /// named.
    pub candidates: Vec<Candidate>,
    /// Probability of each candidate.
    pub probability: Vec<f64>,
    /// The best find of another kind that is no candidate.
    pub best_wrong: Option<Candidate>,
    /// Share of the gap that the best leaves open.
    pub open_share: f64,
    /// Whether recalibration left nothing that a free form could take away.
    pub nothing_open: bool,
    /// Every find, for the record.
    pub all: Vec<Candidate>,
}

/// Holds the best finds against data that they were not fitted to, and puts the best of them first, notable ones before others.
pub(super) fn hold_out(problem: &FitProblem<'_, '_>, recalibrated: &Fit, finds: &mut [Candidate], folds: &[Fold]) {
    for find in finds.iter_mut().take(HELD_OUT) {
        let mut held_out = hold_out_fit(problem, &find.fit, folds);
        held_out.chi_squared += problem.excess_of_repeating(recalibrated, &find.fit);
        find.held_out = Some(held_out);
    }
    finds.sort_by(|a, b| a.held_out_misfit().total_cmp(&b.held_out_misfit()));
    finds.sort_by_key(|find| !find.is_notable());
}

/// Judges; `singles` and `pairs` best first.
pub(super) fn judge(
    problem: &FitProblem<'_, '_>,
    open: &Open,
    singles: Vec<Candidate>,
    pairs: Vec<Candidate>,
    threshold: f64,
    recalibrated_held_out: f64,
) -> Judged {
    let mut all = singles.clone();
    all.extend(pairs.iter().cloned());
    let is_sound = |find: &Candidate| find.is_notable() && find.holds(recalibrated_held_out);
    let sound = |finds: Vec<Candidate>| finds.into_iter().filter(is_sound).collect::<Vec<_>>();
    let (mut finds, pairs) = (sound(singles), sound(pairs));
    let improves = finds.iter().any(|find| find.improvement > threshold);
    let mut closed = true;
    // What all of the answers have in common says nothing for one or the other.
    let mut shared = 0.0;
    if improves {
        let single = &finds[0];
        if pairs
            .first()
            .is_some_and(|pair| pair.needs_both(single, SECOND * threshold))
        {
            shared = single.improvement;
            finds = pairs;
        }
        closed = open.is_closed(problem, &finds[0].fit);
    }
    let max = finds.iter().map(|find| find.improvement).fold(0.0, f64::max);
    // What hardly improves the fit is no candidate, whatever chance does for it on data left out.
    finds.sort_by_key(|find| find.improvement < COUNTS * max);
    let mut kinds: Vec<Candidate> = kinds(&finds).into_iter().cloned().collect();
    let best = kinds.first().map_or(f64::INFINITY, Candidate::held_out_misfit);
    let gain = kinds.first().map_or(0.0, |find| find.improvement);
    let alike = ALIKE.0 + ALIKE.1 * (gain - shared);
    let is_candidate = |find: &&Candidate| find.held_out_misfit() - best < alike && find.improvement >= COUNTS * max;
    let count = kinds.iter().take_while(is_candidate).count();
    let others = kinds.split_off(count.max(usize::from(!kinds.is_empty())));
    let weight = |find: &Candidate| (-0.5 * TEMPER * (find.held_out_misfit() - best)).exp();
    let whole: f64 = kinds.iter().chain(&others).map(weight).sum();
    let verdict = if !improves && open.is_nothing() {
        Verdict::Agrees
    } else if !improves || !closed {
        Verdict::OutsideLibrary
    } else if kinds.len() > 1 {
        Verdict::Ambiguous
    } else {
        Verdict::Explained
    };
    Judged {
        verdict,
        probability: kinds.iter().map(|find| weight(find) / whole).collect(),
        open_share: kinds.first().map_or(0.0, |find| open.fraction(problem, &find.fit)),
        nothing_open: open.is_nothing(),
        best_wrong: others.into_iter().next(),
        candidates: kinds,
        all,
    }
}
