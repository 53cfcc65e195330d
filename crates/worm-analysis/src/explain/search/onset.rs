//! Effects that begin or end in mid-run: screened at every cycle, of one run to stay so and of every run, and fitted with the time at
//! which they do.
//!
//! The machine of an effect that begins at t₁ moves as without it before and about as with it throughout after, so the change of the
//! residuals is that of the constant effect from t₁ on: its innovations are the same, and what is relative to a mean is about it again. That
//! gives a score for every cycle from one simulation of each effect. The best are fitted with the motion predicted as it is, and t₁ by
//! values on a grid. Those that end are the same the other way round: up to t₁ instead of from it on. One that begins at t₁ and ends at t₂
//! changes the residuals by what it does from t₁ on less what it does from t₂ on.

mod refine;
mod try_out;

use self::refine::{in_best_run, refine};
use self::try_out::try_out;
use super::fit::Fit;
use super::hypothesis::Hypothesis;
use super::judge::candidate::Candidate;
use super::judge::decision::LAW_KNOWN;
use super::judge::ln_sum::ln_sum;
use super::judge::prior::NONE;
use super::judge::structural_change::Change;
use super::judgement::Judge;
use super::parameter::Onset;
use super::plant::{Plant, Recorded};
use super::problem::FitProblem;
use super::refit::{from_values_of, refit};
use super::score_test::{Screening, ln_bayes, strong};
use crate::least_squares::{cross, dot, submatrix};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::ops::Range;

/// Strength at which effects are tried for an onset, in notable changes.
const STRENGTH: f64 = 8.0;
/// Effects that are fitted with an onset, with an end, and with both.
const FITTED: [(Course, usize); 3] = [(Course::Begins, 6), (Course::Ends, 3), (Course::Both, 2)];
/// Most cycles of a run between which effects that begin and end are tried: in a long run they lie some cycles apart.
const MOST_OF_BOTH: usize = 16;
/// Factors on the change of a trial for which its direction stands.
const STANDS_FOR: (f64, f64) = (0.1, 3.0);
/// Gauss-Newton steps of a recalibration on what was seen to one side of a change.
const STEPS_BESIDE: usize = 3;

/// Whether effects begin, end, or do both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Course {
    Begins,
    Ends,
    Both,
}

impl Course {
    /// The onset of what begins at a cycle, or the end of what ends there.
    fn onset(self, cycle: usize, run: Option<usize>) -> Onset {
        match self {
            Self::Ends => Onset::until(cycle as f64, run),
            Self::Begins | Self::Both => Onset::from(cycle as f64, run),
        }
    }
}

/// Cycles since the start of each run at which an effect may begin: those that leave a whole one before and after.
fn cycles(plant: &impl Recorded, run: usize) -> Range<usize> {
    let bins = plant.bins(run);
    let at = |bin: Option<&super::bins::Bin>| bin.map_or(0.0, |bin| bin.phase - bins.start_phase);
    at(bins.bins.first()).ceil() as usize + 1..at(bins.bins.last()).floor() as usize
}

/// Number of cycles at which an effect may begin, on average over the runs; 1 or more.
pub(in crate::explain) fn mean_cycles(plant: &impl Recorded) -> f64 {
    let runs = plant.runs();
    let sum: usize = (0..runs).map(|run| cycles(plant, run).len()).sum();
    (sum as f64 / runs as f64).max(1.0)
}

/// Every onset, or every end, that is tried; of what does both, every one between two of which it acts.
fn onsets(plant: &impl Recorded, course: Course) -> Vec<Onset> {
    let runs = plant.runs();
    let places = |cycles: Range<usize>| {
        let apart = match course {
            Course::Both => cycles.len().div_ceil(MOST_OF_BOTH).max(1),
            Course::Begins | Course::Ends => 1,
        };
        cycles.step_by(apart)
    };
    let single = (0..runs).flat_map(|run| places(cycles(plant, run)).map(move |cycle| (cycle, Some(run))));
    let common = (0..runs)
        .map(|run| cycles(plant, run))
        .reduce(|a, b| a.start.max(b.start)..a.end.min(b.end));
    let of_all = common
        .filter(|_| runs > 1)
        .into_iter()
        .flat_map(places)
        .map(|cycle| (cycle, None));
    single
        .chain(of_all)
        .map(|(cycle, run)| course.onset(cycle, run))
        .collect()
}

