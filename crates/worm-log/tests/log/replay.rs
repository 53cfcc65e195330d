//! The same results live and from a log.

use testkit::log_sample::{Told, crawl, crawl_with_late_estimator};
use worm_log::{Comparison, compare, replay};

fn replayed(session: Told) -> Comparison {
    let config = session.config.clone();
    let log = session.log();
    let replay = replay(&log, &config).expect("a valid configuration");
    compare(&log, &replay)
}

#[test]
fn a_whole_log_comes_out_as_recorded() {
    // An estimator that starts late begins in the middle of a crawl.
    for late in [0, 3, 1234] {
        let session = crawl_with_late_estimator(6.5, late);
        let (states, cycles, alarms) = (session.states.len(), session.cycles.len(), session.alarms.len());
        assert!(cycles >= 2, "{cycles} cycles");
        let comparison = replayed(session);
        assert!(
            comparison.complete && comparison.is_identical(),
            "{late}: {comparison:?}"
        );
        assert_eq!(
            (
                comparison.states,
                comparison.cycles_compared,
                comparison.alarms_compared
            ),
            (states, cycles, alarms)
        );
        let samples = (states - late) * 120 / 1000;
        assert!(
            comparison.estimates_compared.abs_diff(samples) <= 1,
            "no heartbeat is among them: {comparison:?}"
        );
    }
}

#[test]
fn what_is_missing_is_told() {
    type Loss = fn(&mut Told);
    let table: [(&str, Loss, &str); 6] = [
        (
            "begins late",
            |session| session.states = session.states.split_off(1500),
            "the log begins after the estimator",
        ),
        (
            "a state",
            |session| session.states.retain(|state| state.sequence != 3000),
            "1 states are not in the log",
        ),
        (
            "a state that the estimator missed too",
            |session| {
                for estimate in session.estimates.iter_mut().skip(300) {
                    estimate.states_lost = 2;
                }
            },
            "the estimator had not received 2 states",
        ),
        (
            "a cycle",
            |session| session.cycles.retain(|cycle| cycle.index != 1),
            "1 cycles came out that are not in the log",
        ),
        (
            "the estimator's first life",
            |session| {
                let anew = crawl_with_late_estimator(5.0, 2500);
                session.estimates.truncate(200);
                session.estimates.extend(anew.estimates);
            },
            "the estimator was started anew at t = 3.5",
        ),
        (
            "all estimates",
            |session| session.estimates.clear(),
            "there are no estimates in the log",
        ),
    ];
    for (what, lose, warning) in table {
        let mut session = crawl(5.0);
        lose(&mut session);
        let comparison = replayed(session);
        assert!(!comparison.complete, "{what}");
        assert!(
            comparison.warnings.iter().any(|text| text.contains(warning)),
            "{what}: {:?}",
            comparison.warnings
        );
    }
}

#[test]
fn a_result_that_differs_in_its_last_bit_is_found() {
    let mut session = crawl(5.0);
    let estimate = &mut session.estimates[400];
    estimate.force_n[2] = estimate.force_n[2].next_up();
    session.cycles[1].cot = f64::NAN;
    let comparison = replayed(session);
    assert_eq!(comparison.estimates_identical, comparison.estimates_compared - 1);
    assert_eq!(comparison.cycles_identical, comparison.cycles_compared - 1);
    assert!(!comparison.is_identical());
}
