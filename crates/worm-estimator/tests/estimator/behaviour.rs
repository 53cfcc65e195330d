//! The estimator outside of the model: backward crawl, jammed cell, pauses, silence, restarts, invalid values.

use proptest::prelude::*;
use testkit::crawl::{Crawl, Scene, config_of, paper_worm};
use worm_estimator::config::Config;
use worm_estimator::estimate::Estimator;
use worm_estimator::message::{Cycle, Estimate, State};
use worm_physics::MAX_CELLS;
use worm_physics::Worm;

/// Runs a scene and collects the cycles.
fn crawl_cycles(crawl: &mut Crawl, estimator: &mut Estimator, seconds: f64) -> Vec<Cycle> {
    let ticks = (seconds * crawl.scene.tick_hz) as usize;
    (0..ticks)
        .filter_map(|_| {
            let state = crawl.tick();
            estimator.update(&state).cycle.copied()
        })
        .collect()
}

fn watch(worm: &Worm, scene: Scene) -> (Crawl, Estimator) {
    let estimator = Estimator::new(&config_of(worm, &scene)).expect("a valid configuration");
    (Crawl::new(worm.clone(), scene), estimator)
}

fn bytes_of(estimate: &Estimate) -> Vec<u64> {
    let cells = [
        estimate.position_m,
        estimate.contact_m,
        estimate.deformation_m,
        estimate.force_n,
        estimate.forward_slide_m,
        estimate.backward_slide_m,
    ];
    let totals = [estimate.energy_loss_j, estimate.energy_electrical_j, estimate.phase];
    cells
        .iter()
        .flatten()
        .chain(&totals)
        .map(|value| value.to_bits())
        .collect()
}

#[test]
fn a_backward_crawl_is_measured_like_a_forward_one() {
    let scene = Scene {
        cycles_per_s: -0.4,
        noise_m: 1e-4,
        ..Scene::default()
    };
    let worm = paper_worm(-20.0, true);
    let (mut crawl, mut estimator) = watch(&worm, scene);
    let cycles = crawl_cycles(&mut crawl, &mut estimator, 15.5);
    assert_eq!(cycles.len(), 6);
    for (index, cycle) in cycles.iter().enumerate().skip(1) {
        let (before, after) = (&crawl.milestones[index], &crawl.milestones[index + 1]);
        let truth = after.ledger.since(&before.ledger);
        assert_eq!((cycle.direction, cycle.settled, cycle.index), (-1, 1, index as u64));
        assert!((cycle.advance_m - (after.mean_m - before.mean_m)).abs() < 1.2e-4);
        assert!((cycle.energy_loss_j / truth.loss_j() - 1.0).abs() < 0.02);
        assert!((cycle.energy_actuator_positive_j / truth.actuator_positive_j - 1.0).abs() < 0.02);
        assert!(cycle.advance_m < 0.0 && (cycle.predicted_advance_m - cycle.advance_m).abs() < 2e-4);
        for cell in 0..4 {
            assert!((cycle.backward_slide_m[cell] - truth.backward_slide_m[cell]).abs() < 2e-4);
            assert!((cycle.predicted_backward_slide_m[cell] - truth.backward_slide_m[cell]).abs() < 2e-4);
        }
    }
}

#[test]
fn a_jammed_cell_shows_in_the_measurement() {
    let scene = Scene {
        noise_m: 1e-4,
        ..Scene::default()
    };
    let worm = paper_worm(0.0, false);
    let (mut crawl, mut estimator) = watch(&worm, scene);
    crawl_cycles(&mut crawl, &mut estimator, 10.1);
    crawl.worm = worm.with_stroke_scale(2, 0.4).expect("a share");
    let mut shortest_fraction: f64 = 1.0;
    let mut lead_at_start_m = f64::NAN;
    let mut cycles = Vec::new();
    for _ in 0..7_500 {
        let state = crawl.tick();
        let update = estimator.update(&state);
        cycles.extend(update.cycle.copied());
        let Some(estimate) = update.estimate else { continue };
        // (10): the motion of cell 3, the third to step, against the mean of the others since its step began.
        let fraction = (estimate.phase.fract() - 0.5) * 4.0;
        let x_m = &estimate.position_m;
        let lead_m = x_m[2] - (x_m[0] + x_m[1] + x_m[3]) / 3.0;
        if fraction < 0.0 {
            lead_at_start_m = lead_m;
        } else if (0.95..1.0).contains(&fraction) {
            shortest_fraction = shortest_fraction.min((lead_m - lead_at_start_m) / (0.0115 * fraction));
        }
    }
    assert!(
        (shortest_fraction - 0.4).abs() < 0.06,
        "extension (10) says {shortest_fraction}"
    );
    for cycle in cycles.iter().skip(1) {
        let index = cycle.index as usize;
        let truth = crawl.milestones[index + 1]
            .ledger
            .since(&crawl.milestones[index].ledger);
        assert!(
            (cycle.energy_loss_j / truth.loss_j() - 1.0).abs() < 0.03,
            "{cycle:?} {truth:?}"
        );
        assert!((cycle.energy_actuator_positive_j / truth.actuator_positive_j - 1.0).abs() < 0.03);
        assert!((cycle.forward_slide_m[2] - truth.forward_slide_m[2]).abs() < 2e-4);
        assert!(
            cycle.predicted_energy_loss_j > 1.1 * cycle.energy_loss_j,
            "the prediction is of the sound worm"
        );
    }
}