/// The effects that act `throughout`, and those that most probably begin or end in mid-run, fitted with the time; weighed, most probable
/// first. `screened` are all that act throughout.
///
/// A time is no sign that an effect begins or ends where it adds no more to what the effect does without it than its law may be wrong by:
/// leaving out the edge of a run hides a little of the error of any law.
///
/// What stays, once it has begun or ended, is looked for where the data `may_change`. What comes and goes need not show as a change that
/// stays, so it is screened in any case, and fitted where that speaks for it.
pub(in crate::explain) fn with_onsets(
    judge: &Judge<'_, impl Plant>,
    nominal: &Fit,
    screened: &[Screening],
    throughout: Vec<Candidate>,
    may_change: bool,
) -> Vec<Candidate> {
    let courses = FITTED
        .into_iter()
        .filter(|&(course, _)| may_change || course == Course::Both);
    let fitted = courses.map(|(course, count)| {
        let is_likely = judge.none.ln_bayes_of_change().is_some_and(|ln_bayes| ln_bayes > 0.0);
        let base = match judge.none.changing {
            Some((_, change)) if is_likely => beside_change(judge.problem, nominal, change, course),
            _ => judge.recalibrated.clone(),
        };
        let mut promising = screen(judge, &base, screened, course);
        if !may_change {
            promising.retain(|one| one.ln_odds(judge) > 0.0);
        }
        let change = judge.none.changing.filter(|_| is_likely && course != Course::Both);
        let change = change.map(|(_, change)| course.onset(change.cycle, change.run));
        let promising = try_out(judge, &base, promising, change, count);
        refit(judge.problem, &base, nominal, &promising, count)
    });
    let begun: Vec<Candidate> = fitted
        .flatten()
        .map(|candidate| {
            let (fit, ln_onset) = refine(judge.problem, in_best_run(judge.problem, candidate.fit));
            Candidate {
                ln_onset,
                ..Candidate::of(judge.problem, judge.recalibrated, fit)
            }
        })
        .collect();
    if begun.is_empty() {
        return throughout;
    }
    let mut candidates: Vec<Candidate> = throughout
        .into_par_iter()
        .map(|one| fit_anew(judge, one, &begun))
        .collect();
    candidates.extend(begun);
    let mut is_needed = candidates
        .iter()
        .map(|one| !candidates.iter().any(|simpler| explains_as_much(simpler, one)))
        .collect::<Vec<bool>>()
        .into_iter();
    candidates.retain(|_| is_needed.next() == Some(true));
    judge.weigh(&mut candidates, screened);
    candidates
}

/// An effect throughout, fitted from the values of the best that begins or ends, where that is a better fit: what the time seems to do
/// may be a better minimum.
fn fit_anew(judge: &Judge<'_, impl Plant>, throughout: Candidate, begun: &[Candidate]) -> Candidate {
    let anew = begun
        .iter()
        .filter(|one| one.hypothesised[0].is_same_effect(&throughout.hypothesised[0]))
        .max_by(|a, b| a.improvement.total_cmp(&b.improvement))
        .filter(|best| best.improvement > throughout.improvement)
        .and_then(|best| from_values_of(judge.problem, judge.recalibrated, &throughout, (best, 0)));
    anew.unwrap_or(throughout)
}

