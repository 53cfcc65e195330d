//! The answer in words.

use super::answer::{NamedEffect, Place, Verdict};
use super::fit::{Fit, Problem};
use super::judge::Judged;

/// The outcome in a sentence or two.
pub(super) fn sentence(
    verdict: Verdict,
    effects: &[NamedEffect],
    rivals: &[NamedEffect],
    judged: &Judged,
    threshold: f64,
) -> String {
    let best = judged.all.iter().map(|find| find.improvement).fold(0.0, f64::max);
    match verdict {
        Verdict::Agrees => format!(
            "Model and data agree once the model is recalibrated within its priors: the best effect of the library improves the fit by {best:.0}, and {threshold:.0} is asked for."
        ),
        Verdict::Explained => format!("{} explains the data{}.", names(effects), closing(effects)),
        Verdict::Ambiguous => format!(
            "{} explains the data{}, but so does {}: these data cannot decide between them.",
            names(effects),
            closing(effects),
            rivals.iter().map(name).collect::<Vec<_>>().join(", and so does ")
        ),
        Verdict::OutsideLibrary => format!(
            "Model and data disagree, and no effect of the library, alone or in a pair, explains how: {} comes nearest and leaves {:.0} % of the gap open.",
            judged.candidates.first().map_or_else(
                || "none".to_owned(),
                |find| find
                    .supposed
                    .iter()
                    .map(|supposed| supposed.effect.name)
                    .collect::<Vec<_>>()
                    .join(" with ")
            ),
            100.0 * judged.open_share
        ),
    }
}

fn name(effect: &NamedEffect) -> String {
    match effect.cell {
        Some(cell) => format!("{} of cell {cell}", effect.name),
        None => effect.name.clone(),
    }
}

fn names(effects: &[NamedEffect]) -> String {
    effects.iter().map(name).collect::<Vec<_>>().join(" together with ")
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

/// What nothing explains, in words.
pub(super) fn remainder(judged: &Judged, places: &[Place]) -> String {
    let whole = format!("{:.0} % of the gap stays open", 100.0 * judged.open_share);
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

/// What the user should know.
pub(super) fn warnings(problem: &Problem<'_, '_>, fit: &Fit) -> Vec<String> {
    let observed = &problem.scene.observed;
    let mut warnings: Vec<String> = observed
        .iter()
        .flat_map(|observed| &observed.run.recording.warnings)
        .cloned()
        .collect();
    if observed.len() == 1 {
        warnings.push(
            "one run alone leaves most effects hardly visible or alike: record the worm on several slopes".to_owned(),
        );
    }
    if !observed.iter().any(|observed| observed.phase_recorded) {
        warnings.push(
            "no gait phase was recorded: backlash and sensor-latency cannot be seen without it, nor can most of what the stepping cell does".to_owned(),
        );
    }
    let limits = fit.hypothesis.free.iter().enumerate();
    let at_limit = limits
        .filter(|(at, free)| free.sigma.is_finite() && fit.at_limit(*at))
        .count();
    if at_limit > 0 {
        warnings.push(format!(
            "{at_limit} of the recalibrated values lie at the end of what their priors allow: see the calibration"
        ));
    }
    warnings
}
