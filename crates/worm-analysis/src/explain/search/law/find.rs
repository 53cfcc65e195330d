//! The search for a law: over which quantity, of what form, and whether it predicts what it was not fitted to.

use super::super::cross_validation::HeldOut;
use super::super::discrepancy::Discrepancy;
use super::super::fit::Fit;
use super::super::folds::Folds;
use super::super::judge::ln_sum::ln_mean;
use super::super::plant::Plant;
use super::super::problem::FitProblem;
use super::evidence::Scores;
use super::fitted_law::{FittedLaw, Start, fit_shape};
use super::formula::{Formula, nearest};
use super::kernel::{Prior, priors};
use super::offer::Offer;
use super::shape::LawShape;
use std::sync::Arc;

/// Laws that are fitted to the end: those of most evidence.
const FITTED: usize = 5;
/// Those of them that are fitted anew about what was found, the best; and how often.
const ANEW: usize = 2;
const PASSES: usize = 2;
/// Logarithm of the Bayes factor from which a law is fitted at all, and below the best of all up to which.
const WORTH: f64 = 2.0;
const NEAR: f64 = 60.0;
/// Fall of the score on data held out from which there is a law.
const CLAIMS: f64 = 12.0;
/// Fall of that score by which the best law must exceed another for the other not to be named beside it.
const RIVAL: f64 = 4.0;

/// The law that explains most, and what is nearly as good.
pub(in crate::explain) struct FoundLaw {
    pub law: FittedLaw,
    /// Others that predict about as well.
    pub rivals: Vec<Arc<LawShape>>,
    /// The nearest formula of few terms, where it predicts as well.
    pub formula: Option<Formula>,
}

/// Candidates: an offer with what the data say of it, its most probable form, and the logarithm of its Bayes factor.
struct Weighed<'o> {
    offer: &'o Offer,
    scores: Scores,
    prior: Prior,
    ln_bayes: f64,
}

/// Searches for a law that closes the gap of a recalibrated plant; none where nothing predicts better than no law.
pub(in crate::explain) fn find<P: Plant>(
    problem: &FitProblem<'_, P>,
    discrepancy: &Discrepancy,
    recalibrated: &Fit,
    without: &HeldOut,
    report: &mut dyn FnMut(f64),
) -> Option<FoundLaw> {
    let offers = problem.plant.laws(recalibrated);
    let count = offers.len() as f64;
    let mut weighed: Vec<Weighed<'_>> = Vec::new();
    for (done, offer) in offers.iter().enumerate() {
        report(0.5 * done as f64 / count);
        let neutral = vec![0.0; offer.shape.centre.len()];
        weighed.extend(weigh(problem, discrepancy, recalibrated, offer, &neutral));
    }
    weighed.sort_by(|a, b| b.ln_bayes.total_cmp(&a.ln_bayes));
    let best = weighed.first()?.ln_bayes;
    weighed.retain(|one| one.ln_bayes > WORTH && one.ln_bayes > best - NEAR.max(0.5 * best));
    weighed.truncate(FITTED);
    let folds = problem.plant.folds();
    let search = Search {
        problem,
        discrepancy,
        recalibrated,
        without,
        folds: &folds,
    };
    let mut fitted: Vec<(FittedLaw, Weighed<'_>)> = Vec::new();
    let tried = weighed.len() as f64;
    for (done, one) in weighed.into_iter().enumerate() {
        report(0.5 + 0.3 * done as f64 / tried);
        fitted.push((search.fit(recalibrated, &one), one));
    }
    fitted.sort_by(|a, b| b.0.gain.total_cmp(&a.0.gain));
    for (done, (law, of)) in fitted.iter_mut().take(ANEW).enumerate() {
        report(0.8 + 0.15 * done as f64 / ANEW as f64);
        search.fit_anew(law, of);
    }
    fitted.sort_by(|a, b| b.0.gain.total_cmp(&a.0.gain));
    let (law, of) = fitted.first()?;
    if law.gain < CLAIMS {
        return None;
    }
    let law = law.clone();
    let near = fitted[1..].iter().filter(|(other, _)| other.gain > law.gain - RIVAL);
    let rivals = near.map(|(other, _)| Arc::clone(&other.shape)).collect();
    report(0.95);
    let formula = nearest(problem, recalibrated, without, &folds, &law, (of.offer, &of.scores));
    Some(FoundLaw { law, rivals, formula })
}

/// What the data say of an offer, to first order about a fit at some values of the law beyond neutral.
fn weigh<'o, P: Plant>(
    problem: &FitProblem<'_, P>,
    discrepancy: &Discrepancy,
    about: &Fit,
    offer: &'o Offer,
    beyond: &[f64],
) -> Option<Weighed<'o>> {
    let scores = Scores::about(problem, discrepancy, about, offer, beyond)?;
    let kinds = priors(offer).map(|priors| {
        let each: Vec<f64> = priors.iter().map(|prior| scores.ln_bayes(&prior.on_grid)).collect();
        let best = (0..each.len()).max_by(|&a, &b| each[a].total_cmp(&each[b]));
        Some((priors.into_iter().nth(best?)?, ln_mean(&each)?))
    });
    let (prior, ln_bayes) = kinds.into_iter().flatten().max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(Weighed {
        offer,
        scores,
        prior,
        ln_bayes,
    })
}

/// What every law is fitted with and held against.
struct Search<'s, 'p, P> {
    problem: &'s FitProblem<'p, P>,
    discrepancy: &'s Discrepancy,
    recalibrated: &'s Fit,
    without: &'s HeldOut,
    folds: &'s Folds,
}

impl<P: Plant> Search<'_, '_, P> {
    /// Fits a law to the end from a fit of what is free besides, and holds data out.
    fn fit(&self, from: &Fit, weighed: &Weighed<'_>) -> FittedLaw {
        let determined = weighed.scores.determined(&weighed.prior);
        let mut shape = weighed.offer.shape.clone();
        if let Some((period, within)) = &weighed.prior.period {
            shape.period = Some(*period);
            shape.axes[0].1.clone_from(within);
            shape.centre = vec![shape.acts_on.neutral(); within.len()];
        }
        shape.columns.clone_from(&determined.columns);
        let known = weighed.scores.by_columns(&determined.on_grid);
        fit_shape(
            self.problem,
            self.recalibrated,
            self.without,
            self.folds,
            Start {
                from,
                shape,
                at: determined.at,
                known,
                on_grid: determined.on_grid,
                left: determined.left,
                seen: weighed.offer.seen.clone(),
            },
        )
    }

    /// Fits a law anew about what was found, as long as it predicts better then: far from no law other directions are determined.
    fn fit_anew<'o>(&self, law: &mut FittedLaw, weighed: &mut Weighed<'o>) {
        let offer: &'o Offer = weighed.offer;
        for _ in 0..PASSES {
            let about = law.besides(self.problem, offer.shape.clone().about(&law.beyond));
            let Some(anew) = weigh(self.problem, self.discrepancy, &about, offer, &law.beyond) else {
                return;
            };
            let better = self.fit(&about, &anew);
            if better.gain <= law.gain {
                return;
            }
            (*law, *weighed) = (better, anew);
        }
    }
}