/// Whether the same effect explains as much with fewer times, but for what its law may be wrong by.
fn explains_as_much(simpler: &Candidate, one: &Candidate) -> bool {
    let [with_fewer, with_more] = [simpler, one].map(|one| &one.hypothesised[0]);
    let is_simpler = match (with_fewer.onset, with_more.onset) {
        (None, Some(_)) => true,
        (Some(fewer), Some(more)) => more.comes_and_goes() && !fewer.comes_and_goes() && fewer.run == more.run,
        (_, None) => false,
    };
    is_simpler
        && with_fewer.is_same_effect(with_more)
        && one.improvement - simpler.improvement <= LAW_KNOWN * LAW_KNOWN * simpler.improvement
}

/// The model recalibrated on what was seen before a change, or after it where something ends there: the rest would drive the
/// recalibration astray.
fn beside_change(problem: &FitProblem<'_, impl Plant>, nominal: &Fit, change: Change, course: Course) -> Fit {
    let ends = course == Course::Ends;
    let rows = problem.bin_of_rows().into_iter();
    let is_beside = |(run, bin): (usize, usize)| {
        let bins = problem.plant.bins(run);
        change.since(run, bins.bins[bin].phase - bins.start_phase).is_none() != ends
    };
    let stays: Vec<bool> = rows.map(is_beside).collect();
    let mut fit = nominal.clone();
    for _ in 0..STEPS_BESIDE {
        fit = problem.step_without(fit, &stays);
        problem.compute_jacobian(&mut fit);
    }
    fit
}

/// An effect that may begin or end, with when and how strongly it most probably does so in every run, or in one of them.
struct Promising {
    screening: Screening,
    /// Logarithm of the Bayes factor, onset, and parameters.
    each: Vec<(f64, Onset, Vec<f64>)>,
}

impl Promising {
    /// Log odds against none, to first order.
    fn ln_odds(&self, judge: &Judge<'_, impl Plant>) -> f64 {
        self.screening.ln_bayes + judge.ln_prior(&[self.screening.hypothesised]) - NONE.ln()
    }
}

/// A time at which effects are tried: they act from one of the onsets on, or from one and not any more from another.
#[derive(Debug, Clone, Copy)]
struct Tried {
    onset: Onset,
    /// The onset, and the one from which on what it does is taken away again.
    place: usize,
    less: Option<usize>,
}

/// Every time between two of the onsets of a run, or of all, that is not too short.
fn both(onsets: &[Onset]) -> Vec<Tried> {
    let pairs = (0..onsets.len()).flat_map(|place| (place + 1..onsets.len()).map(move |less| (place, less)));
    pairs
        .filter(|&(place, less)| onsets[place].run == onsets[less].run)
        .map(|(place, less)| Tried {
            onset: Onset {
                ends: onsets[less].begins,
                ..onsets[place]
            },
            place,
            less: Some(less),
        })
        .filter(|tried| !tried.onset.is_too_short())
        .collect()
}

