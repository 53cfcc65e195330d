//! The search for a law: over which quantity, of what form, and whether it predicts what it was not fitted to.

use super::super::discrepancy::Discrepancy;
use super::super::fit::Fit;
use super::super::judge::evidence::evidence;
use super::super::judge::ln_sum::{ln_mean, ln_sum};
use super::super::plant::Plant;
use super::evidence::Scores;
use super::fit::{LawSearch, Start, fit_shape};
use super::fitted_law::FittedLaw;
use super::formula::{Formula, nearest};
use super::kernel::{Prior, priors};
use super::offer::Offer;
use super::shape::LawShape;
use rayon::prelude::*;
use std::sync::Arc;

/// Laws that are fitted to the end: those of most evidence. That is to first order, and a strong law is not linear: the right one of worms
/// that lacked a strong effect was up to the sixth.
const FITTED: usize = 6;
/// Those of them that are fitted anew about what was found, the best; and how often.
const ANEW: usize = 3;
const PASSES: usize = 2;
/// Logarithm of the Bayes factor from which a law is fitted at all, and below the best of all up to which.
const WORTH: f64 = 2.0;
const NEAR: f64 = 60.0;
/// Fall of the score on data held out from which there is a law.
const CLAIMS: f64 = 12.0;
/// Fall of that score by which the best law must exceed another for the other not to be named beside it, or a pair of effects for a law not to
/// come into question.
const RIVAL: f64 = 4.0;

/// The law that explains most, and what is nearly as good.
pub(in crate::explain) struct FoundLaw {
    pub law: FittedLaw,
    /// Others that predict about as well.
    pub rivals: Vec<Arc<LawShape>>,
    /// The nearest formula of few terms, where it predicts as well.
    pub formula: Option<Formula>,
}

/// An offer with what the data say of it, and its most probable form.
struct Weighed {
    offer: Offer,
    scores: Scores,
    prior: Prior,
    /// Logarithm of its Bayes factor, to first order, and of the part of it that its most probable form has.
    ln_bayes: f64,
    ln_form: f64,
}

/// Laws that were fitted, each over another quantity.
pub(in crate::explain) struct FittedLaws {
    each: Vec<(FittedLaw, Weighed)>,
    /// How many were offered.
    offered: usize,
    /// Whether the best were fitted anew about what was found.
    is_anew: bool,
}

/// Fall of the score on data held out by what the library says; 0 where nothing of it holds.
#[derive(Debug, Clone, Copy)]
pub(in crate::explain) enum OfLibrary {
    /// One effect at most. A law bends to whatever an effect leaves, so it must predict better.
    Single(f64),
    /// Two effects, which bend to as much as a law over one quantity does: such a law need only predict about as well.
    Pair(f64),
}

impl FittedLaws {
    /// Logarithm of the probability of the data under some law, whichever, of those that predict data held out well enough beside the library
    /// for there to be a law; none without such a law.
    pub fn ln_evidence(&self, discrepancy: &Discrepancy, of_library: OfLibrary) -> Option<f64> {
        let least = |shape: &LawShape| match of_library {
            OfLibrary::Pair(gain) if shape.axes.len() == 1 => gain - RIVAL,
            OfLibrary::Single(gain) | OfLibrary::Pair(gain) => gain + CLAIMS,
        };
        let better = self.each.iter().filter(|(law, _)| law.gain > least(&law.shape));
        let of_each = better.map(|(law, of)| evidence(discrepancy, None, &law.fit, &|_| None).usual + of.ln_form);
        let all: Vec<f64> = of_each.collect();
        (!all.is_empty()).then(|| ln_sum(all) - (self.offered as f64).ln())
    }
}

