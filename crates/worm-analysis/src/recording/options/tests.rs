//! Options that can be used, and those that are refused.

use super::OpenOptions;
use std::path::Path;

fn check(options: OpenOptions) -> Result<(), String> {
    options.check(Path::new("worm.csv")).map_err(|error| error.to_string())
}

#[test]
fn usual_options_are_accepted() {
    let none = OpenOptions::default();
    assert_eq!(
        (none.from_s, none.to_s, none.max_gap_s, none.axis),
        (None, None, 0.2, None)
    );
    for (from_s, to_s, max_gap_s) in [
        (None, None, 0.2),
        (Some(1.0), None, 0.0),
        (None, Some(-3.0), 1e9),
        (Some(-1.0), Some(-0.999), 0.2),
    ] {
        let options = OpenOptions {
            from_s,
            to_s,
            max_gap_s,
            ..OpenOptions::default()
        };
        assert_eq!(check(options.clone()), Ok(()), "{options:?}");
    }
}

#[test]
fn times_that_cannot_be_used_are_refused_by_the_name_of_the_flag() {
    let nan = f64::NAN;
    let infinite = f64::INFINITY;
    let table = [
        (Some(nan), None, 0.2, "--from NaN is not a time"),
        (Some(-infinite), None, 0.2, "--from -inf is not a time"),
        (None, Some(infinite), 0.2, "--to inf is not a time"),
        (Some(2.0), Some(2.0), 0.2, "--from 2 is not before --to 2"),
        (Some(3.0), Some(2.5), 0.2, "--from 3 is not before --to 2.5"),
        (None, None, -0.1, "--max-gap -0.1 is not a duration"),
        (None, None, nan, "--max-gap NaN is not a duration"),
        (None, None, infinite, "--max-gap inf is not a duration"),
    ];
    for (from_s, to_s, max_gap_s, expected) in table {
        let options = OpenOptions {
            from_s,
            to_s,
            max_gap_s,
            ..OpenOptions::default()
        };
        let error = check(options).expect_err(expected);
        assert!(error.starts_with("worm.csv: ") && error.contains(expected), "{error}");
    }
}
