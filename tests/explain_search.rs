//! The search itself on a few campaigns with something hidden in them, each drawn from a seed that no split uses. The score over
//! many is `cargo bench --bench explain_benchmark`.

#[path = "hidden/mod.rs"]
mod hidden;

use hidden::campaign::{Twin, Wanted, draw};
use hidden::effect::{Band, Effect};
use hidden::library::Library;
use hidden::verdict::{Judgement, Verdict, judge};

const SEED: u64 = 501;

fn judged(wanted: Wanted) -> Judgement {
    let judgement = judge(&draw(wanted, SEED), &Library);
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