/// The most probable of some laws and another, each in its best form, most probable first.
fn with_another(mut weighed: Vec<(Weighed, Fit)>, another: (Weighed, Fit)) -> Vec<(Weighed, Fit)> {
    weighed.push(another);
    weighed.sort_by(|(a, _), (b, _)| b.ln_bayes.total_cmp(&a.ln_bayes));
    let best = weighed.first().map_or(0.0, |(best, _)| best.ln_bayes);
    let mut kept: Vec<(Weighed, Fit)> = Vec::new();
    for one in weighed {
        let (shape, ln_bayes) = (&one.0.offer.shape, one.0.ln_bayes);
        let is_near = ln_bayes > WORTH && ln_bayes > best - NEAR.max(0.5 * best);
        let is_known = kept.iter().any(|(other, _)| other.offer.shape.is_over_the_same(shape));
        if is_near && !is_known && kept.len() < FITTED {
            kept.push(one);
        }
    }
    kept
}

impl<P: Plant> LawSearch<'_, '_, P> {
    /// Fits the laws of most evidence, of all that the plant offers.
    pub fn fit(&self, report: &mut dyn FnMut(f64)) -> FittedLaws {
        let offers = self.problem.plant.laws(self.recalibrated);
        let offered = offers.len();
        let mut weighed: Vec<(Weighed, Fit)> = Vec::new();
        for (done, offer) in offers.into_iter().enumerate() {
            report(0.6 * done as f64 / offered as f64);
            let (about, beyond) = self.start(&offer);
            if let Some(one) = self.weigh(&about, &offer, &beyond) {
                weighed = with_another(weighed, (one, about));
            }
        }
        report(0.6);
        let fitted = weighed.into_par_iter().filter_map(|(one, about)| {
            let law = self.fit_to_the_end(&about, &one)?;
            Some((law, one))
        });
        FittedLaws {
            each: fitted.collect(),
            offered,
            is_anew: false,
        }
    }

    /// Fits those that predict best anew, unless they were; best first.
    pub fn fit_best_anew(&self, laws: &mut FittedLaws) {
        if std::mem::replace(&mut laws.is_anew, true) {
            return;
        }
        let each = &mut laws.each;
        each.sort_by(|a, b| b.0.gain.total_cmp(&a.0.gain));
        each.par_iter_mut()
            .take(ANEW)
            .for_each(|(law, of)| self.fit_anew(law, of));
        each.sort_by(|a, b| b.0.gain.total_cmp(&a.0.gain));
    }

    /// The law that closes the gap of a recalibrated plant; none where nothing predicts better than no law.
    pub fn best(&self, mut laws: FittedLaws, report: &mut dyn FnMut(f64)) -> Option<FoundLaw> {
        self.fit_best_anew(&mut laws);
        let fitted = laws.each;
        let best = fitted.first().map(|(law, _)| law.gain).filter(|gain| *gain >= CLAIMS)?;
        let near = fitted.into_iter().filter(|(law, _)| law.gain > best - RIVAL);
        let mut fitted: Vec<(FittedLaw, Weighed)> = near
            .map(|(law, of)| (self.problem.plant.with_whole_law(law), of))
            .collect();
        report(0.8);
        let formulas = fitted
            .iter()
            .map(|(law, of)| nearest(self, law, (&of.offer, &of.scores)).filter(|formula| formula.gain > best - RIVAL));
        let mut formulas: Vec<Option<Formula>> = formulas.collect();
        // Of those that predict as well the one that is said in the fewest words; without any words, the best.
        let words = |place: &usize| formulas[*place].as_ref().map_or(usize::MAX, |formula| formula.terms);
        let simplest = (0..fitted.len()).min_by_key(words)?;
        let formula = formulas.swap_remove(simplest);
        let (law, _) = fitted.remove(simplest);
        Some(FoundLaw {
            law,
            rivals: fitted.iter().map(|(other, _)| Arc::clone(&other.shape)).collect(),
            formula,
        })
    }

