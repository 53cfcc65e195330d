//! The score, on answers that are known to be right or wrong.

use testkit::hidden_effects::assessment::{Answer, Estimate, Explainer, Named, Proposal, Screened, Verdict, assess};
use testkit::hidden_effects::campaign::{CampaignKind, CampaignSize, Hidden, HiddenCampaign, Twin, draw_sized};
use testkit::hidden_effects::effect::{Effect, SeverityRange, TrueEffect};
use testkit::hidden_effects::follow_up::ExtraRun;
use testkit::hidden_effects::table::{Proportion, ScoreTable};

/// Knows the truth; what it does not want to know it calls a payload of 100 g.
struct Oracle {
    wants_to_know: bool,
}

impl Explainer for Oracle {
    fn explain(&self, campaign: &HiddenCampaign, extra: &[ExtraRun]) -> Result<Answer, String> {
        let named = |truth: &TrueEffect| Named {
            name: truth.name.to_owned(),
            cell: truth.cell,
            twins: vec!["constant-drag".to_owned(), "directional-friction".to_owned()],
            parameters: truth
                .parameters
                .iter()
                .map(|&(name, value)| Estimate {
                    name: name.to_owned(),
                    value: 1.01 * value,
                    low: 0.9 * value.min(2.0 * value),
                    high: 1.1 * value.max(-value),
                })
                .collect(),
        };
        let payload = Named {
            name: "payload".to_owned(),
            ..Named::default()
        };
        let truth: Vec<Named> = campaign.truth.iter().map(named).collect();
        // One effect of a single cell it finds too hard to tell until it has seen one more run.
        let torn = campaign.truth.iter().any(|truth| truth.cell.is_some()) && extra.is_empty();
        Ok(Answer {
            verdict: match campaign.kind {
                _ if !self.wants_to_know => Verdict::Named,
                CampaignKind::Clean => Verdict::Nothing,
                CampaignKind::Outside => Verdict::Outside,
                _ if torn => Verdict::Ambiguous,
                _ => Verdict::Named,
            },
            screened: truth
                .iter()
                .map(|truth| Screened {
                    name: truth.name.clone(),
                    cell: truth.cell,
                    sigma: 8.0,
                })
                .collect(),
            named: if self.wants_to_know {
                truth
            } else {
                vec![payload.clone()]
            },
            rivals: vec![payload],
            closure: Some(0.95),
            margin: Some(0.5),
            proposal: Some(Proposal::Run(campaign.usual(0.0))),
        })
    }
}

#[test]
fn the_score_tells_right_from_wrong() {
    let cases = [
        Hidden::Clean,
        Hidden::Outside(0),
        Hidden::Pair,
        Hidden::Twin(Twin::ConstantDrag),
        Hidden::Single(Effect::UnequalClamping, SeverityRange::UPPER_HALF),
        Hidden::Single(Effect::SlopeError, SeverityRange::UPPER_HALF),
    ];
    // How much is recorded matters neither to who knows nor to who does not look.
    let campaigns = cases.map(|hidden| draw_sized(hidden, 11, CampaignSize::SMALL));
    let fractions = |wants_to_know: bool| {
        let assessments: Vec<_> = campaigns
            .iter()
            .map(|campaign| assess(campaign, &Oracle { wants_to_know }))
            .collect();
        let table = ScoreTable(&assessments);
        println!("{table}");
        let fractions = table.fractions();
        move |what: &str| {
            let row = fractions
                .iter()
                .find(|row| row.0 == what)
                .expect("the table has such a row");
            let Proportion { hits, of } = row.1;
            (hits, of)
        }
    };
    #[rustfmt::skip]
    // What is counted, of how many; the hits of who knows all, and of who says payload always.
    let table = [
        ("no answer at all", 6, [0, 0]),
        ("singles at least 5 sigma", 2, [2, 2]),
        ("class, top 1, at least 5 sigma", 2, [2, 0]),
        ("strict, at least 5 sigma", 2, [1, 0]),
        ("clean, falsely named", 1, [0, 1]),
        ("outside, abstained", 1, [1, 0]),
        ("pairs, one right", 1, [1, 0]),
        ("pairs, both right", 1, [1, 0]),
        ("twins reported as twins", 1, [1, 0]),
    ];
    let [right, wrong] = [fractions(true), fractions(false)];
    for (what, of, [by_right, by_wrong]) in table {
        assert_eq!(right(what), (by_right, of), "{what}, by who knows");
        assert_eq!(wrong(what), (by_wrong, of), "{what}, by who does not");
    }
    for what in [
        "faulty cell",
        "ambiguous set holds the truth",
        "ambiguous, settled by proposal",
    ] {
        assert_eq!(right(what), (1, 1), "{what}");
    }
    assert_eq!(right("90 % interval covers"), (2, 2));
}

#[test]
fn wilson_gives_the_intervals_of_the_textbook() {
    for (hits, of, expected) in [
        (0, 10, [0.0, 0.278]),
        (9, 10, [0.596, 0.982]),
        (81, 263, [0.255, 0.366]),
    ] {
        let interval = Proportion { hits, of }.wilson();
        for (found, expected) in interval.into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-3, "{hits} of {of}: {interval:?}");
        }
    }
}
