//! The same results live and from a log.

use testkit::log_sample::{Telemetry, crawl, crawl_on_battery, crawl_with_late_estimator};
use worm_estimator::message::{Alarm, AlarmKind};
use worm_log::{Comparison, compare, replay};

fn replayed(telemetry: Telemetry) -> Comparison {
    let config = telemetry.config.clone();
    let log = telemetry.log();
    let replay = replay(&log, &config).expect("a valid configuration");
    compare(&log, &replay)
}

#[test]
fn a_whole_log_comes_out_as_recorded() {
    // An estimator that starts late begins in the middle of a crawl.
    for late in [0, 3, 1234] {
        let telemetry = crawl_with_late_estimator(6.5, late);
        let (states, cycles, alarms) = (telemetry.states.len(), telemetry.cycles.len(), telemetry.alarms.len());
        assert!(cycles >= 2, "{cycles} cycles");
        let comparison = replayed(telemetry);
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
fn ranges_come_out_as_recorded_and_an_older_log_has_none() {
    let telemetry = crawl_on_battery(6.5);
    let ranges = telemetry.ranges.len();
    assert_eq!((ranges, ranges), (telemetry.cycles.len(), 3));
    let comparison = replayed(telemetry);
    assert!(comparison.complete && comparison.is_identical(), "{comparison:?}");
    assert_eq!(
        (comparison.ranges_compared, comparison.ranges_identical),
        (ranges, ranges)
    );
    let mut older = crawl_on_battery(6.5);
    older.ranges.clear();
    let comparison = replayed(older);
    assert!(comparison.complete && comparison.ranges_compared == 0, "{comparison:?}");
    let mut other = crawl_on_battery(6.5);
    other.ranges[1].range_m += 1e-9;
    assert!(!replayed(other).is_identical());
}

#[test]
fn what_is_missing_is_told() {
    type Loss = fn(&mut Telemetry);
    let table: [(&str, Loss, &str); 6] = [
        (
            "begins late",
            |telemetry| telemetry.states = telemetry.states.split_off(1500),
            "the log begins after the estimator",
        ),
        (
            "a state",
            |telemetry| telemetry.states.retain(|state| state.sequence != 3000),
            "1 states are not in the log",
        ),
        (
            "a state that the estimator missed too",
            |telemetry| {
                for estimate in telemetry.estimates.iter_mut().skip(300) {
                    estimate.states_lost = 2;
                }
            },
            "the estimator had not received 2 states",
        ),
        (
            "a cycle",
            |telemetry| telemetry.cycles.retain(|cycle| cycle.index != 1),
            "1 cycles came out that are not in the log",
        ),
        (
            "the estimator's first life",
            |telemetry| {
                let anew = crawl_with_late_estimator(5.0, 2500);
                telemetry.estimates.truncate(200);
                telemetry.estimates.extend(anew.estimates);
            },
            "the estimator was started anew at t = 3.5",
        ),
        (
            "all estimates",
            |telemetry| telemetry.estimates.clear(),
            "there are no estimates in the log",
        ),
    ];
    for (what, lose, warning) in table {
        let mut telemetry = crawl(5.0);
        lose(&mut telemetry);
        let comparison = replayed(telemetry);
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
    let mut telemetry = crawl(5.0);
    let estimate = &mut telemetry.estimates[400];
    estimate.force_n[2] = estimate.force_n[2].next_up();
    telemetry.cycles[1].cot = f64::NAN;
    let comparison = replayed(telemetry);
    assert_eq!(comparison.estimates_identical, comparison.estimates_compared - 1);
    assert_eq!(comparison.cycles_identical, comparison.cycles_compared - 1);
    assert!(!comparison.is_identical());
}

/// A recorder of the worm that failed before or during this log leaves its traces in it, and no replay can have them.
#[test]
fn the_alarm_about_a_recorder_is_left_out() {
    let mut telemetry = crawl(5.0);
    let begun_ns = telemetry.states[0].time_ns;
    let alarm = |sequence, kind: AlarmKind| Alarm {
        sequence,
        time_ns: begun_ns + 1_000_000_000 * (1 + sequence),
        kind: kind.code(),
        raised: 1,
        ..Alarm::NONE
    };
    for estimate in telemetry.estimates.iter_mut().skip(10) {
        estimate.armed_mask |= 1 << AlarmKind::RecordingStopped.code();
        estimate.raised_mask |= 1 << AlarmKind::RecordingStopped.code();
    }
    assert_eq!(telemetry.alarms, [], "a healthy worm");
    telemetry.alarms = vec![
        alarm(0, AlarmKind::RecordingStopped),
        alarm(1, AlarmKind::LinkFault),
        alarm(2, AlarmKind::RecordingStopped),
        alarm(3, AlarmKind::LinkFault),
    ];
    let config = telemetry.config.clone();
    let log = telemetry.log();
    let mut replay = replay(&log, &config).expect("a valid configuration");
    // What an estimator without a recorder would have found.
    replay.alarms = vec![
        Alarm {
            sequence: 0,
            ..log.alarms[1]
        },
        Alarm {
            sequence: 1,
            ..log.alarms[3]
        },
    ];
    let comparison = compare(&log, &replay);
    assert!(comparison.complete && comparison.is_identical(), "{comparison:?}");
    assert_eq!(comparison.alarms_compared, 2);
    assert!(comparison.estimates_compared > 400);
}
