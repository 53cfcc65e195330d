//! Restarts a fit about the values at which it stopped.
//!
//! Some effects give the objective many local minima: where a slick patch begins and ends, it has a kink for each tip that comes to
//! stand on the other side of an end, and a descent stops at the first of them. Such an effect lists values to restart from
//! ([`Effect::restarts`](worm_physics::effect::Effect::restarts)); the fit goes on from the best of them, until none is better.

use super::fit::Fit;
use super::parameter::What;
use super::plant::Plant;
use super::problem::FitProblem;

const MAX_ROUNDS: usize = 6;
/// Fall of chi-squared for which it is worth going on.
const WORTHWHILE: f64 = 2.0;

/// Restarts a fit in the parameters of its last effect.
pub(in crate::explain) fn restart_locally(problem: &FitProblem<'_, impl Plant>, mut fit: Fit) -> Fit {
    for _ in 0..MAX_ROUNDS {
        let Some((quantities, restarts)) = restarts(&fit) else {
            return fit;
        };
        let evaluated = restarts.iter().map(|values| {
            let mut at = fit.at.clone();
            for (&quantity, value) in quantities.iter().zip(values) {
                let free = &fit.hypothesis.free[quantity];
                at[quantity] = value.clamp(free.quantity.min, free.quantity.max);
            }
            problem.evaluate(&fit.hypothesis, at)
        });
        let best = evaluated.min_by(|a, b| a.chi_squared.total_cmp(&b.chi_squared));
        let Some(best) = best.filter(|best| best.chi_squared < fit.chi_squared - WORTHWHILE) else {
            return fit;
        };
        fit = problem.fit(&fit.hypothesis, best.at, Some(&fit));
    }
    fit
}

/// Which quantities are the parameters of the last effect, and the values to restart them from.
fn restarts(fit: &Fit) -> Option<(Vec<usize>, Vec<Vec<f64>>)> {
    let last = fit.hypothesis.hypothesised.len().checked_sub(1)?;
    let effect = fit.hypothesis.hypothesised[last].effect;
    let quantity_of = |wanted: usize| {
        let mut free = fit.hypothesis.free.iter();
        free.position(
            |free| matches!(free.what, What::Effect { place, parameter } if place == last && parameter == wanted),
        )
    };
    let quantities: Vec<usize> = (0..effect.parameters.len()).map(quantity_of).collect::<Option<_>>()?;
    let values: Vec<f64> = quantities.iter().map(|&quantity| fit.at[quantity]).collect();
    Some((quantities, effect.restarts(&values)))
}
