//! The next experiment: the one change of a run that would best decide what this campaign could not.
//!
//! Every change is simulated under each rival's fitted physics, with the noise of the campaign, and the predictions are compared with
//! everything free in them still free (see [`trial`]). The figure of merit is the distance between the two nearest predictions. More than
//! enough is not better, so a cheaper run that decides comes before a dearer one that decides twice over. Where no run
//! separates the rivals, a measurement on the bench is proposed.

mod change;
mod trial;

use super::answer::{ExperimentChange, NextExperiment, Prediction};
use crate::explain::search::fit::Fit;
use crate::explain::search::parameter::{Hypothesised, What};
use crate::explain::worm::recorded_worm::RecordedWorm;
pub(super) use change::SLOPES_DEG;
use change::{BY_COST, Change, changes, cost};
use rayon::prelude::*;
use trial::{Adjustment, RunOutcome, Trial, empty_recording, plain_distance};
use worm_physics::effect::Setting;

/// Distance that decides, and smallest distance of a run that is worth making, standard deviations.
const SETTLES: f64 = 5.0;
const WORTH_IT: f64 = 3.0;
/// Changes of one kind that are evaluated in full.
const CLOSE_LOOKS: usize = 2;
/// Fraction of the stroke that every rival's worm must advance in a cycle: one that hardly advances is no experiment.
pub(super) const MIN_ADVANCE: f64 = 0.05;

/// What to measure of a worm that nobody saw.
const POSITIONS: &str = "positions of the cells beside the current";

/// A change with the separation it would give.
struct ScoredChange {
    change: Change,
    separation: f64,
}

impl ScoredChange {
    /// Separation for its cost; more than enough is worth no more.
    fn worth(&self) -> f64 {
        self.separation.min(SETTLES) / cost(self.change.what)
    }
}

/// The run that best separates rivals, fitted with derivatives; none with fewer than two.
///
/// `cycle_s` is the usual time of a gait cycle.
pub(super) fn propose(worm: &RecordedWorm<'_>, candidates: &[&Fit], cycle_s: f64) -> Option<NextExperiment> {
    if candidates.len() < 2 {
        return None;
    }
    if worm.scene.observed.iter().any(|observed| !observed.sees_positions) {
        return Some(with_positions(candidates));
    }
    // A new run shows what has begun from its start.
    let begun: Vec<Fit> = candidates
        .iter()
        .map(|fit| Fit {
            hypothesis: fit.hypothesis.without_onsets(),
            ..(*fit).clone()
        })
        .collect();
    let candidates: &[&Fit] = &begun.iter().collect::<Vec<_>>();
    let changes = changes(&worm.scene, cycle_s);
    let plain_distance_of = |change: &Change| {
        let empty_recording = empty_recording(worm, change);
        let outcomes = predict_all(&Trial::new(worm, change, &empty_recording)?, candidates)?;
        let crawls = |outcome: &RunOutcome| outcome.advance_m > MIN_ADVANCE * worm.scene.nominal[0].worm.stroke_m();
        outcomes
            .iter()
            .all(crawls)
            .then(|| nearest(&outcomes, |a, b| plain_distance(&outcomes[a], &outcomes[b])))
    };
    let plain: Vec<Option<f64>> = changes.par_iter().map(plain_distance_of).collect();
    let mut possible: Vec<(f64, Change)> = plain
        .into_iter()
        .zip(changes)
        .filter_map(|(distance, change)| Some((distance?, change)))
        .collect();
    possible.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut best: Option<ScoredChange> = None;
    for what in BY_COST {
        // Dearer kinds cannot be worth more than one that decides already.
        if best.as_ref().is_some_and(|best| best.worth() > SETTLES / cost(what)) {
            break;
        }
        let mine = possible.iter().filter(|(_, change)| change.what == what);
        for &(_, change) in mine.take(CLOSE_LOOKS) {
            let separation = separation(worm, candidates, &change);
            let Some(separation) = separation.filter(|separation| *separation >= WORTH_IT) else {
                continue;
            };
            let scored = ScoredChange { change, separation };
            let is_better = best.as_ref().is_none_or(|best| {
                let order = scored.worth().total_cmp(&best.worth());
                order.then(separation.total_cmp(&best.separation)).is_gt()
            });
            if is_better {
                best = Some(scored);
            }
        }
    }
    match best {
        Some(best) => proposal(worm, candidates, &best),
        None => on_the_bench(candidates),
    }
}

