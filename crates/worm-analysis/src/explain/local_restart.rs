//! Leaps over the walls between the valleys of a fit.
//!
//! Where a slick patch begins and ends, the misfit has a kink for each tip that comes to stand on the other side of an edge: a fit
//! that walks downhill stops at the first of them. So once it has stopped, the patch is tried out with its edges elsewhere, near
//! and far, and with another friction, and the fit goes on from the best of them, until none is better.

use super::fit::{Fit, FitProblem};
use super::parameter::What;

/// How far an edge leaps, as shares of the patch's length, and by what factor its slickness, one less its share of friction, does.
const LEAPS: [f64; 7] = [-0.4, -0.15, -0.04, 0.0, 0.04, 0.15, 0.4];
const SLICKNESS: [f64; 3] = [1.0, 1.8, 0.6];
const MAX_ROUNDS: usize = 6;
/// Fall of the misfit for which it is worth going on.
const WORTHWHILE: f64 = 2.0;

/// Leaps with the patch that was supposed last, where it is one.
pub(super) fn restart_locally(problem: &FitProblem<'_, '_>, mut fit: Fit) -> Fit {
    for _ in 0..MAX_ROUNDS {
        let Some(patch) = patch(&fit) else {
            return fit;
        };
        let landings = landings(patch.map(|quantity| fit.at[quantity]));
        let landed = landings.map(|values| {
            let mut at = fit.at.clone();
            for (quantity, value) in patch.into_iter().zip(values) {
                let free = &fit.hypothesis.free[quantity];
                at[quantity] = value.clamp(free.min, free.max);
            }
            problem.evaluate(&fit.hypothesis, at)
        });
        let best = landed.min_by(|a, b| a.chi_squared.total_cmp(&b.chi_squared));
        let Some(best) = best.filter(|best| best.chi_squared < fit.chi_squared - WORTHWHILE) else {
            return fit;
        };
        fit = problem.fit(&fit.hypothesis, best.at, Some(&fit));
    }
    fit
}

/// Where among the quantities the patch's friction, beginning and length are.
fn patch(fit: &Fit) -> Option<[usize; 3]> {
    let last = fit.hypothesis.hypothesised.len().checked_sub(1)?;
    if fit.hypothesis.hypothesised[last].effect.name != "slick-patch" {
        return None;
    }
    let number = |wanted: usize| {
        let mut free = fit.hypothesis.free.iter();
        free.position(
            |free| matches!(free.what, What::Effect { place, parameter } if place == last && parameter == wanted),
        )
    };
    Some([number(0)?, number(1)?, number(2)?])
}

/// Patches about one, each as friction factor, beginning and length.
fn landings([factor, from_m, length_m]: [f64; 3]) -> impl Iterator<Item = [f64; 3]> {
    let edges = LEAPS
        .into_iter()
        .flat_map(|before| LEAPS.into_iter().map(move |after| (before, after)));
    let patches = edges.flat_map(|edges| SLICKNESS.into_iter().map(move |slickness| (edges, slickness)));
    patches.map(move |((before, after), slickness)| {
        [
            1.0 - slickness * (1.0 - factor),
            from_m + before * length_m,
            length_m * (1.0 + after - before),
        ]
    })
}
