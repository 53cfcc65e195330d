//! Lags that grow, and lags that do not.

use super::drift;
use crate::experiment::Simulation;
use crate::identify::fixture::crawl;
use crate::identify::gait::IdentifiedGait;
use crate::recording::Recording;

fn seen(change: impl Fn(&mut Recording)) -> (Recording, IdentifiedGait) {
    let simulation = Simulation {
        cycles: 16.0,
        noise_m: 5e-5,
        ..Simulation::default()
    };
    crawl(&simulation, change)
}

fn drift_of(change: impl Fn(&mut Recording)) -> Option<f64> {
    let (recording, gait) = seen(change);
    drift(&recording.time_s, &recording.position_m, &gait).and_then(|found| found.rate)
}

#[test]
fn a_clock_that_runs_late_is_measured() {
    for rate in [1e-3, -2e-3] {
        let found = drift_of(|recording| {
            let times_s = recording.time_s.clone();
            for (phase, time_s) in recording.gait_phase.iter_mut().flatten().zip(times_s) {
                *phase += rate * time_s / 2.5;
            }
        });
        let found = found.expect("a drift");
        assert!((found / rate - 1.0).abs() < 0.1, "{found}, not {rate}");
    }
}

#[test]
fn a_lag_that_stays_is_no_drift() {
    assert_eq!(drift_of(|_| ()), None);
    let constant = |recording: &mut Recording| {
        recording
            .gait_phase
            .iter_mut()
            .flatten()
            .for_each(|phase| *phase += 0.012);
    };
    assert_eq!(drift_of(constant), None);
    // Late from the middle on: no clock does that.
    let step = |recording: &mut Recording| {
        recording
            .gait_phase
            .iter_mut()
            .flatten()
            .skip(2900)
            .for_each(|phase| *phase += 0.012);
    };
    assert_eq!(drift_of(step), None);
}
