//! Verdicts by their evidence.

use super::*;
use crate::explain::search::fit::Fit;
use crate::explain::search::hypothesis::Hypothesis;
use crate::explain::search::parameter::{Hypothesised, Onset};
use crate::explain::search::plant::BodyMotion;
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
        irregular: None,
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
    decide(of(NONE_AT, NONE_AT + none_large), &all, &[], &[])
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

/// Two that explain as much and would be two names if they stayed, and one that lasts for no longer than anything must.
#[test]
fn what_comes_and_goes_counts_as_something_else_where_it_is_not_sure() {
    let spell = |name: &str, cycles: f64| {
        let mut one = judged(&[name], 40.0, 20.0);
        one.candidate.hypothesised[0].onset = Some(Onset {
            ends: Some(3.0 + cycles),
            ..Onset::from(3.0, None)
        });
        one
    };
    let sure = verdict(5.0, vec![spell("pad-creep", 3.0), judged(&["backlash"], 12.0, 0.0)]);
    assert_eq!(sure.verdict, Verdict::Explained);
    let lasting = vec![judged(&["pad-creep"], 40.0, 20.0), judged(&["backlash"], 40.0, 20.0)];
    assert_eq!(verdict(5.0, lasting).verdict, Verdict::Ambiguous);
    for all in [
        vec![spell("pad-creep", 3.0), spell("backlash", 3.0)],
        vec![spell("pad-creep", 2.0)],
    ] {
        let unsure = verdict(5.0, all);
        assert_eq!(unsure.verdict, Verdict::OutsideLibrary);
        assert!(unsure.other_probability > 0.9, "{}", unsure.other_probability);
    }
}

/// With an effect that makes the best of wrong conditions, 40 nats beyond none: conditions that are much less probable, a little less, and
/// more so.
#[test]
fn wrong_conditions_count_as_much_as_they_are_probable() {
    let beside = |ln_bayes: f64| {
        let effect = judged(&["pad-creep"], 40.0, 20.0);
        let with_prior = NONE_AT + ln_bayes + effect.ln_prior;
        decide(of(NONE_AT, NONE_AT + 5.0), &[effect], &[], &[with_prior])
    };
    let [much_less, less, more] = [30.0, 39.0, 50.0].map(beside);
    assert_eq!(much_less.verdict, Verdict::Explained);
    assert_eq!((less.verdict, less.is_misstated()), (Verdict::Ambiguous, false));
    assert_eq!((more.verdict, more.is_misstated()), (Verdict::OutsideLibrary, true));
    let [effect, conditions] = [less.probability[0], less.misstated_probability];
    assert!(
        (effect / conditions - std::f64::consts::E).abs() < 1e-9 && (0.95..1.0).contains(&(effect + conditions)),
        "{effect} and {conditions}"
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
        decide(none, &[judged(&["pad-creep"], ln_bayes, 20.0)], &[], &[]).verdict
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

/// A body that moves too irregularly is something that is missing, with any effect beside it that does not calm it; one that moves as
/// usual is none.
#[test]
fn what_moves_too_irregularly_is_outside_the_library() {
    let with = |evidence: Evidence, ln_bayes: f64| {
        evidence.with_body_motion(BodyMotion {
            irregular: Some(ln_bayes),
            ..BodyMotion::default()
        })
    };
    for (ln_bayes, expected, is_irregular) in [
        (-2.0, Verdict::Agrees, false),
        (2.0, Verdict::Agrees, true),
        (9.0, Verdict::OutsideLibrary, true),
    ] {
        let mut weak = judged(&["backlash"], 1.0, -5.0);
        weak.candidate.evidence = weak.candidate.evidence.map(|evidence| with(evidence, ln_bayes));
        let none = with(of(NONE_AT, NONE_AT - 10.0), ln_bayes);
        let selected = decide(none, &[weak], &[], &[]);
        assert_eq!(
            (selected.verdict, selected.is_irregular),
            (expected, is_irregular),
            "{ln_bayes}"
        );
    }
    // An effect after which the body moves as usual is named all the same.
    let mut calming = judged(&["wear"], 40.0, 0.0);
    calming.candidate.evidence = calming.candidate.evidence.map(|evidence| with(evidence, -2.0));
    let none = with(of(NONE_AT, NONE_AT - 10.0), 12.0);
    assert_eq!(decide(none, &[calming], &[], &[]).verdict, Verdict::Explained);
}
