//! Effects of motor and sensor, which show in a recording and not in the motion.

use std::collections::BTreeMap;
use worm_analysis::experiment::{Simulation, simulate};
use worm_analysis::recording::Recording;
use worm_estimator::config::{Config, Effect};

/// Stroke of the paper's worm.
const STROKE_M: f64 = 11.5e-3;

/// Three cycles on the level with an effect, without noise.
fn recorded(effect: Option<(&str, &str, f64)>) -> Recording {
    let mut config = Config::default();
    config.effect.extend(effect.map(|(name, parameter, value)| Effect {
        name: name.to_owned(),
        cell: None,
        table: worm_estimator::config::TableFields::default(),
        parameters: BTreeMap::from([(parameter.to_owned(), value)]),
    }));
    let simulation = Simulation {
        cycles: 3.0,
        noise_m: 0.0,
        rest_s: 1.0,
        ..Simulation::default()
    };
    simulate(&config, &simulation).expect("it crawls")
}

#[test]
fn a_scaled_sensor_sees_every_length_scaled() {
    let (plain, scaled) = (recorded(None), recorded(Some(("sensor-scale", "scale", 1.05))));
    for (plain_m, scaled_m) in plain.position_m.concat().iter().zip(scaled.position_m.concat()) {
        assert!((1.05 * plain_m - scaled_m).abs() < 1e-15, "{plain_m} {scaled_m}");
    }
}

#[test]
fn a_late_sensor_sees_earlier_positions() {
    let late = 6;
    let (plain, delayed) = (
        recorded(None),
        recorded(Some(("sensor-latency", "latency_s", f64::from(late) / 120.0))),
    );
    assert_eq!(plain.gait_phase, delayed.gait_phase, "the phase is not late");
    for (plain_m, delayed_m) in plain.position_m.iter().zip(&delayed.position_m) {
        let pairs = plain_m.iter().zip(&delayed_m[late as usize..]);
        let apart_m = pairs
            .map(|(plain, delayed)| (plain - delayed).abs())
            .fold(0.0, f64::max);
        assert!(apart_m < 1e-12, "{apart_m}");
    }
}

/// A steady cycle takes T (1 + d F), F the positive work over all strokes: 54.88 mJ over 4 Ls by the independent simulation.
#[test]
fn a_drooping_motor_takes_longer_under_load() {
    let slowdown_per_n = 0.2;
    let recording = recorded(Some(("motor-droop", "slowdown_per_n", slowdown_per_n)));
    let phases = recording.gait_phase.expect("recorded");
    let passed_s = |phase: f64| {
        let after = phases.iter().position(|at| *at >= phase).expect("it gets there");
        let fraction = (phase - phases[after - 1]) / (phases[after] - phases[after - 1]);
        recording.time_s[after - 1] + fraction * (recording.time_s[after] - recording.time_s[after - 1])
    };
    let cycle_s = passed_s(2.5) - passed_s(1.5);
    let expected_s = 2.5 * (1.0 + slowdown_per_n * 54.88e-3 / (4.0 * STROKE_M));
    assert!((cycle_s - expected_s).abs() < 5e-3, "{cycle_s} s, not {expected_s} s");
    assert_eq!(phases.last(), Some(&3.0), "every cycle is made");
}