/// Scores of every effect about a fit for every onset, or every end, or both; most probable first.
fn screen(judge: &Judge<'_, impl Plant>, fit: &Fit, screened: &[Screening], course: Course) -> Vec<Promising> {
    let problem = judge.problem;
    let onsets = onsets(problem.plant, course);
    let tried = match course {
        Course::Begins | Course::Ends => onsets
            .iter()
            .enumerate()
            .map(|(place, &onset)| Tried {
                onset,
                place,
                less: None,
            })
            .collect(),
        Course::Both => both(&onsets),
    };
    let open: Vec<usize> = (0..fit.at.len()).filter(|&quantity| !fit.at_limit(quantity)).collect();
    let jacobian = DMatrix::from_iterator(
        fit.residual.len(),
        open.len(),
        open.iter().flat_map(|&quantity| fit.jacobian[quantity].iter().copied()),
    );
    let Some(normal) = submatrix(&fit.normal(None), &open).cholesky() else {
        return Vec::new();
    };
    let residual = DVector::from_column_slice(&fit.residual);
    let without = problem.without_discrepancy(&fit.hypothesis, &fit.at);
    let of_effect = |screening: &Screening| {
        let hypothesised = screening.hypothesised;
        let mut starts = strong(hypothesised.effect, &[STRENGTH]);
        starts.extend(screening.starts.first().cloned());
        let mut each: Vec<(f64, Onset, Vec<f64>)> = Vec::new();
        let mut all = Vec::new();
        for values in starts {
            let mut at = fit.at.clone();
            at.extend(&values);
            let with = problem.without_discrepancy(&Hypothesis::new(&fit.hypothesis.free, &[hypothesised]), &at);
            let change: Vec<f64> = with
                .iter()
                .zip(&without)
                .map(|(with, without)| with - without)
                .collect();
            let directions = onsets
                .iter()
                .map(|onset| problem.within_onset(&change, onset))
                .collect();
            let directions = problem.whiten_all(directions);
            let directions = DMatrix::from_iterator(residual.len(), onsets.len(), directions.into_iter().flatten());
            let shared = cross(&jacobian, &directions);
            let projected = normal.solve(&shared);
            let scores = -(directions.tr_mul(&residual));
            let product = |a: usize, b: usize| {
                dot(directions.column(a).as_slice(), directions.column(b).as_slice(), None)
                    - shared.column(a).dot(&projected.column(b))
            };
            let squares: Vec<f64> = (0..onsets.len()).map(|place| product(place, place)).collect();
            for &Tried { onset, place, less } in &tried {
                let (score, square) = match less {
                    None => (scores[place], squares[place]),
                    Some(less) => (
                        scores[place] - scores[less],
                        squares[place] + squares[less] - 2.0 * product(place, less),
                    ),
                };
                let square = square.max(1e-9);
                let found = ln_bayes(&screening.prior, values[0], STANDS_FOR, score, square);
                all.push(found);
                let (least, most) = STANDS_FOR;
                let strength = (score / square).clamp(least, most);
                let neutral = hypothesised.effect.severity().neutral;
                let mut found_at = values.clone();
                found_at[0] = neutral + strength * (values[0] - neutral);
                match each.iter_mut().find(|(_, other, _)| other.run == onset.run) {
                    Some(best) if best.0 < found => *best = (found, onset, found_at),
                    Some(_) => {}
                    None => each.push((found, onset, found_at)),
                }
            }
        }
        let screening = Screening {
            ln_bayes: ln_sum(all.iter().copied()) - (all.len() as f64).ln(),
            score: 0.0,
            starts: Vec::new(),
            ..screening.clone()
        };
        Promising { screening, each }
    };
    let may_begin = screened
        .par_iter()
        .filter(|screening| screening.hypothesised.effect.may_begin);
    let mut promising: Vec<Promising> = may_begin.map(of_effect).collect();
    promising.sort_by(|a, b| b.ln_odds(judge).total_cmp(&a.ln_odds(judge)));
    promising
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::{RecordedRun, Simulation};
    use crate::explain::fixture::{Campaign, begun, record_under};
    use crate::explain::search::parameter::Hypothesised;
    use crate::explain::{Answer, Options, Verdict, explain};
    use crate::least_squares::Estimate;
    use worm_estimator::config::Config;
    use worm_physics::effect::named;

    /// An effect with a time, or throughout, that improves the fit by so much.
    fn candidate(name: &str, onset: Option<Onset>, improvement: f64) -> Candidate {
        let effect = named(name).expect("an effect");
        let hypothesised = vec![Hypothesised {
            onset,
            ..Hypothesised::throughout(effect, None)
        }];
        let estimate = Estimate {
            at: effect.values_with_neutral_shape(effect.severity().neutral),
            residual: Vec::new(),
            jacobian: Vec::new(),
            chi_squared: 0.0,
            converged: true,
        };
        Candidate {
            fit: Fit::new(&Hypothesis::new(&[], &hypothesised), estimate),
            hypothesised,
            improvement,
            ln_onset: 0.0,
            evidence: None,
            held_out: None,
            trace: None,
        }
    }

    /// One per cent more than without it is what a law that is known to a tenth may owe to it.
    #[test]
    fn a_time_must_do_more_than_a_law_may_be_wrong_by() {
        let ends = Some(Onset::until(9.9, Some(2)));
        let both = ends.map(|ends| Onset {
            begins: Some(4.0),
            ..ends
        });
        let throughout = candidate("backlash", None, 10_000.0);
        assert!(explains_as_much(&throughout, &candidate("backlash", ends, 10_099.0)));
        assert!(!explains_as_much(&throughout, &candidate("backlash", ends, 10_101.0)));
        assert!(!explains_as_much(&throughout, &candidate("pad-creep", ends, 10_099.0)));
        assert!(!explains_as_much(&candidate("backlash", ends, 10_099.0), &throughout));
        let in_another_run = Some(Onset::until(9.9, Some(1)));
        let once = |onset| candidate("backlash", onset, 20_000.0);
        assert!(explains_as_much(&once(ends), &candidate("backlash", both, 20_100.0)));
        assert!(!explains_as_much(
            &once(in_another_run),
            &candidate("backlash", both, 20_100.0)
        ));
    }

    /// The answer about worms of the usual campaign under which an effect begins or ends.
    fn answer(truth: (&str, Option<usize>, &[f64]), onset: Onset) -> Answer {
        let campaign = Campaign {
            simulation: Simulation {
                cycles: 8.0,
                ..Campaign::default().simulation
            },
            ..Campaign::default()
        };
        let recordings = record_under(&campaign, &begun(Some(truth), onset), 5);
        let runs: Vec<RecordedRun<'_>> = recordings
            .iter()
            .zip(&campaign.slopes_deg)
            .map(|(recording, &slope_deg)| RecordedRun::at_slope(recording, slope_deg))
            .collect();
        let answer = explain(&runs, &Config::default(), &Options::default(), &mut |_| ()).expect("an answer");
        assert_eq!(answer.verdict, Verdict::Explained, "{onset:?}: {}", answer.sentence);
        answer
    }

    /// Half the clamping of a cell, in the second run up to the middle, from there on, or for some cycles.
    #[test]
    fn what_begins_what_ends_and_what_does_both_are_told_apart() {
        let spell = Onset {
            ends: Some(5.0),
            ..Onset::from(2.0, Some(1))
        };
        for onset in [Onset::from(4.0, Some(1)), Onset::until(4.0, Some(1)), spell] {
            let answer = answer(("unequal-clamping", Some(1), &[0.5]), onset);
            let effect = &answer.effects[0];
            assert_eq!((effect.name.as_str(), effect.cell), ("unequal-clamping", Some(2)));
            let found = effect.onset.as_ref().expect("it does not act throughout");
            assert_eq!(found.ends, onset.begins.is_none(), "{found:?}");
            assert_eq!(
                found.until_cycle.is_some(),
                onset.begins.and(onset.ends).is_some(),
                "{found:?}"
            );
            let is_near = |found: Option<f64>, truth: Option<f64>| {
                found
                    .zip(truth)
                    .is_none_or(|(found, truth)| (found - truth).abs() < 0.5)
            };
            assert!(is_near(Some(found.cycle), onset.begins.or(onset.ends)), "{found:?}");
            assert!(is_near(found.until_cycle, onset.ends), "{found:?}");
        }
    }

    /// Strokes that are lost in every run from the middle of a step on: half a tenth of a cycle off is a gap of many standard deviations.
    #[test]
    fn of_a_strong_effect_the_instant_is_found() {
        let begins = 4.79;
        let answer = answer(("lost-stroke", None, &[0.11]), Onset::from(begins, None));
        let effect = &answer.effects[0];
        assert_eq!(effect.name, "lost-stroke");
        let found = effect.onset.as_ref().expect("it does not act throughout");
        assert_eq!((found.ends, found.until_cycle, &found.run), (false, None, &None));
        // Two of the bins in which positions are compared.
        assert!((found.cycle - begins).abs() < 2.0 / 48.0, "{found:?}");
        let share = effect.parameters[0].value;
        assert!((share - 0.11).abs() < 0.004, "{share}");
    }
}
