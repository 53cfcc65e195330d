//! The search itself on a few small campaigns with a hidden effect, each drawn from a seed that is in neither the development nor
//! the test split. The same ones in full size are `cargo bench --bench explain_benchmark -- --split search`, and the score over
//! many is that of the splits `development` and `test`.

use testkit::hidden_effects::answer::{Answer, Verdict};
use testkit::hidden_effects::assessment::{Assessment, Explainer, assess};
use testkit::hidden_effects::campaign::{HiddenCampaign, draw_sized};
use testkit::hidden_effects::effect::{Effect, SeverityRange};
use testkit::hidden_effects::follow_up::ExtraRun;
use testkit::hidden_effects::hidden::{Hidden, Twin};
use testkit::hidden_effects::library::Library;
use testkit::hidden_effects::setting::CampaignSize;
use testkit::hidden_effects::split::{Case, SEARCH_SEED, Split, split};

/// The library's own search, called once: the bench finds out whether the proposed run settles an ambiguous answer.
pub struct Once;

impl Explainer for Once {
    fn explain(&self, campaign: &HiddenCampaign, extra: &[ExtraRun]) -> Result<Answer, String> {
        if extra.is_empty() {
            Library.explain(campaign, extra)
        } else {
            Err("the search is called once".to_owned())
        }
    }
}

fn assessed(hidden: Hidden) -> Assessment {
    let case = Case {
        split: Split::Search,
        hidden,
        seed: SEARCH_SEED,
    };
    assert!(
        split(Split::Search, 1.0).contains(&case),
        "the bench has every case in full size"
    );
    let assessment = assess(&draw_sized(case.hidden, case.seed, CampaignSize::SMALL), &Once);
    println!("{}", assessment.line());
    assessment
}

#[test]
fn on_a_clean_worm_nothing_is_named() {
    let assessment = assessed(Hidden::Clean);
    assert_eq!(assessment.verdict, Verdict::Nothing);
}

#[test]
fn a_cell_with_other_friction_is_named_with_its_friction() {
    let assessment = assessed(Hidden::Single(Effect::UnequalClamping, SeverityRange::UPPER_HALF));
    assert_eq!(assessment.strict, Some(true));
    assert_eq!(assessment.right_cell, Some(true));
    assert!(assessment.severity_error.is_some_and(|error| error < 0.2));
    assert!(assessment.closure.is_some_and(|closure| closure > 0.7));
}

#[test]
fn a_drag_is_named_with_its_twin() {
    let assessment = assessed(Hidden::Twin(Twin::ConstantDrag));
    assert_eq!(assessment.right_class, Some(true));
    assert_eq!(assessment.twins_reported, Some(true));
}

/// Kind 5: friction that jumps in the middle of a run.
#[test]
fn what_the_library_does_not_know_is_not_named() {
    let assessment = assessed(Hidden::Outside(5));
    assert_eq!(assessment.verdict, Verdict::Outside);
}
