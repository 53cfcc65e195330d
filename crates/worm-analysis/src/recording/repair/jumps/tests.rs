//! Jumps of one marker, and motions that are none.

use super::find;
use crate::experiment::{Simulation, simulate};
use crate::recording::{Recording, RepairKind};
use worm_estimator::config::Config;

fn crawl() -> Recording {
    let simulation = Simulation {
        cycles: 4.0,
        dropout_share: 0.02,
        ..Simulation::default()
    };
    simulate(&Config::default(), &simulation).expect("it crawls")
}

fn shift(recording: &mut Recording, cell: usize, samples: std::ops::Range<usize>, shift_m: f64) {
    recording.position_m[cell][samples]
        .iter_mut()
        .for_each(|at_m| *at_m += shift_m);
}

#[test]
fn a_marker_that_comes_back_has_jumped_and_one_that_stays_has_moved() {
    for cell in 0..4 {
        let mut recording = crawl();
        shift(&mut recording, cell, 500..540, 5e-3);
        let end = recording.samples();
        shift(&mut recording, cell, 800..end, -4e-3);
        let jumps = find(&recording);
        let kinds: Vec<_> = jumps.iter().map(|jump| (jump.repair.what, jump.repair.cell)).collect();
        let expected = [RepairKind::MarkerJump, RepairKind::MarkerMoved].map(|what| (what, Some(cell + 1)));
        assert_eq!(kinds, expected, "cell {}", cell + 1);
        assert!(
            jumps[0].away.start.abs_diff(500) <= 1 && jumps[0].away.end.abs_diff(540) <= 1,
            "{jumps:?}"
        );
        let shift_m = jumps[1].repair.shift_m.expect("a shift");
        assert!((shift_m + 4e-3).abs() < 1e-3, "{shift_m}");
    }
}

#[test]
fn what_shifts_all_cells_is_no_jump_of_one() {
    let mut recording = crawl();
    let end = recording.samples();
    (0..4).for_each(|cell| shift(&mut recording, cell, 500..end, 5e-3));
    assert!(find(&recording).is_empty());
}

#[test]
fn with_two_cells_nobody_can_say_which_one_jumped() {
    let mut recording = crawl();
    recording.position_m.truncate(2);
    shift(&mut recording, 1, 500..540, 5e-3);
    assert!(find(&recording).is_empty());
}
