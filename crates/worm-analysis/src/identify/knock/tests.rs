//! Knocks, and slips that are none.

use super::{Knock, find};
use crate::experiment::Simulation;
use crate::identify::fixture::crawl;
use crate::recording::Recording;

/// Ten cycles of 300 samples with a change; what is found in them.
fn found(positions_only: bool, change: impl Fn(&mut Recording)) -> Vec<Knock> {
    let simulation = Simulation {
        positions_only,
        ..Simulation::default()
    };
    let (recording, gait) = crawl(&simulation, change);
    find(&recording.time_s, &recording.position_m, &gait)
}

fn shift_all(recording: &mut Recording, sample: usize, shift_m: f64) {
    for series in &mut recording.position_m {
        series[sample..].iter_mut().for_each(|at_m| *at_m += shift_m);
    }
}

#[test]
fn knocks_are_measured() {
    for positions_only in [false, true] {
        let knocks = found(positions_only, |recording| {
            shift_all(recording, 1000, 1e-3);
            shift_all(recording, 1777, -1.4e-3);
        });
        let samples: Vec<usize> = knocks.iter().map(|knock| knock.sample).collect();
        assert_eq!(samples, [1000, 1777]);
        for (knock, expected_m) in knocks.iter().zip([1e-3, -1.4e-3]) {
            assert!((knock.shift_m - expected_m).abs() < 4.0 * knock.sigma_m, "{knock:?}");
        }
    }
}

#[test]
fn slips_that_recur_or_take_their_time_are_none() {
    assert_eq!(found(false, |_| ()), []);
    let every_cycle = |recording: &mut Recording| {
        (1..10).for_each(|cycle| shift_all(recording, 300 * cycle + 130 + cycle % 3, -1e-3));
    };
    assert_eq!(found(false, every_cycle), [], "a worm that sticks");
    let slowly = |recording: &mut Recording| {
        (0..5).for_each(|part| shift_all(recording, 1000 + part, -2e-4));
    };
    assert_eq!(found(false, slowly), [], "a body that swings to a new place");
    let many_sizes = |recording: &mut Recording| {
        let slips_m = [-0.4e-3, -1e-3, -0.6e-3, -0.5e-3];
        let samples = [700, 1040, 1890, 2222];
        samples
            .into_iter()
            .zip(slips_m)
            .for_each(|(sample, slip_m)| shift_all(recording, sample, slip_m));
    };
    assert_eq!(found(false, many_sizes), [], "slips of all sizes");
}

#[test]
fn a_marker_alone_and_the_first_cycle_are_not_taken_for_knocks() {
    let alone = |recording: &mut Recording| {
        recording.position_m[2][1000..]
            .iter_mut()
            .for_each(|at_m| *at_m += 6e-3);
    };
    assert_eq!(found(false, alone), []);
    assert_eq!(found(false, |recording| shift_all(recording, 200, 1e-3)), []);
}
