//! The answer, put together from what was found.

mod calibration;
mod effects;
mod runs;
mod screening;
mod stages;

use super::answer::{Answer, Figures, NamedEffect, Remainder, ResidualMap, Verdict};
use super::cross_validation::HeldOut;
use super::experiment_design::propose;
use super::fit::{Fit, FitProblem};
use super::gap::cycles;
use super::model_selection::{Candidate, Selected};
use super::period::period;
use super::residual_map::{map, places};
use super::score_test::Screening;
use super::speed_droop::SpeedDroop;
use super::words;
pub(super) use calibration::calibration;
pub(super) use effects::named_effects;
pub(super) use screening::add_unscreened;
use worm_estimator::config::Config;

/// Places listed at most.
const PLACES: usize = 12;
/// Fraction of the held-out gap that the best effect must close to be named.
const CLOSES: f64 = 0.15;
/// Improvement from which a motor that droops is named: chance reaches 4 one time in twenty, and there is one such quantity.
const DROOPS: f64 = 16.0;

/// Everything that the answer is made of.
pub(super) struct Parts {
    pub nominal: Fit,
    pub recalibrated: Fit,
    pub recalibrated_held_out: HeldOut,
    pub screened: Vec<Screening>,
    pub selected: Selected,
    pub speed_droop: Option<SpeedDroop>,
    pub threshold: f64,
}

/// Puts the answer together.
pub(super) fn assemble(problem: &FitProblem<'_, '_>, config: &Config, parts: &Parts) -> Answer {
    let selected = &parts.selected;
    let speed_droop = parts
        .speed_droop
        .as_ref()
        .filter(|speed_droop| speed_droop.improvement > DROOPS);
    let mut named: &[Candidate] = match selected.verdict {
        Verdict::Explained | Verdict::Ambiguous => &selected.candidates,
        Verdict::Agrees | Verdict::OutsideLibrary => &[],
    };
    let mut gap = stages::Gap::measure(problem, parts, named);
    let mut of_positions = selected.verdict;
    let refused = gap.closure.first().copied().filter(|closure| *closure < CLOSES);
    if refused.is_some() {
        named = &[];
        gap = stages::Gap::measure(problem, parts, named);
        of_positions = if selected.gap_is_negligible {
            Verdict::Agrees
        } else {
            Verdict::OutsideLibrary
        };
    }
    let verdict = match (of_positions, speed_droop) {
        (Verdict::Agrees, Some(_)) => Verdict::Explained,
        (verdict, _) => verdict,
    };
    let mut effects = Vec::new();
    let mut rivals = Vec::new();
    for (place, candidate) in named.iter().enumerate() {
        let found = named_effects(
            candidate,
            selected.probability[place],
            gap.closure[place],
            gap.margin(place),
        );
        if place == 0 {
            effects = found;
        } else {
            // An effect that the first answer names is no rival of it.
            let is_new = |effect: &NamedEffect| {
                !effects
                    .iter()
                    .any(|named: &NamedEffect| named.in_words() == effect.in_words())
            };
            rivals.extend(found.into_iter().filter(is_new));
        }
    }
    effects.extend(speed_droop.map(effects::droop_effect));
    let final_fit = named.first().map_or(&parts.recalibrated, |candidate| &candidate.fit);
    let maps_before = maps(problem, &parts.recalibrated);
    let best = selected.candidates.first().map(|candidate| &candidate.fit);
    let maps_after = match verdict {
        Verdict::Agrees => Vec::new(),
        _ => best.map_or_else(Vec::new, |fit| maps(problem, fit)),
    };
    let remainder = (verdict == Verdict::OutsideLibrary).then(|| {
        let places = places(&maps_after, PLACES);
        let period = period(problem, best.unwrap_or(&parts.recalibrated));
        Remainder {
            description: words::remainder(selected, &places),
            open_share: selected.open_share,
            period_cycles: period.cycles,
            period_m: period.displacement_m,
            places,
        }
    });
    let cycle_s = config.gait.cycle_s;
    let next_experiment = match verdict {
        Verdict::Ambiguous => {
            let fits: Vec<&Fit> = named.iter().map(|candidate| &candidate.fit).collect();
            propose(problem, &fits, cycle_s)
        }
        _ => None,
    };
    let runs = runs::runs(problem, parts, named.first());
    Answer {
        verdict,
        sentence: words::sentence(verdict, &effects, &rivals, selected, refused, parts.threshold),
        r#where: places(&maps_before, PLACES),
        effects,
        rivals,
        stages: gap.stages,
        remainder,
        next_experiment,
        calibration: calibration(final_fit, config),
        screening: screening::screening(&parts.screened, selected, speed_droop.is_some()),
        threshold: parts.threshold,
        warnings: words::warnings(problem, final_fit),
        repairs: words::repairs(problem),
        runs,
        figures: Figures {
            maps_before,
            maps_after,
            cycles: cycles(
                problem,
                &parts.nominal,
                &parts.recalibrated,
                named.first().map(|candidate| &candidate.fit),
            ),
            model_diff: Vec::new(),
        },
    }
}

fn maps(problem: &FitProblem<'_, '_>, fit: &Fit) -> Vec<ResidualMap> {
    (0..problem.scene.observed.len())
        .map(|run| map(problem, run, fit))
        .collect()
}
