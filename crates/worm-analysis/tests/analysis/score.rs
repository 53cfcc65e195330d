//! The score, on answers that are known to be right or wrong.

use testkit::hidden_effects::answer::{Answer, Estimate, Named, Proposal, Verdict};
use testkit::hidden_effects::assessment::{Explainer, assess};
use testkit::hidden_effects::campaign::{HiddenCampaign, draw_sized};
use testkit::hidden_effects::effect::{Effect, SeverityRange};
use testkit::hidden_effects::follow_up::ExtraRun;
use testkit::hidden_effects::hidden::{Hidden, Twin};
use testkit::hidden_effects::setting::CampaignSize;
use testkit::hidden_effects::table::ScoreTable;
use testkit::hidden_effects::truth::{CampaignKind, TrueEffect};

/// Knows the truth, and reports it, or else always a payload.
struct Oracle {
    reports_truth: bool,
}

impl Explainer for Oracle {
    fn explain(&self, campaign: &HiddenCampaign, extra: &[ExtraRun]) -> Result<Answer, String> {
        let named = |truth: &TrueEffect| Named {
            name: truth.name.clone(),
            cell: truth.cell,
            twins: vec!["constant-drag".to_owned(), "directional-friction".to_owned()],
            parameters: truth
                .parameters
                .iter()
                .map(|(name, &value)| Estimate {
                    name: name.clone(),
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
        let truth: Vec<Named> = campaign.truth.effects.iter().map(named).collect();
        // An effect of a single cell is ambiguous until there is one more run.
        let is_ambiguous = campaign.truth.effects.iter().any(|truth| truth.cell.is_some()) && extra.is_empty();
        Ok(Answer {
            verdict: match campaign.truth.kind {
                _ if !self.reports_truth => Verdict::Named,
                CampaignKind::Clean => Verdict::Nothing,
                CampaignKind::Stranger => Verdict::Outside,
                _ if is_ambiguous => Verdict::Ambiguous,
                _ => Verdict::Named,
            },
            probability: Some(if self.reports_truth { 0.995 } else { 0.9999 }),
            onset: None,
            named: if self.reports_truth {
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
fn the_score_separates_right_from_wrong() {
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
    let fractions = |reports_truth: bool| {
        let assessments: Vec<_> = campaigns
            .iter()
            .map(|campaign| assess(campaign, &Oracle { reports_truth }))
            .collect();
        println!("{}", ScoreTable(&assessments));
        move |what: &str| {
            let count = ScoreTable(&assessments).count(what);
            count.expect("the table has such a row")
        }
    };
    #[rustfmt::skip]
    // What is counted, of how many; the hits of who knows all, and of who says payload always.
    let table = [
        ("no answer at all", 6, [0, 0]),
        ("single: strong by truth", 2, [2, 2]),
        ("single: false second effect", 2, [0, 0]),
        ("strong: class right", 2, [2, 0]),
        ("strong: strictly right", 2, [1, 0]),
        ("clean: an effect named", 1, [0, 1]),
        ("stranger: detected as outside", 1, [1, 0]),
        ("stranger: under another name", 1, [0, 1]),
        ("pair: one named", 1, [1, 0]),
        ("pair: both named", 1, [1, 0]),
        ("twins reported as twins", 1, [1, 0]),
        ("stated at 0.99: right", 6, [6, 0]),
    ];
    let [right, wrong] = [fractions(true), fractions(false)];
    for (what, of, [by_right, by_wrong]) in table {
        assert_eq!(right(what), (by_right, of), "{what}, by who knows");
        assert_eq!(wrong(what), (by_wrong, of), "{what}, by who does not");
    }
    for what in [
        "strong: cell right",
        "ambiguous: set holds truth",
        "ambiguous: settled by the run",
    ] {
        assert_eq!(right(what), (1, 1), "{what}");
    }
    assert_eq!(right("strong: 90 % interval covers"), (2, 2));
}
