//! The answer in words.

use super::answer::{NamedEffect, Place, Verdict, answers_in_words};
use super::fit::{Fit, FitProblem};
use super::model_selection::Selected;
use super::parameter::What;
use crate::recording::Repair;
use worm_physics::effect::{LIBRARY, Visible};

/// The verdict in a sentence or two. `refused` is the fraction of the held-out gap that the best effect closes, where that is too
/// little to name it.
pub(super) fn sentence(
    verdict: Verdict,
    effects: &[NamedEffect],
    rivals: &[NamedEffect],
    selected: &Selected,
    refused: Option<f64>,
    threshold: f64,
) -> String {
    match verdict {
        Verdict::Agrees => {
            let best = selected
                .all
                .iter()
                .map(|candidate| candidate.improvement)
                .fold(0.0, f64::max);
            let why = if best > threshold {
                "what improves the fit by more is too weak to matter, is not kept on held-out data, or closes next to nothing of the gap"
            } else {
                "no effect of the library does"
            };
            format!(
                "Model and data agree once the model is recalibrated within its priors: an effect must improve the fit by {threshold:.0}, and {why} (best: {best:.0})."
            )
        }
        Verdict::Explained => format!("{} explains the data{}.", names(effects), closing(effects)),
        Verdict::Ambiguous => format!(
            "{} explains the data{}, but so does {}: these data cannot decide between them.",
            names(effects),
            closing(effects),
            answers_in_words(rivals).join(", and so does ")
        ),
        Verdict::OutsideLibrary => {
            let nearest = selected.candidates.first().map_or_else(
                || "none that is strong enough to matter keeps its improvement on held-out data".to_owned(),
                |candidate| {
                    let names: Vec<&str> = candidate
                        .hypothesised
                        .iter()
                        .map(|hypothesised| hypothesised.effect.name)
                        .collect();
                    let how_near = match refused {
                        Some(closure) => format!(
                            "closes {:.0} % of the gap on cycles that it was not fitted to",
                            100.0 * closure.max(0.0)
                        ),
                        None => format!("leaves {:.0} % of the gap open", 100.0 * selected.open_share),
                    };
                    format!("{} comes nearest and {how_near}", names.join(" with "))
                },
            );
            format!(
                "Model and data disagree, and no effect of the library, alone or in a pair, explains how: {nearest}."
            )
        }
    }
}

fn names(effects: &[NamedEffect]) -> String {
    let names: Vec<String> = effects.iter().map(NamedEffect::in_words).collect();
    names.join(" together with ")
}

fn closing(effects: &[NamedEffect]) -> String {
    match effects.first() {
        Some(effect) if effect.closure.is_finite() => format!(
            ": it closes {:.0} % of the gap on cycles that it was not fitted to",
            100.0 * effect.closure
        ),
        _ => String::new(),
    }
}

/// What no effect explains, in words.
pub(super) fn remainder(selected: &Selected, places: &[Place]) -> String {
    let whole = format!("{:.0} % of the gap stays open", 100.0 * selected.open_share);
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

/// Every repair of the recordings.
pub(super) fn repairs(problem: &FitProblem<'_, '_>) -> Vec<Repair> {
    let observed = problem.scene.observed.iter().enumerate();
    observed
        .flat_map(|(run, observed)| observed.repairs.iter().map(move |repair| repair.in_run(run)))
        .collect()
}

/// Limitations of the answer.
pub(super) fn warnings(problem: &FitProblem<'_, '_>, fit: &Fit) -> Vec<String> {
    let observed = &problem.scene.observed;
    let mut warnings: Vec<String> = observed
        .iter()
        .flat_map(|observed| &observed.run.recording.warnings)
        .cloned()
        .collect();
    let several = observed.len() > 1;
    warnings.extend(repairs(problem).iter().map(|repair| match several {
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
    let limits = fit.hypothesis.free.iter().enumerate();
    let at_limit = limits
        .filter(|(at, free)| matches!(free.what, What::Nuisance(_)) && fit.at_limit(*at))
        .count();
    if at_limit > 0 {
        warnings.push(format!(
            "{at_limit} of the recalibrated values lie at the end of what their priors allow: see the calibration"
        ));
    }
    warnings
}
