//! The search itself on a few small campaigns with something hidden in them, each drawn from a seed that the splits to tune and to
//! score on do not use. The same ones in full size are `cargo bench --bench explain_benchmark -- --split search`, and the score over
//! many is that of the splits `development` and `test`.

use testkit::hidden_effects::campaign::{HiddenCampaign, Size, Twin, Wanted, draw_sized};
use testkit::hidden_effects::effect::{Band, Effect};
use testkit::hidden_effects::library::Library;
use testkit::hidden_effects::repeat::ExtraRun;
use testkit::hidden_effects::split::{Case, SEARCH_SEED, Split, split};
use testkit::hidden_effects::verdict::{Answer, Explainer, Judgement, Verdict, judge};

/// The library's own search, asked once: whether the run that it proposes settles an ambiguous answer is for the bench.
struct Once;

impl Explainer for Once {
    fn explain(&self, campaign: &HiddenCampaign, extra: &[ExtraRun]) -> Result<Answer, String> {
        if extra.is_empty() {
            Library.explain(campaign, extra)
        } else {
            Err("nothing is asked twice".to_owned())
        }
    }
}

fn judged(wanted: Wanted) -> Judgement {
    let case = Case {
        wanted,
        seed: SEARCH_SEED,
    };
    assert!(
        split(Split::Search, 1.0).contains(&case),
        "the bench has every case in full size"
    );
    let judgement = judge(&draw_sized(case.wanted, case.seed, Size::SMALL), &Once);
    println!("{}", judgement.line());
    judgement
}

#[test]
fn on_a_clean_worm_nothing_is_named() {
    let judgement = judged(Wanted::Clean);
    assert_eq!(judgement.verdict, Verdict::Nothing);
}

#[test]
fn a_cell_that_holds_otherwise_is_named_with_its_friction() {
    let judgement = judged(Wanted::Single(Effect::UnequalClamping, Band::UPPER_HALF));
    assert_eq!(judgement.strict, Some(true));
    assert_eq!(judgement.right_cell, Some(true));
    assert!(judgement.severity_error.is_some_and(|error| error < 0.2));
    assert!(judgement.closure.is_some_and(|closure| closure > 0.7));
}

#[test]
fn a_drag_is_named_with_its_twin() {
    let judgement = judged(Wanted::Twin(Twin::ConstantDrag));
    assert_eq!(judgement.right_class, Some(true));
    assert_eq!(judgement.twins_reported, Some(true));
}

/// Kind 5: friction that jumps in the middle of a run.
#[test]
fn what_the_library_does_not_know_is_not_named() {
    let judgement = judged(Wanted::Outside(5));
    assert_eq!(judgement.verdict, Verdict::Outside);
}
