//! Shifts are taken out, and what is not confirmed is not.

use super::{Steadied, steady};
use crate::experiment::{Simulation, simulate};
use crate::identify::GaitError;
use crate::identify::gait::{self, Prior};
use crate::recording::{OpenOptions, Recording, Repair, RepairKind};
use std::borrow::Cow;
use worm_estimator::config::Config;

fn crawl() -> Recording {
    simulate(&Config::default(), &Simulation::default()).expect("it crawls")
}

fn steadied(recording: &Recording) -> Steadied<'_> {
    steadied_or_not(recording).expect("a gait")
}

fn steadied_or_not(recording: &Recording) -> Result<Steadied<'_>, GaitError> {
    let find_gait = |measured_m: &[Vec<f64>], filled_m: &[Vec<f64>]| {
        let prior = Prior {
            step_order: &[0, 1, 2, 3],
            phase: recording.gait_phase.as_deref(),
        };
        gait::find(&recording.time_s, measured_m, filled_m, prior)
    };
    steady(recording, find_gait)
}

#[test]
fn times_in_milliseconds_are_refused() {
    let mut recording = crawl();
    recording.time_s.iter_mut().for_each(|time_s| *time_s *= 1e3);
    let refused = steadied_or_not(&recording).err().map(|error| error.to_string());
    assert!(refused.is_some_and(|text| text.contains("in milliseconds")));
}

#[test]
fn a_clean_recording_is_not_even_copied() {
    let recording = crawl();
    let steadied = steadied(&recording);
    assert!(matches!(steadied.recording, Cow::Borrowed(_)));
    assert_eq!((steadied.shifts, steadied.repairs), (Vec::new(), Vec::new()));
}

#[test]
fn the_move_of_a_marker_is_measured_over_whole_cycles() {
    let clean = crawl();
    let mut moved = clean.clone();
    moved.position_m[1][1300..].iter_mut().for_each(|at_m| *at_m += 3e-3);
    let checked = moved.checked(&OpenOptions::default()).expect("it can be repaired");
    let steadied = steadied(&checked);
    let [shift] = steadied.shifts[..] else {
        panic!("{:?}", steadied.repairs);
    };
    assert_eq!((shift.cell, shift.sample), (Some(1), 1300));
    assert!(
        (shift.shift_m - 3e-3).abs() < 4.0 * shift.sigma_m && shift.sigma_m < 2e-5,
        "{shift:?}"
    );
    assert!((steadied.recording.position_m[1][2000] - clean.position_m[1][2000]).abs() < 5e-5);
}

#[test]
fn a_move_that_the_cycles_around_it_do_not_confirm_is_none() {
    let mut recording = crawl();
    let doubtful = Repair::new(RepairKind::MarkerMoved, Some(2), (10.0, 25.0), 1800).with_shift(1e-3, 1e-4);
    recording.repairs.push(doubtful);
    let steadied = steadied(&recording);
    assert!(matches!(steadied.recording, Cow::Borrowed(_)));
    assert_eq!(steadied.repairs, []);
}
