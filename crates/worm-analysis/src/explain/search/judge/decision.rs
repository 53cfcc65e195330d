//! The posterior, and the verdict: agrees, explained, ambiguous, or outside the library.
//!
//! # The rules, in their order
//! 1. Every hypothesis gets its posterior probability: none, each effect, each pair, conditions that are stated wrongly, and something else, which is a large discrepancy
//!    alone or beside an effect or a pair, or looks exactly like one. Effects that were not fitted to the end count by their screening.
//!    What the best effects have in common (the same effect of another cell, exact twins) is one class.
//! 2. An effect that changes neither outcome nor energy nor positions by what matters counts as none; where no other comes into
//!    question, by as much as that is probable. Beside one that does it is a trace: it stays in the fit, without a name, and the other is
//!    judged as a single effect. No contact is quite as the model says, and a small effect that is certain hides a large one that only
//!    differs from recalibration by little.
//! 3. An effect must also be more probable than the best of the library becomes by chance in one of a hundred machines without one, and
//!    improve the prediction of data that it was not fitted to, and close four fifths of the gap there.
//!    Something else beside an effect must be more than the effect's own law may be wrong by, for no law is known exactly.
//! 4. A pair needs odds of twenty against the best single effect, and its second effect must pass 2 and 3 by itself, and improve
//!    the fit by more than the first one's law may be wrong by.
//! 5. What comes and goes within a run counts as something else unless it has nine tenths by itself: it fits a little of much.
//! 6. With nine tenths on one class the data are **explained**; where it takes several, or one is more probable than something else and
//!    nothing has a tenth at most, **ambiguous**. Otherwise model and data **agree**, or the cause is **outside the library**, whichever
//!    is more probable.

use super::candidate::{Candidate, are_alike};
use super::evidence::Evidence;
use super::ln_sum::ln_sum;
use super::prior;
use super::structural_change::Change;
use crate::explain::answer::{MISSTATED, Verdict};

/// Probability from which an effect beside which there are others counts as one that changes what matters.
pub(in crate::explain) const MATTERS: f64 = 0.95;
/// Probability that an answer must reach, and several together.
const SURE: f64 = 0.9;
/// Probability below which a class is no rival.
const RIVAL: f64 = 0.02;
/// Odds of a pair against the best single effect.
const SECOND: f64 = 20.0;
/// How well the law of an effect is known, as a fraction of the positions that it moves: what is left beside it may be that without
/// anything else being wrong, and a second effect must do more, for that has a law which may fit what is left by chance.
pub(in crate::explain) const LAW_KNOWN: f64 = 0.1;
const FIRST_LAW_KNOWN: f64 = 0.15;
/// Largest part of the sum that may be left out.
const NOTHING: f64 = 1e-300;

/// A hypothesis with effects, as the decision sees it.
pub(in crate::explain) struct Judged {
    pub candidate: Candidate,
    /// Logarithm of its prior probability, and of its share among the effects beside which something else may be wrong.
    pub ln_prior: f64,
    pub ln_share: f64,
    /// Probability that every effect that it names changes what matters.
    pub matters: f64,
    /// Log odds by which chance was exceeded: those of the effect that was added last.
    pub beyond_chance: f64,
    /// Whether it improves the prediction of data that it was not fitted to, and closes the gap there; true where that was not asked.
    pub holds: bool,
}

impl Judged {
    fn evidence(&self) -> Evidence {
        self.candidate.evidence.unwrap_or(Evidence {
            usual: f64::NEG_INFINITY,
            large: f64::NEG_INFINITY,
            of_usual: [f64::NEG_INFINITY; 4],
            changing: None,
            repeating: None,
            irregular: None,
            of_law: None,
        })
    }

    fn ln_weight(&self) -> f64 {
        self.ln_prior + self.evidence().usual
    }

    /// Evidence for something else beside it: no law is known exactly, so what is left of a strong effect must be more than that.
    fn ln_other(&self) -> f64 {
        self.evidence().other() - 0.5 * LAW_KNOWN * LAW_KNOWN * self.candidate.improvement.max(0.0)
    }

    /// Probability that it does not count as none: chance does less, and something that matters changes. It must be sure to, unless no
    /// other effect comes into question: of two doubts, which it is and whether it matters, an answer may leave one.
    fn counts(&self, is_alone: bool) -> f64 {
        if self.beyond_chance <= 0.0 || !is_alone && self.matters < MATTERS {
            0.0
        } else {
            self.matters
        }
    }

    /// Whether it may be named where it counts: it also holds on other data, is no trace, and its shape is within its range.
    fn may_be_named(&self, is_alone: bool) -> bool {
        self.counts(is_alone) > 0.0 && self.holds && self.candidate.is_notable()
    }
}

