//! A few segments of `wormd soak`; `wormd soak --hours 1000` runs two thousand.

use wormd::soak::report::Tally;
use wormd::soak::{SoakOptions, run, segment};

#[test]
fn a_few_segments_find_nothing_wrong() {
    let report = run(&SoakOptions::hours(3, 2.0), |_| true);
    assert!(report.passed(), "{report}");
    assert_eq!((report.segments, report.hours.round()), (4, 2.0));
    assert!(report.drawn >= 10 && report.alarms_true >= 5, "{report}");
    for energy in &report.energies {
        assert!(energy.cycles > 100 && energy.mean_percent.abs() < 2.0, "{report}");
    }
}

#[test]
fn a_segment_is_the_same_every_time() {
    let of = |tally: Tally| format!("{tally:?}");
    assert_eq!(of(segment::run(7, 5)), of(segment::run(7, 5)));
}
