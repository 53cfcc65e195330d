//! The search on a small fixed sample of the own test bed: one campaign of each kind, of any size and with laws of other forms than the
//! library's. The sample of the other bed is in `tests/commands/explain_mujoco.rs`; the whole splits are no test.

use testkit::hidden_effects::assessment::assess;
use testkit::hidden_effects::split::{Split, split};
use testkit::hidden_effects::table::ScoreTable;

use super::search::Once;

#[test]
fn the_sample_is_explained_and_scored() {
    let assessments: Vec<_> = split(Split::Sample, 1.0)
        .into_iter()
        .map(|case| assess(&case.draw(), &Once))
        .collect();
    for one in &assessments {
        println!("{}", one.line());
    }
    let table = ScoreTable(&assessments);
    println!("{table}");
    // What is counted, and of how many.
    let expected = [
        ("no answer at all", (0, 6)),
        ("clean: an effect named", (0, 1)),
        ("discrepant: an effect named", (0, 1)),
        ("single: false second effect", (0, 1)),
        ("strong: strictly right", (1, 1)),
        ("strong: cell right", (1, 1)),
        ("stranger: under another name", (0, 1)),
        ("onset: class right", (1, 1)),
        ("onset: within one cycle", (1, 1)),
        // Of the pair only one is named so far.
        ("pair: one named", (1, 1)),
    ];
    for (what, expected) in expected {
        assert_eq!(table.count(what), Some(expected), "{what}");
    }
    // It shows clearly enough to be scored.
    let detected = table.count("stranger: detected as outside");
    assert_eq!(detected.map(|(_, of)| of), Some(1));
}
