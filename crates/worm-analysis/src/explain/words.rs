//! The answer in words.

use super::answer::{FoundOnset, NamedEffect, Place, TorqueSeries, Verdict, answers_in_words};
use crate::explain::search::fit::Fit;
use crate::explain::search::judge::candidate::Candidate;
use crate::explain::search::judge::decision::Selected;
use crate::explain::search::parameter::{Free, What};
use crate::explain::worm::nuisance::Nuisance;
use crate::explain::worm::recorded_worm::RecordedWorm;
use crate::recording::Repair;
use worm_estimator::number::percent;
use worm_physics::effect::{LIBRARY, Visible};

/// Probability from which an effect that is not named is mentioned.
const WORTH_A_WORD: f64 = 0.1;
/// Standard deviations from which a deviation is no chance.
const SURE: f64 = 3.0;
/// Time of a gait cycle below which the current alone overstates the work, s: at 1.8 s by a fiftieth, at 1.3 s by more.
const FAST_GAIT_S: f64 = 1.8;

/// The verdict in a sentence or two; `held_out` is what the effects were judged on that they were not fitted to.
pub(super) fn sentence(
    verdict: Verdict,
    effects: &[NamedEffect],
    rivals: &[NamedEffect],
    selected: &Selected,
    open_share: f64,
    change: Option<&FoundOnset>,
    held_out: &str,
) -> String {
    match verdict {
        Verdict::Agrees => format!(
            "Model and data agree once the model is recalibrated within its priors: that nothing which matters is missing has a probability of {}, \
             counting what recalibration can hide.{}",
            percent(selected.null_probability()),
            not_sure_enough(selected)
        ),
        Verdict::Explained => format!("{} explains the data{}.", names(effects), closing(effects, held_out)),
        Verdict::Ambiguous if rivals.is_empty() => format!(
            "{} explains the data{}, but it is not sure: that nothing which matters is missing has a probability of {}, that something \
             else is one of {}.",
            names(effects),
            closing(effects, held_out),
            percent(selected.null_probability()),
            percent(selected.other_probability())
        ),
        Verdict::Ambiguous => format!(
            "{} explains the data{}, but so does {}: these data cannot decide between them.",
            names(effects),
            closing(effects, held_out),
            answers_in_words(rivals).join(", and so does ")
        ),
        Verdict::OutsideLibrary => {
            let nearest = selected.candidates.first().map_or_else(
                || "none comes near".to_owned(),
                |candidate| match of_library(candidate) {
                    // Less than a per cent would read as an explanation.
                    nearest if open_share < 0.01 => format!(
                        "{nearest} comes nearest and leaves no more than any model may be wrong by, but is not sure enough for a name"
                    ),
                    nearest if open_share >= 1.0 => format!("{nearest} comes nearest and closes nothing of the gap"),
                    nearest => format!(
                        "{nearest} comes nearest and leaves {:.0} % of the gap open",
                        100.0 * open_share
                    ),
                },
            );
            let changes = change.map_or_else(String::new, |change| {
                format!(" Something is different {}.", change.in_words())
            });
            format!(
                "Model and data disagree, and no effect of the library, alone or in a pair, explains how: {nearest}.{changes} That \
                 something else is missing has a probability of {}.",
                percent(selected.other_probability())
            )
        }
    }
}

/// That the body moves more irregularly than tips make it, as a further sentence, by the scatter of the friction that it would take.
pub(super) fn irregularity(scatter: f64) -> String {
    format!(
        " From one cycle to the next the body moves as irregularly as if the friction of every tip differed by {}: look for what shakes or tugs \
         at the worm, or for a canal that is not even.",
        percent(scatter)
    )
}

/// The verdict where conditions that are stated wrongly are more probable than all else, with what to do about it.
pub(super) fn misstated((what, what_to_do): (&str, &str), probability: f64) -> String {
    format!(
        "Model and data disagree, and no effect of the library explains it as well as {what} (probability {}): {what_to_do}.",
        percent(probability)
    )
}

/// That conditions may be stated wrongly, where it is probable enough to say or explains about as much as the best effect.
pub(super) fn suspicion(
    (what, what_to_do): (&str, &str),
    verdict: Verdict,
    selected: &Selected,
    is_as_good: bool,
) -> Option<String> {
    let probability = selected.misstated_probability;
    let is_worth_a_word = verdict != Verdict::Agrees && (is_as_good || probability >= WORTH_A_WORD);
    is_worth_a_word.then(|| match probability >= WORTH_A_WORD {
        true => format!(
            "{what} would explain these data as well (probability {}): {what_to_do}",
            percent(probability)
        ),
        false => format!("{what} would explain nearly as much: {what_to_do}"),
    })
}

