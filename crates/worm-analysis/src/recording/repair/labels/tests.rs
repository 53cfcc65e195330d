//! Which labels are touched, and which are not.

use super::{Order, undo_swaps};
use crate::experiment::{Simulation, simulate};
use crate::recording::{Recording, RepairKind};
use worm_estimator::config::Config;

fn crawl() -> Recording {
    let simulation = Simulation {
        cycles: 3.0,
        ..Simulation::default()
    };
    simulate(&Config::default(), &simulation).expect("it crawls")
}

/// No label of the recording is touched.
fn assert_untouched(recording: &Recording, of: &str) {
    let mut repaired = recording.clone();
    assert_eq!(undo_swaps(&mut repaired).expect("labels in order"), [], "{of}");
    assert_eq!(repaired, *recording, "{of}");
}

#[test]
fn labels_that_keep_their_order_are_right_whatever_it_is() {
    let recording = crawl();
    assert_untouched(&recording, "cell 1 leads");
    let mut other = recording.clone();
    other.position_m.reverse();
    assert_untouched(&other, "cell 1 behind");
    other.position_m.swap(1, 2);
    assert_untouched(&other, "no order at all, all the time");
}

#[test]
fn cells_with_origins_of_their_own_are_left_alone() {
    let mut recording = crawl();
    for series in &mut recording.position_m {
        let first_m = series[0];
        series.iter_mut().for_each(|at_m| *at_m -= first_m);
    }
    assert!(Order::of(&recording.position_m).is_none());
    assert_untouched(&recording, "all begin at 0");
}

#[test]
fn a_ghost_keeps_its_label_and_takes_nobody_elses() {
    let mut recording = crawl();
    // Beyond its neighbour, where sorting alone would exchange the two.
    recording.position_m[1][400..406]
        .iter_mut()
        .for_each(|at_m| *at_m -= 0.06);
    assert_untouched(&recording, "a ghost beyond the next cell");
}

#[test]
fn three_labels_in_a_circle_while_the_fourth_marker_is_hidden() {
    let clean = crawl();
    let mut recording = clean.clone();
    for sample in 400..420 {
        let at_m: Vec<f64> = (0..4).map(|cell| clean.position_m[cell][sample]).collect();
        recording.position_m[0][sample] = at_m[1];
        recording.position_m[1][sample] = at_m[2];
        recording.position_m[2][sample] = at_m[0];
        recording.position_m[3][sample] = f64::NAN;
    }
    let repairs = undo_swaps(&mut recording).expect("it can be undone");
    assert_eq!(repairs.len(), 3);
    for cell in 0..3 {
        assert_eq!(recording.position_m[cell][401..419], clean.position_m[cell][401..419]);
        assert!(recording.position_m[cell][400].is_nan() && recording.position_m[cell][419].is_nan());
    }
}

#[test]
fn what_belongs_to_no_cell_is_left_out_or_refused() {
    let stray = |samples: std::ops::Range<usize>| {
        let mut recording = crawl();
        for sample in samples {
            // Label 1 takes the place of cell 2, whose own label lies between all places.
            recording.position_m[0][sample] = recording.position_m[1][sample];
            recording.position_m[1][sample] -= 0.018;
        }
        undo_swaps(&mut recording).map(|repairs| (recording, repairs))
    };
    let (recording, repairs) = stray(400..405).expect("five samples");
    assert!(
        repairs.iter().any(|repair| repair.what == RepairKind::StrayPosition),
        "{repairs:?}"
    );
    assert!(recording.position_m[0][402].is_nan());
    let error = stray(400..460).expect_err("half a second").to_string();
    assert!(error.contains("it cannot be told which cell"), "{error}");
}
