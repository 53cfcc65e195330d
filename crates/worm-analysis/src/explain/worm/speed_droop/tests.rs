use super::*;
use crate::experiment::RecordedRun;
use crate::explain::search::hypothesis::Hypothesis;
use crate::explain::worm::nuisance::Nuisance;
use crate::explain::worm::pace::Pace;
use crate::recording::Recording;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use worm_physics::{Physics, Worm};

const CYCLE_S: f64 = 2.5;
const RATE_HZ: f64 = 120.0;
const SLOPES_DEG: [f64; 3] = [0.0, 30.0, 45.0];

fn physics(slope_deg: f64) -> Physics {
    let worm = Worm::paper()
        .with_slope_rad(slope_deg.to_radians())
        .expect("a slope that the paper's worm holds on");
    Physics::of(worm)
}

/// Twelve cycles of a motor with swings of its own, 3 % slower than ordered, that rests after each cycle; the phases at 120 Hz.
fn turned(force_n: &[f64], per_n: f64, rest_s: f64, rng: &mut Xoshiro256PlusPlus) -> (Vec<f64>, Vec<f64>) {
    let swings = [rng.random_range(0.0..0.1), rng.random_range(0.0..0.05)];
    let angles: [f64; 5] = std::array::from_fn(|_| rng.random_range(0.0..TAU));
    let parts = force_n.len() as f64;
    let cells = parts / PARTS as f64;
    let (mut phase, mut rest_until_s) = (0.0, 0.3);
    let (mut time_s, mut phases) = (Vec::new(), Vec::new());
    let fine = 10;
    for tick in 0.. {
        let now_s = tick as f64 / (RATE_HZ * fine as f64);
        if tick % fine == 0 {
            time_s.push(now_s);
            phases.push(phase);
        }
        if phase >= 12.0 {
            break;
        }
        if now_s < rest_until_s {
            continue;
        }
        let slow: f64 = [0.071, 0.193, 0.417]
            .iter()
            .zip(&angles)
            .map(|(hz, angle)| 0.01 * (TAU * hz * now_s + angle).sin())
            .sum();
        let swing = swings[0] * (TAU * phase * cells + angles[3]).sin() + swings[1] * (TAU * phase + angles[4]).sin();
        let speed_droop = 1.0 + per_n * force_n[(phase * parts) as usize % force_n.len()];
        let before: f64 = phase;
        phase += 0.97 * (1.0 + slow + swing) / speed_droop / CYCLE_S / (RATE_HZ * fine as f64);
        if phase.floor() > before.floor() {
            rest_until_s = now_s + rest_s;
        }
    }
    (time_s, phases)
}

fn recording(time_s: Vec<f64>) -> Recording {
    Recording {
        source: "test".into(),
        cell_names: Vec::new(),
        time_s,
        position_m: Vec::new(),
        gait_phase: None,
        motor: None,
        warnings: Vec::new(),
        repairs: Vec::new(),
    }
}

/// What is found in the times of three runs of one motor.
fn found(per_n: f64, rest_s: f64, seed: u64) -> SpeedDroop {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let nominal: Vec<Physics> = SLOPES_DEG.iter().map(|&slope_deg| physics(slope_deg)).collect();
    let cells = nominal[0].worm.cells();
    let first_m: Vec<f64> = (0..cells).rev().map(|behind| 0.04 * behind as f64).collect();
    let hypothesis = Hypothesis::new(&Nuisance::all(cells, SLOPES_DEG.len(), true), &[]);
    let fit = Fit {
        at: hypothesis.neutral(),
        hypothesis,
        residual: Vec::new(),
        jacobian: Vec::new(),
        chi_squared: 0.0,
        converged: true,
    };
    let recordings: Vec<Recording> = vec![recording(Vec::new()); SLOPES_DEG.len()];
    let observed = |recording, phase: Vec<f64>| Observed {
        repairs: Vec::new(),
        run: RecordedRun::at_slope(recording, 0.0),
        position_m: vec![vec![0.0; phase.len()]; cells],
        phase,
        phase_recorded: true,
        step_order: (0..cells).collect(),
        first_m: first_m.clone(),
        sees_positions: true,
        noise_m: 1e-4,
        may_be_laid_down: true,
        laid_down: true,
        counts_from: 0,
        cycle_s: CYCLE_S,
        pauses: false,
        pace: Pace::default(),
        settled: None,
        torque: None,
    };
    let still = Scene {
        observed: recordings
            .iter()
            .map(|recording| observed(recording, vec![0.0]))
            .collect(),
        nominal: nominal.clone(),
    };
    let turned: Vec<(Recording, Vec<f64>)> = (0..SLOPES_DEG.len())
        .map(|run| {
            let (force_n, _) = forces(&still, run, &fit).expect("the worm holds");
            let (time_s, phase) = turned(&force_n, per_n, rest_s, &mut rng);
            (recording(time_s), phase)
        })
        .collect();
    let scene = Scene {
        observed: turned
            .iter()
            .map(|(recording, phase)| observed(recording, phase.clone()))
            .collect(),
        nominal,
    };
    speed_droop(&scene, &fit, &[CYCLE_S; SLOPES_DEG.len()]).expect("three runs of twelve cycles")
}

#[test]
fn a_motor_that_droops_is_found_with_its_value() {
    for (per_n, rest_s) in [(0.05, 0.0), (0.2, 0.0), (0.05, 2.0)] {
        for seed in 0..5 {
            let speed_droop = found(per_n, rest_s, seed);
            assert!(
                speed_droop.improvement > 6.0,
                "{per_n} at rest for {rest_s} s: {speed_droop:?}"
            );
            let off = (speed_droop.slowdown_per_n - per_n) / speed_droop.sigma;
            assert!(off.abs() < 2.5, "{per_n} at rest for {rest_s} s: {speed_droop:?}");
        }
    }
}

#[test]
fn an_uneven_motor_is_no_drooping_one() {
    for seed in 0..50 {
        let speed_droop = found(0.0, 0.0, seed);
        assert!(speed_droop.improvement < 4.0, "seed {seed}: {speed_droop:?}");
    }
}
