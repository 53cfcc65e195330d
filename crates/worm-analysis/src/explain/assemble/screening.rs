//! What became of every effect of the library.

use crate::explain::answer::{Screened, ScreeningOutcome};
use crate::explain::search::find::Found;
use worm_physics::effect::{Effect, LIBRARY, SERVO_LIBRARY};

/// The scores of a worm's library, and what became of each effect.
pub(super) fn of_worm(found: &Found, droops: bool) -> Vec<Screened> {
    let unseen = |effect: &Effect| match (effect.shows_in_time_alone(), droops) {
        (true, true) => ScreeningOutcome::Refitted,
        (true, false) => ScreeningOutcome::ScreenedOut,
        (false, _) => ScreeningOutcome::NotVisible,
    };
    of_library(found, &LIBRARY, unseen)
}

/// The scores of a servo's library, and what became of each effect.
pub(in crate::explain) fn of_servo(found: &Found) -> Vec<Screened> {
    of_library(found, &SERVO_LIBRARY, |_| ScreeningOutcome::NotVisible)
}

fn of_library(
    found: &Found,
    library: &[&'static Effect],
    unseen: impl Fn(&Effect) -> ScreeningOutcome,
) -> Vec<Screened> {
    let mut rows = screening(found);
    add_unscreened(&mut rows, library, |effect| {
        match found.left_out.contains(&effect.name) {
            true => ScreeningOutcome::LeftOut,
            false => unseen(effect),
        }
    });
    rows
}

/// The scores of the effects that were screened, and what became of each.
fn screening(found: &Found) -> Vec<Screened> {
    found
        .screened
        .iter()
        .map(|screening| {
            let candidate = found
                .fitted
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

/// Adds every effect of a library that has no row yet, with what became of it.
pub(in crate::explain) fn add_unscreened(
    rows: &mut Vec<Screened>,
    library: &[&'static Effect],
    outcome: impl Fn(&Effect) -> ScreeningOutcome,
) {
    for effect in library {
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