    /// The fit about which an offer is weighed, with derivatives, and the values of the law in it beyond neutral: those of its guess, where
    /// they are nearer to the data than none.
    fn start(&self, offer: &Offer) -> (Fit, Vec<f64>) {
        if let Some(guess) = &offer.guess {
            let mut hypothesis = self.recalibrated.hypothesis.clone();
            hypothesis.law = Some(Arc::new(offer.shape.clone().about(guess)));
            let mut fit = self
                .problem
                .fit_from(&hypothesis, self.recalibrated.at.clone(), Some(self.recalibrated));
            if fit.chi_squared < self.recalibrated.chi_squared {
                self.problem.compute_jacobian(&mut fit);
                return (fit, guess.clone());
            }
        }
        (self.recalibrated.clone(), vec![0.0; offer.shape.centre.len()])
    }

    /// What the data say of an offer, to first order about a fit at some values of the law beyond neutral.
    fn weigh(&self, about: &Fit, offer: &Offer, beyond: &[f64]) -> Option<Weighed> {
        let scores = Scores::about(self.problem, self.discrepancy, about, offer, beyond)?;
        let kinds = priors(offer).map(|priors| {
            let each: Vec<f64> = priors.iter().map(|prior| scores.ln_bayes(&prior.on_grid)).collect();
            let best = (0..each.len()).max_by(|&a, &b| each[a].total_cmp(&each[b]))?;
            let mean = ln_mean(&each)?;
            Some((priors.into_iter().nth(best)?, mean, (mean - each[best]).min(0.0)))
        });
        let (prior, ln_bayes, ln_form) = kinds.into_iter().flatten().max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(Weighed {
            offer: offer.clone(),
            scores,
            prior,
            ln_bayes,
            ln_form,
        })
    }

    /// Fits a law to the end from a fit of what is free besides, and holds data out; none where the data determine nothing of it, for
    /// such a law could only gain by what is free besides.
    fn fit_to_the_end(&self, from: &Fit, weighed: &Weighed) -> Option<FittedLaw> {
        let determined = weighed.scores.determined(&weighed.prior);
        if determined.columns.is_empty() {
            return None;
        }
        let mut shape = weighed.offer.shape.clone();
        if let Some((period, within)) = &weighed.prior.period {
            shape.period = Some(*period);
            shape.axes[0].1.clone_from(within);
            shape.centre = vec![shape.acts_on.neutral(); within.len()];
        }
        shape.columns.clone_from(&determined.columns);
        let known = weighed.scores.by_columns(&determined.on_grid);
        let law = fit_shape(
            self,
            Start {
                from,
                shape,
                at: determined.at,
                known,
                on_grid: determined.on_grid,
                left: determined.left,
                seen: weighed.offer.seen.clone(),
            },
        );
        Some(law)
    }

    /// Fits a law anew about what was found, as long as it predicts better then: far from no law other directions are determined, and
    /// the plant goes where it did not without the law.
    fn fit_anew(&self, law: &mut FittedLaw, weighed: &mut Weighed) {
        for _ in 0..PASSES {
            let offer = self.where_it_goes(law, &weighed.offer);
            let beyond = weighed.offer.shape.onto(&law.beyond, &offer.shape);
            let about = law.besides(self.problem, offer.shape.clone().about(&beyond));
            let Some(anew) = self.weigh(&about, &offer, &beyond) else {
                return;
            };
            let Some(better) = self
                .fit_to_the_end(&about, &anew)
                .filter(|better| better.gain > law.gain)
            else {
                return;
            };
            (*law, *weighed) = (better, anew);
        }
    }

    /// An offer over where the plant goes with a law; the same where it does not move with it.
    fn where_it_goes(&self, law: &FittedLaw, offer: &Offer) -> Offer {
        let offers = self.problem.plant.laws(&law.fit).into_iter();
        let mut the_same = offers
            .filter(|other| offer.shape.is_over_the_same(&other.shape) && offer.shape.memory_s == other.shape.memory_s);
        the_same.next().unwrap_or_else(|| offer.clone())
    }
}
