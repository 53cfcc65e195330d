//! A few segments of `wormd soak`; `wormd soak --hours 1000` runs two thousand.

use std::sync::atomic::{AtomicU64, Ordering};
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

/// Segments in which an alarm was once false, or a true one called false, for what is now understood: a slip stood on in the map of the
/// residuals, attempts to arm looked like a silent tracker, a hot winding takes more, identified bounds were taken for exact, a cell out of
/// sight made the others seem to sink while it stepped, a slip was taken for a pull downhill, a fit said less friction where the torque
/// was as before, the phase of a servo that was silent jumped, positions were smoothed across a silence of the tracker, inertia stayed in the
/// profile of a fast worm that was read seldom, and a late cycle of a changed worm named a load.
#[test]
fn what_was_once_false_is_no_more() {
    let segments = [24, 30, 184, 220, 755].map(|number| (1, number));
    for (seed, number) in segments.into_iter().chain([
        (4242, 1),
        (6151, 11),
        (7161, 10),
        (7161, 47),
        (11161, 116),
        (11161, 195),
    ]) {
        let tally = segment::run(seed, number);
        assert!(
            tally.findings.is_empty(),
            "seed {seed}, segment {number}: {:?}",
            tally.findings
        );
        assert!(tally.true_alarms > 0, "seed {seed}, segment {number}");
    }
}

/// A run that is stopped says where to go on, and what is then left is the rest of it.
#[test]
fn a_stopped_run_can_be_continued() {
    let whole = SoakOptions::hours(3, 1.5);
    let continued_with = AtomicU64::new(0);
    let begun = run(&whole, |progress| {
        assert_eq!(progress.newest.findings.len(), 0);
        continued_with.fetch_max(progress.continue_with, Ordering::Relaxed);
        false
    });
    let from = continued_with.load(Ordering::Relaxed);
    assert!(begun.segments >= 1 && from == begun.segments, "{begun}");
    let rest = whole.from_segment(from);
    assert_eq!((rest.first, rest.segments), (from, 3 - from));
    assert_eq!(whole.from_segment(7).segments, 0);
}

#[test]
fn a_segment_is_the_same_every_time() {
    let of = |tally: Tally| format!("{tally:?}");
    assert_eq!(of(segment::run(7, 5)), of(segment::run(7, 5)));
}