#[test]
fn a_pause_belongs_to_the_cycle_in_which_it_falls() {
    let (mut crawl, mut estimator) = watch(
        &paper_worm(30.0, false),
        Scene {
            noise_m: 1e-4,
            ..Scene::default()
        },
    );
    crawl_cycles(&mut crawl, &mut estimator, 6.0);
    crawl.paused = true;
    assert!(crawl_cycles(&mut crawl, &mut estimator, 3.0).is_empty());
    crawl.paused = false;
    let cycles = crawl_cycles(&mut crawl, &mut estimator, 4.5);
    let truth = crawl.milestones[3].ledger.since(&crawl.milestones[2].ledger);
    assert_eq!((cycles[0].index, cycles[0].settled), (2, 1));
    assert!((cycles[0].duration_s - 5.5).abs() < 0.2);
    assert!((cycles[0].energy_electrical_j - 0.5 * cycles[0].duration_s).abs() < 2e-3);
    assert!((cycles[0].energy_copper_j - 0.04 * 3.32 * cycles[0].duration_s).abs() < 1e-3);
    assert!((cycles[0].energy_loss_j / truth.loss_j() - 1.0).abs() < 0.02);
}

#[test]
fn silence_of_the_tracker_makes_contact_points_unknown_until_each_tip_has_stepped() {
    let (mut crawl, mut estimator) = watch(
        &paper_worm(0.0, false),
        Scene {
            noise_m: 1e-4,
            ..Scene::default()
        },
    );
    crawl_cycles(&mut crawl, &mut estimator, 5.8);
    assert!(estimator.latest().contact_m[..4].iter().all(|at| at.is_finite()));
    let mut unknown = 0;
    let mut cycles = Vec::new();
    for tick in 0..14_000 {
        let mut state = crawl.tick();
        if tick < 600 {
            state.sample_is_new = 0;
        }
        let update = estimator.update(&state);
        cycles.extend(update.cycle.copied());
        if let Some(estimate) = update.estimate {
            unknown = unknown.max(estimate.contact_m[..4].iter().filter(|at| at.is_nan()).count());
        }
    }
    assert_eq!(unknown, 4);
    assert_eq!(cycles[0].settled, 0);
    assert!(cycles[0].advance_m.is_nan() && cycles[0].energy_electrical_j > 0.0);
    // The next one began with contact points that were not known: a good guess, with honest standard errors.
    let index = cycles[1].index as usize;
    let truth = crawl.milestones[index + 1]
        .ledger
        .since(&crawl.milestones[index].ledger);
    let (error_j, sigma_j) = (cycles[1].energy_loss_j - truth.loss_j(), cycles[1].energy_loss_sigma_j);
    assert_eq!(cycles[1].settled, 0);
    assert!(
        error_j.abs() < 0.05 * truth.loss_j() && error_j.abs() < 2.0 * sigma_j,
        "{error_j} ± {sigma_j}"
    );
    assert!(cycles[2..].iter().all(|cycle| cycle.settled == 1));
}

#[test]
fn a_restarted_controller_begins_anew_and_totals_stay() {
    let (mut crawl, mut estimator) = watch(&paper_worm(0.0, false), Scene::default());
    crawl_cycles(&mut crawl, &mut estimator, 9.0);
    let before = *estimator.latest();
    let (mut again, _) = watch(
        &paper_worm(0.0, false),
        Scene {
            seed: 2,
            ..Scene::default()
        },
    );
    for _ in 0..100 {
        let mut state = again.tick();
        state.time_ns += 20_000_000_000;
        estimator.update(&state);
    }
    let after = estimator.latest();
    assert!(after.contact_m[..4].iter().all(|at| at.is_nan()));
    assert_eq!(after.forward_slide_m, before.forward_slide_m);
    assert!((after.energy_electrical_j - before.energy_electrical_j - 0.05).abs() < 2e-3);
    assert_eq!(after.states_lost, 0);
}

#[test]
fn a_replay_gives_the_same_bits() {
    let scene = Scene {
        outlier_fraction: 0.05,
        dropout_share: 0.1,
        ..Scene::default()
    };
    let (mut crawl, mut live) = watch(&paper_worm(30.0, true), scene.clone());
    let states: Vec<State> = (0..12_000).map(|_| crawl.tick()).collect();
    let (_, mut replayed) = watch(&paper_worm(30.0, true), scene);
    for state in &states {
        let (a, b) = (live.update(state), replayed.update(state));
        assert_eq!(a.estimate.map(bytes_of), b.estimate.map(bytes_of));
        assert_eq!(
            a.cycle.map(|cycle| format!("{cycle:?}")),
            b.cycle.map(|cycle| format!("{cycle:?}"))
        );
    }
}

