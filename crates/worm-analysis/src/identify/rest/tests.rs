//! A camera that drifts, seen by a worm that rests.

use super::drift;
use crate::experiment::Simulation;
use crate::identify::fixture::crawl;

/// The drift found where all positions drift by a speed, m/s.
fn found(rest_s: f64, positions_only: bool, shift_m: impl Fn(f64) -> f64) -> Option<f64> {
    let simulation = Simulation {
        cycles: 6.0,
        noise_m: 5e-5,
        rest_s,
        positions_only,
        ..Simulation::default()
    };
    let (recording, gait) = crawl(&simulation, |recording| {
        for series in &mut recording.position_m {
            for (at_m, &time_s) in series.iter_mut().zip(&recording.time_s) {
                *at_m += shift_m(time_s);
            }
        }
    });
    drift(&recording.time_s, &gait).and_then(|found| found.rate)
}

#[test]
fn only_rests_show_a_camera_that_drifts() {
    for positions_only in [false, true] {
        let found = |rest_s, m_per_s: f64| found(rest_s, positions_only, |time_s| m_per_s * time_s);
        let rate = found(3.0, 1e-4).expect("two rests show it");
        assert!((rate / 1e-4 - 1.0).abs() < 0.2, "{rate}");
        assert_eq!(found(3.0, 0.0), None);
        assert_eq!(found(0.0, 1e-4), None, "without rests it is the advance");
    }
}

#[test]
fn what_comes_to_rest_is_no_drift() {
    let settling = |time_s: f64| 1e-3 * (-time_s / 2.0).exp() + 1e-3 * (-(time_s - 18.0).max(0.0) / 2.0).exp();
    assert_eq!(found(3.0, false, settling), None);
}
