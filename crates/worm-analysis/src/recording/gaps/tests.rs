//! Gaps that are bridged, and gaps that are refused.

use super::{bridge, is_longer, round_up, unseen_runs};
use crate::experiment::{Simulation, simulate};
use crate::recording::Recording;
use worm_estimator::config::Config;

const NAN: f64 = f64::NAN;

/// One cycle at 10 Hz without noise, all of it seen.
fn crawl() -> Recording {
    let simulation = Simulation {
        cycles: 1.0,
        rate_hz: 10.0,
        noise_m: 0.0,
        ..Simulation::default()
    };
    simulate(&Config::default(), &simulation).expect("the paper's worm crawls")
}

#[test]
fn runs_of_unseen_values_are_found_wherever_they_are() {
    let runs =
        |values: &[f64]| -> Vec<(usize, usize)> { unseen_runs(values).map(|run| (run.start, run.end)).collect() };
    assert_eq!(runs(&[]), []);
    assert_eq!(runs(&[1.0, 2.0]), []);
    assert_eq!(runs(&[NAN]), [(0, 1)]);
    assert_eq!(runs(&[NAN, 1.0, NAN, NAN, 2.0, NAN]), [(0, 1), (2, 4), (5, 6)]);
}

#[test]
fn a_bridge_is_straight_in_time_and_leaves_the_ends_open() {
    // The clock is uneven: the bridge goes by time and not by sample number.
    let time_s = [0.0, 1.0, 2.0, 5.0, 6.0, 7.0];
    let mut values = [NAN, 1.0, NAN, NAN, 6.0, NAN];
    bridge(&time_s, &mut values);
    assert!(values[0].is_nan() && values[5].is_nan());
    assert_eq!(values[1..5], [1.0, 2.0, 5.0, 6.0]);
}

#[test]
fn bridged_positions_do_not_change_the_recording() {
    let truth = crawl();
    let mut recording = truth.clone();
    recording.position_m[2][7] = NAN;
    recording.position_m[1][0] = NAN;
    let filled_m = recording.filled();
    let expected_m = 0.5 * (truth.position_m[2][6] + truth.position_m[2][8]);
    assert!((filled_m[2][7] - expected_m).abs() < 1e-15);
    assert!(filled_m[1][0].is_nan(), "nothing is known before a cell is first seen");
    assert!(recording.position_m[2][7].is_nan(), "the recording stays as measured");
    assert_eq!(filled_m[3], truth.position_m[3]);
}

#[test]
fn a_gap_that_is_too_long_is_refused_with_its_cell_and_times() {
    let mut recording = crawl();
    // Samples 11 to 13 are lost: cell 3 is not seen between 1.0 s and 1.4 s.
    recording.position_m[2][11..14].fill(NAN);
    recording.cell_names[2] = "tail".to_owned();
    assert!(
        recording.check_gaps(0.4).is_ok(),
        "the limit itself is permitted, rounding aside"
    );
    let error = recording.check_gaps(0.39).expect_err("too long").to_string();
    for part in [
        "cell 3 (tail) is not seen from 1.000 s to 1.400 s, for 0.400 s, and 0.39 s may be bridged",
        "--max-gap 0.4 to accept it, or leave it out with --from or --to",
    ] {
        assert!(error.contains(part), "{error}");
    }
    assert!(error.starts_with("simulation of worm1"), "the source is named: {error}");
}

#[test]
fn a_gap_at_an_end_is_to_be_cut_off() {
    for (range, times) in [(0..5, "from 0.000 s to 0.500 s"), (20..26, "from 1.900 s to 2.500 s")] {
        let mut recording = crawl();
        assert_eq!(recording.samples(), 26);
        recording.position_m[0][range].fill(NAN);
        let error = recording.check_gaps(0.2).expect_err("too long").to_string();
        assert!(error.contains("cell 1 (x1_m)") && error.contains(times), "{error}");
        assert!(error.contains("or cut it off with --from or --to"), "{error}");
    }
}

#[test]
fn the_first_cell_with_too_long_a_gap_is_named() {
    let mut recording = crawl();
    recording.position_m[1][4] = NAN;
    recording.position_m[3][8..12].fill(NAN);
    assert!(recording.check_gaps(0.5).is_ok());
    let error = recording.check_gaps(0.3).expect_err("cell 4").to_string();
    assert!(error.contains("cell 4"), "cell 2 lacks a single sample: {error}");
    let error = recording.check_gaps(0.1).expect_err("both").to_string();
    assert!(error.contains("cell 2"), "{error}");
}

#[test]
fn rounding_of_times_makes_no_gap_longer() {
    let frame = |number: u32| f64::from(number) / 120.0;
    assert!(!is_longer(frame(49) - frame(25), 0.2), "24 frames at 120 Hz");
    assert!(is_longer(frame(50) - frame(25), 0.2));
    // What --max-gap is proposed accepts the gap.
    for time_s in [0.2, 0.25, 0.299_999, 1.0, 12.34] {
        let proposed_s = round_up(time_s);
        assert!(
            !is_longer(time_s, proposed_s) && proposed_s - time_s <= 0.1 + 1e-12,
            "{time_s}: {proposed_s}"
        );
    }
}
