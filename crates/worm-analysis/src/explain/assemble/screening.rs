//! What became of every effect of the library.

use crate::explain::answer::{Screened, ScreeningOutcome};
use crate::explain::search::judge::decision::Selected;
use crate::explain::search::score_test::Screening;
use worm_physics::effect::{Effect, LIBRARY};

/// The scores of a worm's library, and what became of each effect.
pub(super) fn of_worm(screened: &[Screening], selected: &Selected, droops: bool) -> Vec<Screened> {
    let mut rows = screening(screened, selected);
    add_unscreened(&mut rows, |effect| match (effect.shows_in_time_alone(), droops) {
        (true, true) => ScreeningOutcome::Refitted,
        (true, false) => ScreeningOutcome::ScreenedOut,
        (false, _) => ScreeningOutcome::NotVisible,
    });
    rows
}

/// The scores of the effects that were screened, and what became of each.
pub(in crate::explain) fn screening(screened: &[Screening], selected: &Selected) -> Vec<Screened> {
    screened
        .iter()
        .map(|screening| {
            let candidate = selected
                .all
                .iter()
                .find(|candidate| candidate.hypothesised == [screening.hypothesised]);
            Screened {
                name: screening.hypothesised.effect.name.to_owned(),
                cell: screening.hypothesised.cell.map(|cell| cell + 1),
                score: screening.score,
                improvement: candidate
                    .filter(|candidate| candidate.fit.converged)
                    .map(|candidate| candidate.improvement),
                outcome: match candidate {
                    None => ScreeningOutcome::ScreenedOut,
                    Some(candidate) if candidate.fit.converged => ScreeningOutcome::Refitted,
                    Some(_) => ScreeningOutcome::DidNotConverge,
                },
            }
        })
        .collect()
}

/// Adds every effect of the library that has no row yet, with what became of it.
pub(in crate::explain) fn add_unscreened(rows: &mut Vec<Screened>, outcome: impl Fn(&Effect) -> ScreeningOutcome) {
    for effect in LIBRARY {
        if !rows.iter().any(|row| row.name == effect.name) {
            rows.push(Screened {
                name: effect.name.to_owned(),
                cell: None,
                score: 0.0,
                improvement: None,
                outcome: outcome(effect),
            });
        }
    }
}