/// The verdict, and what it rests on.
pub(in crate::explain) struct Selected {
    pub verdict: Verdict,
    /// What explains the data, most probable first, without twins and other cells of the same effect. Holds the best candidate even
    /// where nothing is named.
    pub candidates: Vec<Candidate>,
    /// Probability of each candidate's class.
    pub probability: Vec<f64>,
    /// Whether the best of the library comes as near as the first candidate by chance, where there is no effect.
    pub is_within_chance: bool,
    /// Posterior probability that nothing which matters is missing, and that something else is: of what the search can tell apart.
    pub(super) null_probability: f64,
    pub(super) other_probability: f64,
    /// Posterior probability that nothing is missing, and that the conditions of the recordings are stated wrongly.
    pub misstated_probability: f64,
    /// What changes in mid-run, where that is the most probable part of something else.
    pub change: Option<Change>,
    /// Whether something irregular that moves the machine is that part.
    pub is_irregular: bool,
    /// The best effect of another kind than what is named; where nothing is, the nearest.
    pub best_wrong: Option<Candidate>,
}

impl Selected {
    /// Whether it is more probable than everything else together that the conditions of the recordings are stated wrongly.
    pub fn is_misstated(&self) -> bool {
        self.misstated_probability > MISSTATED
    }
}

/// A class: hypotheses that are alike up to twins and cells.
struct Class {
    best: usize,
    ln_weight: f64,
}