/// What was not named though it may well be there, or is there and does not matter, as a further sentence.
fn not_sure_enough(selected: &Selected) -> String {
    let beyond_none = selected.visible_probability();
    match (selected.candidates.first(), selected.probability.first()) {
        // Chance decides first: a probability of what chance does would say too much.
        (Some(candidate), Some(&probability)) if selected.is_within_chance => match probability >= WORTH_A_WORD {
            true => format!(
                " Of the library {} comes nearest to what is left, but no nearer than the best of it comes by chance where nothing is missing.",
                of_library(candidate)
            ),
            false => String::new(),
        },
        (Some(candidate), Some(&probability)) if probability > beyond_none.max(WORTH_A_WORD) => format!(
            " What is left looks like {} (probability {}), which changes nothing that matters.",
            of_library(candidate),
            percent(probability)
        ),
        (Some(candidate), Some(&probability)) if probability >= WORTH_A_WORD => format!(
            " {} may be there, with a probability of {}: not enough for a name.",
            of_library(candidate),
            percent(probability)
        ),
        _ => String::new(),
    }
}

fn of_library(candidate: &Candidate) -> String {
    let names: Vec<&str> = candidate
        .named()
        .map(|(_, hypothesised)| hypothesised.effect.name)
        .collect();
    names.join(" with ")
}

fn names(effects: &[NamedEffect]) -> String {
    let name = |effect: &NamedEffect| match &effect.onset {
        Some(onset) => format!("{} ({})", effect.in_words(), onset.in_words()),
        None => effect.in_words(),
    };
    effects.iter().map(name).collect::<Vec<_>>().join(" together with ")
}

fn closing(effects: &[NamedEffect], held_out: &str) -> String {
    match effects.first() {
        Some(effect) if effect.closure.is_finite() => {
            let only = if effect.closure < 0.5 { "only " } else { "" };
            format!(
                ": it closes {only}{:.0} % of the gap on {held_out} that it was not fitted to",
                100.0 * effect.closure
            )
        }
        _ => String::new(),
    }
}

/// Share by which the stiffness may be off before it is worth a word where the current shows it: more than positions alone may move it.
const SOFTER: f64 = 0.1;

/// By how much the pads are softer or stiffer than the model has them, as a further sentence; none where it is little, not sure, or
/// nothing that the recordings show.
pub(super) fn of_pads(worm: &RecordedWorm<'_>, fit: &Fit) -> Option<String> {
    let is_stiffness = |free: &Free| Nuisance::of(free.what) == Some(Nuisance::Stiffness);
    let at = fit
        .hypothesis
        .free
        .iter()
        .position(is_stiffness)
        .filter(|_| worm.counts_current())?;
    let (value, sigma) = (fit.at[at], fit.sigmas()[at]);
    let share = value.exp_m1();
    (share.abs() > SOFTER && value.abs() > SURE * sigma).then(|| {
        let (pads, worm_is) = if share < 0.0 {
            ("softer", "heavier")
        } else {
            ("stiffer", "lighter")
        };
        let shown = match worm.sees_positions() {
            true => "the motor's current shows it".to_owned(),
            // Force over stiffness is what positions show.
            false => format!("that, or the worm is {worm_is}, which the motor's current alone hardly tells apart"),
        };
        format!(
            " The pads are {:.0} ± {:.0} % {pads} than the model has them: {shown}.",
            100.0 * share.abs(),
            100.0 * value.exp() * sigma,
        )
    })
}

/// How much of the gap the nearest effect leaves.
fn of_gap(open_share: f64) -> String {
    match open_share < 1.0 {
        true => format!("{:.0} % of the gap stays open", 100.0 * open_share),
        false => "all of the gap stays open".to_owned(),
    }
}

/// What no effect explains, in words.
pub(super) fn remainder(open_share: f64, places: &[Place]) -> String {
    let whole = of_gap(open_share);
    match places.first() {
        Some(place) => format!(
            "{whole}; it is largest at cell {} while cell {} steps, phase {:.2}, on the {}° run: {:+.3} mm in each cycle ({:.1} standard errors)",
            place.cell,
            place.stepping_cell,
            place.phase,
            place.slope_deg,
            1e3 * place.residual_m,
            place.significance
        ),
        None => format!("{whole}; it does not repeat from cycle to cycle at any one place"),
    }
}

