//! The posterior, and the verdict: agrees, explained, ambiguous, or outside the library.
//!
//! # The rules, in their order
//! 1. Every hypothesis gets its posterior probability: none, each effect, each pair, and something else, which is a large discrepancy
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
//! 5. With nine tenths on one class the data are **explained**; where it takes several, or one is more probable than something else and
//!    nothing has a tenth at most, **ambiguous**. Otherwise model and data **agree**, or the cause is **outside the library**, whichever
//!    is more probable.

use super::candidate::{Candidate, are_alike};
use super::evidence::Evidence;
use super::ln_sum::ln_sum;
use super::prior;
use super::structural_change::Change;
use crate::explain::answer::Verdict;

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
const LAW_KNOWN: f64 = 0.1;
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

    fn is_pair(&self) -> bool {
        self.candidate.named().count() > 1
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
    /// What changes in mid-run, where that is the most probable part of something else.
    pub change: Option<Change>,
    /// The best effect of another kind that is no candidate.
    pub best_wrong: Option<Candidate>,
    /// Every effect and pair that was fitted.
    pub all: Vec<Candidate>,
}

/// A class: hypotheses that are alike up to twins and cells.
struct Class {
    best: usize,
    ln_weight: f64,
}

/// Reaches the verdict. `none` is the evidence without effects, `unfitted` the logarithm of the weights of effects that were only
/// screened.
pub(in crate::explain) fn decide(none: Evidence, judged: Vec<Judged>, unfitted: &[f64]) -> Selected {
    let singles = judged.iter().filter(|one| !one.is_pair());
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
        !one.is_pair() || (one.ln_weight() - ln_single > SECOND.ln() && one.may_be_named(false) && is_beyond_first(one))
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
    let alone = alone.map(|first| &judged[first.best]).filter(|one| !one.is_pair());
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
    // Something is there, and looks like an effect that it cannot be.
    let (named, unnamed): (Vec<&Class>, Vec<&Class>) =
        classes.iter().partition(|class| may_be_named(&judged[class.best]));
    let other_probability = probability(ln_other) + unnamed.into_iter().map(that_counts).sum::<f64>();
    let mut count = 0;
    let mut sum = 0.0;
    while sum < SURE && count < named.len() && that_counts(named[count]) > RIVAL {
        sum += that_counts(named[count]);
        count += 1;
    }
    let verdict = match count {
        1 if sum >= SURE => Verdict::Explained,
        2.. if sum >= SURE => Verdict::Ambiguous,
        // Something is there, and more probably this than what the library does not know, or what does not matter.
        1 if nothing <= 1.0 - SURE && sum > other_probability.max(unimportant) => Verdict::Ambiguous,
        2.. if null_probability <= 1.0 - SURE && sum > other_probability => Verdict::Ambiguous,
        _ if other_probability > null_probability => Verdict::OutsideLibrary,
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
    let best_wrong = classes
        .iter()
        .find(|class| !chosen.contains(&class.best))
        .map(|class| judged[class.best].candidate.clone());
    Selected {
        verdict,
        candidates: chosen.iter().map(|&at| judged[at].candidate.clone()).collect(),
        probability,
        is_within_chance: chosen.first().is_some_and(|&at| judged[at].beyond_chance <= 0.0),
        null_probability,
        other_probability,
        change: change(none, &standing),
        best_wrong,
        all: judged.into_iter().map(|one| one.candidate).collect(),
    }
}

/// The change in mid-run of the hypothesis that makes something else most probable, where it is that change and no large discrepancy.
fn change(none: Evidence, standing: &[&Judged]) -> Option<Change> {
    let all = standing
        .iter()
        .map(|one| (one.ln_share + one.ln_other(), one.evidence()));
    let (_, evidence) = all.chain([(none.other(), none)]).max_by(|a, b| a.0.total_cmp(&b.0))?;
    let (ln_changing, change) = evidence.changing?;
    (ln_changing > evidence.large.max(evidence.repeating.unwrap_or(f64::NEG_INFINITY))).then_some(change)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explain::search::fit::Fit;
    use crate::explain::search::hypothesis::Hypothesis;
    use crate::explain::search::parameter::Hypothesised;
    use crate::explain::words;
    use crate::explain::worm::plant::hypotheses;
    use crate::least_squares::Estimate;
    use worm_physics::effect::named;

    const NONE_AT: f64 = -100.0;

    fn of(usual: f64, large: f64) -> Evidence {
        Evidence {
            usual,
            large,
            of_usual: [usual - 4.0_f64.ln(); 4],
            changing: None,
            repeating: None,
            of_law: None,
        }
    }

    /// Effects of ten notable changes, with a log Bayes factor against none and, of a large discrepancy beside them, another.
    fn judged(names: &[&str], ln_bayes: f64, large: f64) -> Judged {
        let effects: Vec<Hypothesised> = names
            .iter()
            .map(|name| Hypothesised::throughout(named(name).expect("an effect"), None))
            .collect();
        let hypothesis = Hypothesis::new(&[], &effects);
        let strong = |one: &Hypothesised| {
            let severity = one.effect.severity();
            one.effect
                .values_with_neutral_shape(severity.neutral + 10.0 * severity.notable)
        };
        let estimate = Estimate {
            at: effects.iter().flat_map(strong).collect(),
            residual: Vec::new(),
            jacobian: Vec::new(),
            chi_squared: 0.0,
            converged: true,
        };
        let campaign = prior::Campaign {
            channels: 4,
            runs: 1,
            cycles: 10.0,
            families: prior::families(&hypotheses(4, true)),
        };
        let ln_prior = campaign.ln_prior(&effects);
        Judged {
            ln_prior,
            ln_share: ln_prior - prior::SINGLE.ln(),
            matters: 1.0,
            beyond_chance: 10.0,
            holds: true,
            candidate: Candidate {
                hypothesised: effects,
                fit: Fit::new(&hypothesis, estimate),
                improvement: 2.0 * ln_bayes,
                ln_onset: 0.0,
                evidence: Some(of(NONE_AT + ln_bayes, NONE_AT + large)),
                held_out: None,
                trace: None,
            },
        }
    }

    fn verdict(none_large: f64, all: Vec<Judged>) -> Selected {
        decide(of(NONE_AT, NONE_AT + none_large), all, &[])
    }

    #[test]
    fn without_evidence_nothing_is_missing() {
        let selected = verdict(
            -10.0,
            vec![judged(&["pad-creep"], 1.0, -5.0), judged(&["backlash"], 0.0, -5.0)],
        );
        assert_eq!(selected.verdict, Verdict::Agrees);
        let sum = selected.null_probability + selected.other_probability;
        assert!(selected.null_probability > 0.8 && sum < 1.0, "{sum}");
    }

    #[test]
    fn the_one_that_explains_most_is_named() {
        let selected = verdict(
            5.0,
            vec![judged(&["backlash"], 12.0, 0.0), judged(&["pad-creep"], 40.0, 20.0)],
        );
        assert_eq!(selected.verdict, Verdict::Explained);
        assert_eq!(selected.candidates[0].hypothesised[0].effect.name, "pad-creep");
        // Something else may look just like it.
        assert!(
            (0.95..0.98).contains(&selected.probability[0]),
            "{}",
            selected.probability[0]
        );
    }

    /// A small effect that is certain and moves nothing by what matters hides a second one from a fit of that alone.
    #[test]
    fn an_effect_beside_a_trace_is_named_alone() {
        let mut small = judged(&["breakaway-friction"], 90.0, 40.0);
        small.matters = 0.0;
        let agrees = verdict(0.0, vec![small]);
        assert_eq!(agrees.verdict, Verdict::Agrees);
        let mut small = judged(&["breakaway-friction"], 90.0, 40.0);
        small.matters = 0.0;
        let mut beside = judged(&["breakaway-friction", "pad-hardening"], 140.0, 60.0);
        beside.candidate.trace = Some(0);
        let selected = verdict(0.0, vec![small, beside]);
        assert_eq!(selected.verdict, Verdict::Explained);
        let named: Vec<&str> = selected.candidates[0].named().map(|(_, one)| one.effect.name).collect();
        assert_eq!(named, ["pad-hardening"]);
        // With or without a trace beside it, it is the same answer.
        let mut beside = judged(&["pad-hardening", "breakaway-friction"], 140.0, 60.0);
        beside.candidate.trace = Some(1);
        let selected = verdict(0.0, vec![judged(&["pad-hardening"], 139.0, 60.0), beside]);
        assert_eq!((selected.verdict, selected.candidates.len()), (Verdict::Explained, 1));
        assert!(selected.probability[0] > 0.95);
    }

    #[test]
    fn equals_stay_together_and_exact_twins_are_one() {
        let both = || vec![judged(&["backlash"], 40.0, 0.0), judged(&["pad-creep"], 40.5, 0.0)];
        let selected = verdict(0.0, both());
        assert_eq!((selected.verdict, selected.candidates.len()), (Verdict::Ambiguous, 2));
        let twins = vec![
            judged(&["constant-drag"], 40.0, 0.0),
            judged(&["directional-friction"], 40.0, 0.0),
        ];
        let selected = verdict(0.0, twins);
        assert_eq!((selected.verdict, selected.candidates.len()), (Verdict::Explained, 1));
    }

    #[test]
    fn one_that_is_likely_and_not_sure_is_not_named() {
        // Its prior odds against none are 0.35 / 0.5 over some twenty families: 3.4 nats.
        let with = |ln_bayes: f64| verdict(-10.0, vec![judged(&["pad-creep"], ln_bayes, -5.0)]);
        let likely = with(5.2);
        assert!((0.7..0.9).contains(&likely.probability[0]), "{}", likely.probability[0]);
        assert_eq!(likely.verdict, Verdict::Agrees);
        assert_eq!(with(7.2).verdict, Verdict::Explained);
    }

    #[test]
    fn a_large_discrepancy_is_something_else_alone_and_beside_an_effect() {
        let alone = verdict(60.0, vec![judged(&["pad-creep"], 40.0, 20.0)]);
        assert_eq!(alone.verdict, Verdict::OutsideLibrary);
        let beside = verdict(0.0, vec![judged(&["pad-creep"], 40.0, 60.0)]);
        assert_eq!(beside.verdict, Verdict::OutsideLibrary);
        assert!(beside.other_probability > 0.99 && beside.candidates.len() == 1);
        let pair = judged(&["pad-creep", "backlash"], 80.0, 110.0);
        let beside = verdict(0.0, vec![judged(&["pad-creep"], 40.0, 20.0), pair]);
        assert_eq!(
            beside.verdict,
            Verdict::OutsideLibrary,
            "a pair may leave something open, too"
        );
        let either = verdict(0.0, vec![judged(&["pad-creep"], 40.0, 42.0)]);
        assert_eq!((either.verdict, either.candidates.len()), (Verdict::Ambiguous, 1));
        assert!(
            (0.1..0.4).contains(&either.other_probability),
            "{}",
            either.other_probability
        );
        let strong = verdict(0.0, vec![judged(&["pad-creep"], 4000.0, 4020.0)]);
        assert_eq!(strong.verdict, Verdict::Explained, "its law may be wrong by that");
    }

    /// A law that nobody listed is something else, too: it stands against the best effect, whose own law may be a little wrong.
    #[test]
    fn a_law_that_is_more_probable_than_every_effect_is_outside_the_library() {
        let with = |ln_law: f64, ln_bayes: f64| {
            let none = of(NONE_AT, NONE_AT - 10.0).with_law(Some(NONE_AT + ln_law));
            decide(none, vec![judged(&["pad-creep"], ln_bayes, 20.0)], &[]).verdict
        };
        assert_eq!(with(80.0, 40.0), Verdict::OutsideLibrary);
        assert_eq!(with(30.0, 40.0), Verdict::Explained);
        assert_eq!(with(4020.0, 4000.0), Verdict::Explained, "its law may be wrong by that");
        assert_eq!(with(4080.0, 4000.0), Verdict::OutsideLibrary);
    }

    #[test]
    fn what_does_not_matter_or_is_within_chance_is_as_good_as_none() {
        for spoil in [
            |one: &mut Judged| one.matters = 0.0,
            |one: &mut Judged| one.beyond_chance = -0.1,
        ] {
            let mut small = judged(&["pad-creep"], 40.0, 20.0);
            spoil(&mut small);
            let selected = verdict(0.0, vec![small]);
            assert_eq!(selected.verdict, Verdict::Agrees);
            assert!(selected.null_probability > 0.99);
        }
    }

    /// A probability that chance reaches would sound sure.
    #[test]
    fn what_is_within_chance_is_stated_without_a_probability_and_what_does_not_matter_with_it() {
        let said = |spoil: &dyn Fn(&mut Judged)| {
            let mut one = judged(&["pad-creep"], 40.0, 20.0);
            spoil(&mut one);
            let selected = verdict(0.0, vec![one]);
            words::sentence(selected.verdict, &[], &[], &selected, 1.0, None, "cycles")
        };
        let small = said(&|one| one.matters = 0.0);
        assert!(small.contains("looks like pad-creep (probability "), "{small}");
        let by_chance = said(&|one| one.beyond_chance = -0.1);
        let (_, of_effect) = by_chance.split_once("pad-creep").expect(&by_chance);
        assert!(
            of_effect.contains("by chance") && !of_effect.contains('%'),
            "{by_chance}"
        );
    }

    #[test]
    fn what_is_there_and_may_matter_is_named_with_the_doubt() {
        let with = |matters: f64| {
            let mut one = judged(&["pad-creep"], 400.0, 20.0);
            one.matters = matters;
            verdict(0.0, vec![one])
        };
        let likely = with(0.8);
        assert_eq!(likely.verdict, Verdict::Ambiguous);
        assert!(
            (likely.null_probability - 0.2).abs() < 0.02,
            "{}",
            likely.null_probability
        );
        let hardly = with(0.3);
        assert_eq!(hardly.verdict, Verdict::Agrees);
        assert!(
            (hardly.null_probability - 0.7).abs() < 0.02,
            "{}",
            hardly.null_probability
        );
        // Neither which it is nor whether it matters is sure.
        let both = ["pad-creep", "backlash"].map(|name| Judged {
            matters: 0.9,
            ..judged(&[name], 400.0, 20.0)
        });
        assert_eq!(verdict(0.0, both.into()).verdict, Verdict::Agrees);
    }

    #[test]
    fn what_does_not_hold_on_other_data_is_something_else() {
        let mut bent = judged(&["pad-creep"], 40.0, 20.0);
        bent.holds = false;
        assert_eq!(verdict(0.0, vec![bent]).verdict, Verdict::OutsideLibrary);
    }

    #[test]
    fn a_second_effect_must_earn_its_place() {
        let pair = |gain: f64| {
            let all = vec![
                judged(&["pad-creep"], 40.0, 20.0),
                judged(&["pad-creep", "backlash"], 40.0 + gain, 0.0),
            ];
            verdict(0.0, all).candidates[0].hypothesised.len()
        };
        assert_eq!((pair(4.0), pair(20.0)), (1, 2));
    }

    #[test]
    fn a_pair_that_earns_no_place_says_nothing_about_something_else() {
        let mut pair = judged(&["pad-creep", "backlash"], 440.0, 435.0);
        pair.holds = false;
        let selected = verdict(0.0, vec![judged(&["pad-creep"], 400.0, 380.0), pair]);
        assert_eq!(selected.verdict, Verdict::Explained);
        assert_eq!(selected.candidates[0].hypothesised.len(), 1);
    }

    /// After an effect of 60 standard deviations, one of 6 may be what its law is wrong by.
    #[test]
    fn what_may_be_the_error_of_the_first_law_is_no_second_effect() {
        let second = |first: f64, gain: f64| {
            let all = vec![
                judged(&["pad-creep"], first, 0.0),
                judged(&["pad-creep", "backlash"], first + gain, 0.0),
            ];
            verdict(0.0, all).candidates[0].hypothesised.len()
        };
        assert_eq!(
            (second(1800.0, 18.0), second(100.0, 18.0), second(1800.0, 100.0)),
            (1, 2, 2)
        );
    }
}
