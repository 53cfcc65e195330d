//! Effects that have nuisances of the same law beside them.
//!
//! Every contact has a little of some effects, so the fits leave that to nuisances. Where the effect is named, it is all there is of
//! its law that a reader asks for.

use super::nuisance::Nuisance;
use crate::explain::search::fit::Fit;
use crate::explain::search::parameter::What;

/// A fit with what nuisances have of an effect's law moved into the effect; it predicts the same.
pub(in crate::explain) fn with_whole_effects(mut fit: Fit) -> Fit {
    let free = fit.hypothesis.free.clone();
    for (of_effect, one) in free.iter().enumerate() {
        let What::Effect { place, parameter: 0 } = one.what else {
            continue;
        };
        let hypothesised = fit.hypothesis.hypothesised[place];
        // A nuisance acts throughout.
        if hypothesised.onset.is_some() {
            continue;
        }
        for (of_nuisance, other) in free.iter().enumerate() {
            let Some(nuisance) = Nuisance::of(other.what) else {
                continue;
            };
            let (severity, value) = (fit.at[of_effect], fit.at[of_nuisance]);
            if let Some(whole) = nuisance.added_to(hypothesised.effect, severity, value) {
                fit.at[of_effect] = whole.clamp(one.quantity.min, one.quantity.max);
                fit.at[of_nuisance] = other.quantity.centre;
            }
        }
    }
    fit
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explain::fixture::{Campaign, hypothesis, record, worm};
    use crate::explain::search::hypothesis::Hypothesis;
    use crate::explain::search::parameter::Hypothesised;
    use crate::explain::search::problem::FitProblem;

    #[test]
    fn what_a_nuisance_has_of_an_effects_law_goes_to_the_effect() {
        let campaign = Campaign::default();
        let recordings = record(&campaign, None, 1);
        let worm = worm(&recordings, &campaign, &hypothesis(None));
        let problem = FitProblem::with_noise_alone(&worm);
        let effects = ["viscous-drag", "breakaway-friction"]
            .map(|name| Hypothesised::throughout(worm_physics::effect::named(name).expect("an effect"), None));
        let both = Hypothesis::new(&Nuisance::all(4, 2, true), &effects);
        let mut at = both.neutral();
        let place = |what: What| both.free.iter().position(|free| free.what == what).expect("it is free");
        let severity = |place: usize| What::Effect { place, parameter: 0 };
        for (what, value) in [
            (Nuisance::Viscosity.what(), 0.5),
            (Nuisance::Breakaway.what(), 0.1),
            (severity(0), 2.0),
            (severity(1), 1.2),
        ] {
            at[place(what)] = value;
        }
        let fit = problem.evaluate(&both, at);
        let whole = with_whole_effects(fit.clone());
        let found = [severity(0), severity(1)].map(|what| whole.at[place(what)]);
        assert!(
            (found[0] - 2.5).abs() < 1e-12 && (found[1] - 1.32).abs() < 1e-12,
            "{found:?}"
        );
        let anew = problem.residuals(&whole.hypothesis, &whole.at);
        let apart = anew
            .iter()
            .zip(&fit.residual)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        assert!(apart < 1e-9, "{apart} standard deviations");
    }
}