/// The same of a worm that nobody sees, by the mean cycle of the torque in each run.
pub(super) fn remainder_of_torque(worm: &RecordedWorm<'_>, open_share: f64, torque: &[TorqueSeries]) -> String {
    let whole = of_gap(open_share);
    let off = torque.iter().flat_map(|run| {
        let pairs = run.phase.iter().zip(run.measured_n_m.iter().zip(&run.recalibrated_n_m));
        pairs.map(|(phase, (measured_n_m, model_n_m))| (run.slope_deg, *phase, measured_n_m - model_n_m))
    });
    let Some((slope_deg, phase, off_n_m)) = off.max_by(|a, b| a.2.abs().total_cmp(&b.2.abs())) else {
        return whole;
    };
    let order = &worm.scene.observed[0].step_order;
    let steps = order[(phase * order.len() as f64) as usize % order.len()] + 1;
    format!(
        "{whole}; the torque on the cam is farthest off while cell {steps} steps, phase {phase:.2}, on the {slope_deg}° run: {:+.2} mN m",
        1e3 * off_n_m
    )
}

/// Every repair of the recordings.
pub(super) fn repairs(worm: &RecordedWorm<'_>) -> Vec<Repair> {
    let observed = worm.scene.observed.iter().enumerate();
    observed
        .flat_map(|(run, observed)| observed.repairs.iter().map(move |repair| repair.in_run(run)))
        .collect()
}

/// Limitations of the answer.
pub(super) fn warnings(
    worm: &RecordedWorm<'_>,
    fit: &Fit,
    named: Option<&Candidate>,
    gears_calibrated: bool,
) -> Vec<String> {
    let observed = &worm.scene.observed;
    let mut warnings: Vec<String> = observed
        .iter()
        .flat_map(|observed| &observed.run.recording.warnings)
        .cloned()
        .collect();
    let several = observed.len() > 1;
    warnings.extend(repairs(worm).iter().map(|repair| match several {
        true => format!("run {}: {repair}", repair.run),
        false => repair.to_string(),
    }));
    if observed.len() == 1 {
        warnings.push(
            "one run alone leaves most effects hardly visible or alike: record the worm on several slopes".to_owned(),
        );
    }
    if !observed.iter().any(|observed| observed.phase_recorded) {
        let hidden = LIBRARY.iter().filter(|effect| effect.visible == Visible::RecordedPhase);
        let names: Vec<&str> = hidden.map(|effect| effect.name).collect();
        warnings.push(format!(
            "no gait phase was recorded: {} cannot be seen without it, nor can most of what the stepping cell does",
            names.join(" and ")
        ));
    }
    if !worm.sees_positions() {
        warnings.push(
            "the motor's current alone is evidence, and it shows forces: how far the worm came is what a model with these forces does"
                .to_owned(),
        );
    }
    let fastest_s = observed
        .iter()
        .map(|observed| observed.cycle_s)
        .fold(f64::INFINITY, f64::min);
    if !worm.sees_positions() && fastest_s < FAST_GAIT_S {
        warnings.push(format!(
            "at {fastest_s:.1} s a cycle work by the current alone comes out too large, of sound virtual worms by up to a seventh: record a crawl of \
             2.5 s a cycle",
        ));
    }
    if worm.counts_current() && !gears_calibrated {
        warnings.push(
            "the motor's current counts, and the friction of its gears was never calibrated: `wormd calibrate` makes the forces better known"
                .to_owned(),
        );
    }
    let limits = fit.hypothesis.free.iter().enumerate();
    let at_limit = limits
        .filter(|(at, free)| matches!(free.what, What::Nuisance(_)) && fit.would_go_beyond(*at))
        .count();
    if at_limit > 0 {
        warnings.push(format!(
            "{at_limit} of the recalibrated values lie at the end of what their priors allow: see the calibration"
        ));
        if !worm.sees_positions() {
            warnings.push(
                "so work and advance may be far off, as where several tips hold unlike the others: `wormd infer` on the log gives every tip a \
                 friction of its own"
                    .to_owned(),
            );
        }
    }
    let trace = named.and_then(|candidate| Some(&candidate.hypothesised[candidate.trace?]));
    warnings.extend(trace.map(|trace| {
        format!(
            "a trace of {} was fitted beside it, which improves the fit and changes nothing that matters",
            trace.effect.name
        )
    }));
    warnings
}