/// Predictions of every rival for a run; none where the worm of one does not hold.
fn predict_all(trial: &Trial<'_>, candidates: &[&Fit]) -> Option<Vec<RunOutcome>> {
    candidates.iter().map(|rival| trial.predict(rival)).collect()
}

/// The smallest distance between any two rivals.
fn nearest(outcomes: &[RunOutcome], distance: impl Fn(usize, usize) -> f64) -> f64 {
    let pairs = (0..outcomes.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
    pairs.map(|(a, b)| distance(a, b)).fold(f64::INFINITY, f64::min)
}

/// Distance between the two nearest predictions of a run, standard deviations, whichever of the two is true.
fn separation(worm: &RecordedWorm<'_>, candidates: &[&Fit], change: &Change) -> Option<f64> {
    let empty_recording = empty_recording(worm, change);
    let trial = Trial::new(worm, change, &empty_recording)?;
    let outcomes = predict_all(&trial, candidates)?;
    // Derivatives of nuisances hardly depend on the effect beside them, so those of one rival serve all: the quickest to simulate.
    let quick = candidates
        .iter()
        .position(|rival| trial.is_periodic(rival))
        .unwrap_or(0);
    let tasks: Vec<(usize, usize)> = (0..candidates.len())
        .flat_map(|rival| {
            Trial::relevant_quantities(candidates[rival])
                .into_iter()
                .map(move |quantity| (rival, quantity))
        })
        .filter(|&(rival, quantity)| rival == quick || same(candidates, (rival, quantity), quick).is_none())
        .collect();
    let columns: Vec<Vec<f64>> = tasks
        .par_iter()
        .map(|&(rival, quantity)| trial.derivative(candidates[rival], &outcomes[rival], quantity))
        .collect();
    let column = |rival: usize, quantity: usize| {
        let computed = tasks.iter().position(|&task| {
            task == (rival, quantity)
                || Some(task) == same(candidates, (rival, quantity), quick).map(|same| (quick, same))
        });
        computed.map(|task| columns[task].clone())
    };
    let adjustments: Vec<Adjustment> = (0..candidates.len())
        .map(|rival| {
            let relevant_quantities = Trial::relevant_quantities(candidates[rival]);
            let columns = relevant_quantities.into_iter().map(|quantity| column(rival, quantity));
            Adjustment::new(candidates[rival], columns.collect::<Option<_>>()?)
        })
        .collect::<Option<_>>()?;
    Some(nearest(&outcomes, |a, b| {
        let by_a = adjustments[a].distance(&outcomes[a], &outcomes[b]);
        by_a.min(adjustments[b].distance(&outcomes[a], &outcomes[b]))
    }))
}

/// The quantity of one rival that is the same nuisance as a quantity of another.
fn same(candidates: &[&Fit], (rival, quantity): (usize, usize), other: usize) -> Option<usize> {
    let what = candidates[rival].hypothesis.free[quantity].what;
    let others = &candidates[other].hypothesis.free;
    let is_nuisance = matches!(what, What::Nuisance(_));
    others.iter().position(|free| is_nuisance && free.what == what)
}

/// The proposal of a run.
fn proposal(worm: &RecordedWorm<'_>, candidates: &[&Fit], best: &ScoredChange) -> Option<NextExperiment> {
    let empty_recording = empty_recording(worm, &best.change);
    let trial = Trial::new(worm, &best.change, &empty_recording)?;
    let outcomes = predict_all(&trial, candidates)?;
    let slope = format!("{}°", best.change.slope_deg).replace('-', "−");
    let predictions = candidates
        .iter()
        .zip(&outcomes)
        .enumerate()
        .map(|(number, (rival, mine))| Prediction {
            effect: name(rival),
            advance_m: Some(mine.advance_m),
            description: match number {
                0 => format!("at {slope}"),
                _ => format!(
                    "at {slope}, {}",
                    difference_in_words(&trial, mine, &outcomes[0], &name(candidates[0]))
                ),
            },
        });
    let what = best.change.what;
    Some(NextExperiment {
        change: ExperimentChange::Run(what),
        value: Some(best.change.value),
        unit: what.unit().to_owned(),
        slope_deg: Some(best.change.slope_deg),
        description: best.change.in_words(),
        predictions: predictions.collect(),
        separation_sigma: Some(best.separation),
    })
}

/// Difference of a prediction from the first one: in its advance, and within a cycle.
fn difference_in_words(trial: &Trial<'_>, mine: &RunOutcome, first: &RunOutcome, first_name: &str) -> String {
    let farther_m = mine.advance_m - first.advance_m;
    let phase = trial.phase();
    let end = phase[phase.len() - 1];
    let from = phase.partition_point(|&phase| phase < end - 1.0);
    let cells = mine.predicted.position_m.len() / phase.len();
    let apart_m = |cell: usize, sample: usize| {
        let at = sample * cells + cell;
        mine.predicted.position_m[at] - first.predicted.position_m[at] - farther_m * phase[sample]
    };
    let widest_m = (0..cells)
        .map(|cell| {
            let apart_m = (from..phase.len()).map(|sample| apart_m(cell, sample));
            let ends = apart_m.fold((f64::INFINITY, f64::NEG_INFINITY), |ends, m| {
                (m.min(ends.0), m.max(ends.1))
            });
            ends.1 - ends.0
        })
        .fold(0.0, f64::max);
    let than = if farther_m < 0.0 { "less" } else { "more" };
    format!(
        "{:.3} mm a cycle {than} than {first_name}, and within a cycle up to {:.3} mm apart from it",
        farther_m.abs() * 1e3,
        widest_m * 1e3
    )
}

/// Positions beside the current, where some run has none: what a run would show in its torque is not simulated.
fn with_positions(candidates: &[&Fit]) -> NextExperiment {
    let description = "The motor's current alone does not decide between these. Record the positions of the cells as well, and explain both.";
    measurement(candidates, POSITIONS, description.to_owned())
}

/// A measurement on the bench, where no run decides; none where no rival has an effect.
fn on_the_bench(candidates: &[&Fit]) -> Option<NextExperiment> {
    let hypothesised = candidates
        .iter()
        .find_map(|rival| rival.hypothesis.hypothesised.first())?;
    let by = hypothesised.effect.separated_by;
    let description = format!(
        "No single run of this worm separates these. Measure {} directly ({by}).",
        hypothesised.effect.name
    );
    Some(measurement(candidates, by, description))
}

/// A measurement instead of a run, with what each rival says of it.
fn measurement(candidates: &[&Fit], what: &'static str, description: String) -> NextExperiment {
    let prediction = |rival: &&Fit| Prediction {
        effect: name(rival),
        advance_m: None,
        description: values(rival),
    };
    NextExperiment {
        change: ExperimentChange::Measurement(what),
        value: None,
        unit: String::new(),
        slope_deg: None,
        description,
        predictions: candidates.iter().map(prediction).collect(),
        separation_sigma: None,
    }
}

/// Names of the effects of a rival.
fn name(rival: &Fit) -> String {
    let names: Vec<String> = rival.hypothesis.hypothesised.iter().map(name_of).collect();
    if names.is_empty() {
        "no effect".to_owned()
    } else {
        names.join(" and ")
    }
}

fn name_of(hypothesised: &Hypothesised) -> String {
    match hypothesised.cell {
        Some(cell) => format!("{} of cell {}", hypothesised.effect.name, cell + 1),
        None => hypothesised.effect.name.to_owned(),
    }
}

/// The fitted values of a rival.
fn values(rival: &Fit) -> String {
    let value = |setting: &Setting| {
        let with_value = setting.effect().parameters.iter().zip(setting.values());
        let values = with_value.map(|(parameter, value)| {
            let text = format!("{} {value:.4} {}", parameter.about, parameter.unit);
            text.trim_end().to_owned()
        });
        values.collect::<Vec<_>>().join(", ")
    };
    let settings = rival.hypothesis.settings(&rival.at);
    settings.iter().map(value).collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests;