/// Reaches the verdict. `none` is the evidence without effects, `unfitted` the logarithm of the weights of effects that were only
/// screened, `misstated` those of conditions that are stated wrongly.
pub(in crate::explain) fn decide(none: Evidence, judged: &[Judged], unfitted: &[f64], misstated: &[f64]) -> Selected {
    let singles = judged.iter().filter(|one| !one.candidate.is_pair());
    let best_single = singles.max_by(|a, b| a.ln_weight().total_cmp(&b.ln_weight()));
    // An effect whose law is a little wrong is no reason for another law.
    let strongest = judged.iter().map(|one| one.candidate.improvement).fold(0.0, f64::max);
    let none = none.with_law(none.of_law.map(|ln| ln - 0.5 * LAW_KNOWN * LAW_KNOWN * strongest));
    let (ln_single, gain) = best_single.map_or((f64::NEG_INFINITY, 0.0), |best| {
        (best.ln_weight(), best.candidate.improvement)
    });
    // The law of the first effect is no better known than to a fraction of what it does.
    let is_beyond_first = |pair: &Judged| pair.candidate.improvement - gain > FIRST_LAW_KNOWN * FIRST_LAW_KNOWN * gain;
    let needs_both = |one: &Judged| {
        !one.candidate.is_pair()
            || (one.ln_weight() - ln_single > SECOND.ln() && one.may_be_named(false) && is_beyond_first(one))
    };
    let mut order: Vec<usize> = (0..judged.len()).filter(|&at| needs_both(&judged[at])).collect();
    order.sort_by(|&a, &b| judged[b].ln_weight().total_cmp(&judged[a].ln_weight()));
    // A pair that earns no place by itself earns none with something else beside it, either.
    let standing: Vec<&Judged> = order.iter().map(|&at| &judged[at]).collect();
    let mut classes: Vec<Class> = Vec::new();
    for at in order {
        let one = &judged[at];
        let alike = classes
            .iter_mut()
            .find(|class| are_alike(&judged[class.best].candidate, &one.candidate));
        match alike {
            Some(class) => class.ln_weight = ln_sum([class.ln_weight, one.ln_weight()]),
            None => classes.push(Class {
                best: at,
                ln_weight: one.ln_weight(),
            }),
        }
    }
    classes.sort_by(|a, b| b.ln_weight.total_cmp(&a.ln_weight));
    // The one that comes into question, where there is one.
    let of_all = ln_sum(classes.iter().map(|class| class.ln_weight));
    let alone = classes.first().filter(|first| first.ln_weight - of_all > SURE.ln());
    let alone = alone
        .map(|first| &judged[first.best])
        .filter(|one| !one.candidate.is_pair());
    let is_alone = |one: &Judged| alone.is_some_and(|alone| are_alike(&alone.candidate, &one.candidate));
    let counts = |one: &Judged| one.counts(is_alone(one));
    let may_be_named = |one: &Judged| one.may_be_named(is_alone(one));
    let half = 0.5 * prior::OTHER;
    let beside = standing.iter().map(|one| {
        let imitated = if may_be_named(one) {
            one.evidence().usual + (prior::IMITATED * counts(one)).ln()
        } else {
            f64::NEG_INFINITY
        };
        half.ln() + one.ln_share + ln_sum([one.ln_other(), imitated])
    });
    let other: Vec<f64> = beside.chain([half.ln() + none.other()]).collect();
    let ln_none = prior::NONE.ln() + none.usual;
    let ln_other = ln_sum(other.iter().copied());
    let all: Vec<f64> = classes
        .iter()
        .map(|class| class.ln_weight)
        .chain(unfitted.iter().copied())
        .chain(misstated.iter().copied())
        .chain([ln_none, ln_other])
        .collect();
    let whole = ln_sum(all.iter().copied());
    let probability = |ln_weight: f64| (ln_weight - whole).exp().max(NOTHING);
    let that_counts = |class: &Class| counts(&judged[class.best]) * probability(class.ln_weight);
    let nothing = probability(ln_none) + unfitted.iter().map(|&ln_weight| probability(ln_weight)).sum::<f64>();
    let unimportant: f64 = classes
        .iter()
        .map(|class| probability(class.ln_weight) - that_counts(class))
        .sum();
    let null_probability = nothing + unimportant;
    let is_sure = |class: &Class| !judged[class.best].candidate.comes_and_goes() || that_counts(class) >= SURE;
    // Something is there, and looks like an effect that it cannot be.
    let (named, unnamed): (Vec<&Class>, Vec<&Class>) = classes
        .iter()
        .partition(|class| may_be_named(&judged[class.best]) && is_sure(class));
    let other_probability = probability(ln_other) + unnamed.into_iter().map(that_counts).sum::<f64>();
    let misstated_probability = probability(ln_sum(misstated.iter().copied()));
    let mut count = 0;
    let mut sum = 0.0;
    while sum < SURE && count < named.len() && that_counts(named[count]) > RIVAL {
        sum += that_counts(named[count]);
        count += 1;
    }
    // No name is right where the conditions are wrong, either.
    let wrong = other_probability + misstated_probability;
    let verdict = match count {
        1 if sum >= SURE => Verdict::Explained,
        2.. if sum >= SURE => Verdict::Ambiguous,
        // Something is there, and more probably this than what the library does not know, or what does not matter.
        1 if nothing <= 1.0 - SURE && sum > wrong.max(unimportant) => Verdict::Ambiguous,
        2.. if null_probability <= 1.0 - SURE && sum > wrong => Verdict::Ambiguous,
        _ if wrong > null_probability => Verdict::OutsideLibrary,
        _ => Verdict::Agrees,
    };
    let is_named = matches!(verdict, Verdict::Explained | Verdict::Ambiguous);
    let chosen: Vec<usize> = if is_named {
        named[..count].iter().map(|class| class.best).collect()
    } else {
        classes.iter().take(1).map(|class| class.best).collect()
    };
    let of_class = |best: &usize| {
        let class = classes.iter().find(|class| class.best == *best);
        class.map_or(0.0, |class| match is_named {
            true => that_counts(class),
            false => probability(class.ln_weight),
        })
    };
    let probability = chosen.iter().map(of_class).collect();
    let (change, is_irregular) = what_else(none, &standing);
    let best_wrong = classes
        .iter()
        .find(|class| !is_named || !chosen.contains(&class.best))
        .map(|class| judged[class.best].candidate.clone());
    Selected {
        verdict,
        candidates: chosen.iter().map(|&at| judged[at].candidate.clone()).collect(),
        probability,
        is_within_chance: chosen.first().is_some_and(|&at| judged[at].beyond_chance <= 0.0),
        null_probability,
        other_probability,
        misstated_probability,
        change,
        is_irregular,
        best_wrong,
    }
}

/// What makes something else most probable, by the hypothesis beside which it is: a change in mid-run, or something irregular.
fn what_else(none: Evidence, standing: &[&Judged]) -> (Option<Change>, bool) {
    let all = standing
        .iter()
        .map(|one| (one.ln_share + one.ln_other(), one.evidence()));
    let best = all.chain([(none.other(), none)]).max_by(|a, b| a.0.total_cmp(&b.0));
    let evidence = best.map_or(none, |(_, evidence)| evidence);
    let [repeating, irregular] = [evidence.repeating, evidence.irregular].map(|ln| ln.unwrap_or(f64::NEG_INFINITY));
    let others = evidence.large.max(repeating);
    let change = evidence.changing.filter(|(ln, _)| *ln > others.max(irregular));
    let ln_change = evidence.changing.map_or(f64::NEG_INFINITY, |(ln, _)| ln);
    (
        change.map(|(_, change)| change),
        irregular > others.max(ln_change).max(evidence.usual),
    )
}

#[cfg(test)]
mod tests;
