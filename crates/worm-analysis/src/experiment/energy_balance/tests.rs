//! The account of a crawl that theory made, against the model's own ledger of the same crawl.

use super::{EnergyBalance, follow};
use crate::experiment::{Simulation, simulate};
use crate::identify::theory::TheoryBody;
use crate::identify::{FittedRun, Prior, gait};
use crate::recording::Recording;
use worm_estimator::config::Config;
use worm_physics::{Motion, Worm};

/// Damping that leaves no swing.
const NO_SWING: f64 = 100.0;
const BOUNDS_M: [f64; 4] = [2.0e-3, 1.1e-3, 1.75e-3, 2.15e-3];

fn recorded(slope_deg: f64, cycles: f64) -> (Recording, Worm) {
    let simulation = Simulation {
        slope_deg,
        cycles,
        noise_m: 0.0,
        max_deformation_m: Some(BOUNDS_M.to_vec()),
        ..Simulation::default()
    };
    let config = Config::default();
    let worm = Worm::try_from(&config)
        .and_then(|worm| worm.with_slope_rad(slope_deg.to_radians()))
        .and_then(|worm| worm.with_max_deformations_m(&BOUNDS_M))
        .expect("a worm");
    (simulate(&config, &simulation).expect("it crawls"), worm)
}

/// The account with the truth in the place of a fit: bounds, start and a drift of 0.
fn balance(recording: &Recording, worm: &Worm) -> EnergyBalance {
    let prior = Prior {
        step_order: worm.step_order(),
        phase: recording.gait_phase.as_deref(),
    };
    let gait = gait::find(&recording.time_s, &recording.position_m, &recording.filled(), prior).expect("a gait");
    let laid_down_m = -worm.pull_n() / (4.0 * 980.0);
    let mut body = TheoryBody::at_rest(worm, gait.phase[0], &[laid_down_m; 4], NO_SWING);
    let theory_m = (0..recording.samples())
        .map(|sample| body.go_to(gait.phase[sample], 1.0 / 120.0).expect("it holds"))
        .collect();
    let fitted = FittedRun {
        worm: worm.clone(),
        start_deformation_m: vec![laid_down_m; 4],
        laid_down: true,
        drift_per_cycle_m: 0.0,
        theory_m,
        drift_m: vec![0.0; recording.samples()],
    };
    follow(recording, &gait, &fitted, NO_SWING, worm.mass_kg()).expect("it holds")
}

#[test]
fn cycles_sum_up_to_the_ledger_of_the_model() {
    for slope_deg in [0.0, 20.0, 35.0] {
        let (recording, worm) = recorded(slope_deg, 6.0);
        let balance = balance(&recording, &worm);
        let mut motion = Motion::at_rest(&worm, &[0.0; 4]);
        motion.advance_to(&worm, 6.0).expect("it holds");
        let ledger = motion.ledger();
        let sum = |of: &dyn Fn(&super::CycleValues) -> f64| -> f64 {
            balance.cycles.iter().map(|cycle| of(&cycle.values)).sum()
        };
        let mut pairs = vec![
            ("(11)", sum(&|values| values.energy_loss_j), ledger.loss_j()),
            (
                "(13) net",
                sum(&|values| values.energy_actuator_net_j),
                ledger.actuator_net_j,
            ),
            (
                "(13) positive",
                sum(&|values| values.energy_actuator_positive_j),
                ledger.actuator_positive_j,
            ),
            ("advance", sum(&|values| values.advance_m), motion.mean_position_m()),
        ];
        for cell in 0..4 {
            let forward_m = sum(&|values| values.forward_slide_m[cell]);
            pairs.push(("forward slide", forward_m, ledger.forward_slide_m[cell]));
            let backward_m = sum(&|values| values.backward_slide_m[cell]);
            pairs.push(("backward slide", backward_m + 0.1, ledger.backward_slide_m[cell] + 0.1));
        }
        assert_eq!(balance.cycles.len(), 6);
        for (name, found, true_value) in pairs {
            let off = (found / true_value - 1.0).abs();
            assert!(off < 3e-3, "{slope_deg}°: {name} is {found}, not {true_value}");
        }
    }
}

/// The last sample of a recording hardly ever falls on the end of a cycle.
#[test]
fn a_cycle_cut_by_less_than_a_sample_counts_and_one_cut_by_more_does_not() {
    let sample_cycles = 1.0 / 300.0;
    for (short_samples, expected) in [(0.0, 5), (0.4, 5), (0.9, 5), (3.0, 4)] {
        let (recording, worm) = recorded(0.0, 5.0 - short_samples * sample_cycles);
        let cycles = balance(&recording, &worm).cycles;
        assert_eq!(cycles.len(), expected, "{short_samples} samples short");
        let settled: Vec<bool> = cycles.iter().map(|cycle| cycle.settled).collect();
        assert!(
            !settled[0] && settled[1..].iter().all(|&settled| settled),
            "{settled:?}"
        );
        for cycle in &cycles {
            assert!((cycle.duration_s - 2.5).abs() < 0.01, "{cycle:?}");
        }
    }
}