#[test]
fn nothing_is_allocated_once_the_prediction_is_made() {
    let (mut crawl, mut estimator) = watch(&paper_worm(30.0, true), Scene::default());
    crawl_cycles(&mut crawl, &mut estimator, 3.0);
    let states: Vec<State> = (0..10_000).map(|_| crawl.tick()).collect();
    let mut cycles = 0;
    let info = allocation_counter::measure(|| {
        for state in &states {
            cycles += usize::from(estimator.update(state).cycle.is_some());
        }
    });
    assert_eq!((info.count_total, cycles), (0, 4));
}

#[test]
fn an_invalid_configuration_is_refused() {
    let mut config = Config::default();
    config.worm.cells = 1;
    assert!(Estimator::new(&config).is_err());
}

#[test]
fn the_count_of_lost_states_stays_at_its_end() {
    let (mut crawl, mut estimator) = watch(&paper_worm(0.0, false), Scene::default());
    for sequence in [0, u64::MAX / 2, 0, u64::MAX, 5, u64::MAX] {
        let state = State {
            sequence,
            ..crawl.tick()
        };
        estimator.update(&state);
    }
    for _ in 0..20 {
        estimator.update(&crawl.tick());
    }
    assert_eq!(estimator.latest().states_lost, u64::MAX);
}

#[test]
fn states_of_a_worm_with_another_number_of_cells_are_ignored() {
    let (mut crawl, mut estimator) = watch(&paper_worm(0.0, false), Scene::default());
    crawl_cycles(&mut crawl, &mut estimator, 3.0);
    let before = bytes_of(estimator.latest());
    for cell_count in [0, 3, 5, 16, u32::MAX] {
        for _ in 0..100 {
            let state = State {
                cell_count,
                ..crawl.tick()
            };
            let error = estimator.check(&state).expect_err("another worm").to_string();
            assert!(
                error.contains(&format!("{cell_count} cells")) && error.contains("worm.cells"),
                "{error}"
            );
            let update = estimator.update(&state);
            assert!(update.estimate.is_none() && update.cycle.is_none());
        }
    }
    assert_eq!(bytes_of(estimator.latest()), before);
    assert!(estimator.check(&crawl.tick()).is_ok());
}

/// Numbers as a broken device, file or peer may send them.
fn anything() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -2.0..2.0f64,
        1 => any::<f64>(),
        1 => Just(f64::NAN),
        1 => Just(f64::INFINITY),
        1 => Just(f64::MAX),
    ]
}

prop_compose! {
    fn any_state()(
        sequence in prop_oneof![0..400u64, any::<u64>()],
        time_ns in prop_oneof![0..4_000_000_000u64, any::<u64>()],
        numbers in proptest::array::uniform8(anything()),
        position_m in proptest::array::uniform4(anything()),
        valid_mask in any::<u32>(),
        flags in proptest::array::uniform2(0..3u32),
        cell_count in prop_oneof![4 => Just(4u32), 1 => any::<u32>()],
    ) -> State {
        let mut state = State::unknown(4);
        state.position_m = [f64::NAN; MAX_CELLS];
        state.position_m[..4].copy_from_slice(&position_m);
        State {
            sequence,
            time_ns,
            phase: numbers[0],
            motor_velocity_rad_s: numbers[1],
            motor_current_a: numbers[2],
            motor_duty: numbers[3],
            bus_voltage_v: numbers[4],
            sample_time_s: numbers[5],
            valid_mask,
            sample_is_new: flags[0],
            motor_is_new: flags[1],
            cell_count,
            ..state
        }
    }
}

proptest! {
    #[test]
    fn nonsense_is_survived_and_forgotten(nonsense in proptest::collection::vec(any_state(), 1..60)) {
        let scene = Scene { noise_m: 1e-4, ..Scene::default() };
        let (mut crawl, mut estimator) = watch(&paper_worm(0.0, false), scene);
        crawl_cycles(&mut crawl, &mut estimator, 1.0);
        for state in &nonsense {
            if let Some(cycle) = estimator.update(state).cycle {
                prop_assert!(!cycle.energy_electrical_sigma_j.is_nan());
            }
        }
        // After two whole valid cycles positions and energies are good again.
        let cycles = crawl_cycles(&mut crawl, &mut estimator, 9.0);
        let last = cycles.last().expect("cycles end again");
        prop_assert!((last.energy_loss_j / 46.88e-3 - 1.0).abs() < 0.05, "{last:?}");
        let latest = estimator.latest();
        for cell in 0..4 {
            prop_assert!((latest.position_m[cell] - crawl.motion.positions_m()[cell]).abs() < 1e-3);
            prop_assert!(latest.deformation_m[cell].abs() <= 1.75e-3);
        }
    }
}

/// A counter of a broken peer, which jumps ahead twice, is counted as far as it can be.
#[test]
fn a_sequence_that_jumps_to_its_end_twice_is_survived() {
    let (mut crawl, mut estimator) = watch(&paper_worm(0.0, false), Scene::default());
    for _ in 0..2 {
        for sequence in [0, u64::MAX - 1] {
            let state = crawl.tick();
            estimator.update(&State { sequence, ..state });
        }
    }
    assert_eq!(estimator.latest().states_lost, u64::MAX);
}
