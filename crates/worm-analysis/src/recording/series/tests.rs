//! Cutting a recording.

use crate::experiment::{Simulation, simulate};
use crate::recording::{Motor, Recording};
use worm_estimator::config::Config;

/// Eleven samples from 0 to 1 s with phase and motor; the motor's current is the sample's number.
fn recording() -> Recording {
    let simulation = Simulation {
        cycles: 0.4,
        rate_hz: 10.0,
        ..Simulation::default()
    };
    let mut recording = simulate(&Config::default(), &simulation).expect("the paper's worm crawls");
    let numbers: Vec<f64> = (0..recording.samples()).map(|sample| sample as f64).collect();
    recording.motor = Some(Motor {
        angle_rad: numbers.clone(),
        velocity_rad_s: numbers.clone(),
        current_a: numbers.clone(),
        voltage_v: numbers.clone(),
        duty: numbers.clone(),
        temperature_c: numbers,
    });
    recording
}

#[test]
fn every_series_is_cut_alike_and_both_ends_are_kept() {
    let whole = recording();
    assert_eq!(whole.samples(), 11);
    for (from_s, to_s, range) in [
        (None, None, 0..11),
        (Some(0.3), None, 3..11),
        (None, Some(0.5), 0..6),
        (Some(0.25), Some(0.65), 3..7),
        (Some(-5.0), Some(5.0), 0..11),
        (Some(0.41), Some(0.42), 5..5),
        (Some(2.0), None, 11..11),
        (None, Some(-1.0), 0..0),
    ] {
        let mut cut = whole.clone();
        cut.cut(from_s, to_s);
        assert_eq!(cut.time_s, whole.time_s[range.clone()], "{from_s:?} to {to_s:?}");
        for (cut_m, whole_m) in cut.position_m.iter().zip(&whole.position_m) {
            assert_eq!(cut_m, &whole_m[range.clone()]);
        }
        let phase = |recording: &Recording| recording.gait_phase.clone().expect("recorded");
        assert_eq!(phase(&cut), phase(&whole)[range.clone()]);
        let (cut, whole) = (cut.motor.expect("recorded"), whole.motor.as_ref().expect("recorded"));
        for (cut, whole) in cut.series().into_iter().zip(whole.series()) {
            assert_eq!(cut, &whole[range.clone()]);
        }
    }
}

#[test]
fn a_cell_is_named_by_number_and_source() {
    let mut recording = recording();
    recording.cell_names.truncate(1);
    assert_eq!(recording.name_of(0), "cell 1 (x1_m)");
    assert_eq!(recording.name_of(1), "cell 2");
}
