//! The search against a brute force that knows nothing of it but the equations.

use super::{CANDIDATES, search};
use crate::experiment::{Simulation, simulate};
use crate::identify::{IdentifiedGait, Prior, gait};
use worm_estimator::config::Config;

fn recorded(simulation: Simulation) -> (Vec<Vec<f64>>, IdentifiedGait) {
    let config = Config::default();
    let recording = simulate(&config, &simulation).expect("the paper's worm crawls");
    let filled_m = recording.filled();
    let prior = Prior {
        step_order: &config.worm.step_order_from_zero(),
        phase: recording.gait_phase.as_deref(),
    };
    let gait = gait::find(&recording.time_s, &recording.position_m, &filled_m, prior).expect("a gait");
    (filled_m, gait)
}

fn noisy(cycles: f64, slope_deg: f64) -> (Vec<Vec<f64>>, IdentifiedGait) {
    recorded(Simulation {
        cycles,
        slope_deg,
        rate_hz: 40.0,
        seed: 7,
        max_deformation_m: Some(vec![2.0e-3, 1.1e-3, 1.75e-3, 2.15e-3]),
        ..Simulation::default()
    })
}

/// The balance (5) of one combination over the whole cycles after the first: mean and standard deviation of the force, N.
fn balance(
    position_m: &[Vec<f64>],
    gait: &IdentifiedGait,
    bounds_m: &[f64],
    stiffness_n_per_m: &[f64],
    pull_n: f64,
) -> (f64, f64) {
    let cells = position_m.len();
    let whole_cycles = (gait.phase.last().expect("samples") - gait.phase[0] - 1.0).floor();
    let mut tips_m: Vec<Option<f64>> = vec![None; cells];
    let mut forces_n = Vec::new();
    for (sample, phase) in gait.phase.iter().enumerate() {
        let step = |sample: usize| (gait.phase[sample] * cells as f64).floor();
        let mut force_n = pull_n;
        for cell in 0..cells {
            let (at_m, bound_m) = (position_m[cell][sample], bounds_m[cell]);
            let ended = sample > 0
                && step(sample) > step(sample - 1)
                && gait.step_order[step(sample - 1) as usize % cells] == cell;
            if ended {
                tips_m[cell] = Some(at_m - bound_m); // (1)
            }
            if let Some(tip_m) = &mut tips_m[cell] {
                *tip_m = tip_m.clamp(at_m - bound_m, at_m + bound_m); // (2, 3)
                force_n += stiffness_n_per_m[cell] * (at_m - *tip_m); // (4)
            }
        }
        let cycles = phase - gait.phase[0];
        if cycles >= 1.0 && cycles < 1.0 + whole_cycles {
            forces_n.push(force_n);
        }
    }
    let count = forces_n.len() as f64;
    let mean_n = forces_n.iter().sum::<f64>() / count;
    let variance = forces_n.iter().map(|force_n| (force_n - mean_n).powi(2)).sum::<f64>() / count;
    (mean_n, variance.sqrt())
}

/// All combinations of seven candidates a cell, one after the other: bounds, mean and standard deviation of the best.
fn brute_force(
    position_m: &[Vec<f64>],
    gait: &IdentifiedGait,
    first_m: &[f64],
    stiffness_n_per_m: &[f64],
    pull_n: f64,
) -> (Vec<f64>, f64, f64) {
    let mut best = (f64::INFINITY, (Vec::new(), f64::NAN, f64::NAN));
    for combination in 0..7_usize.pow(first_m.len() as u32) {
        let bounds_m: Vec<f64> = first_m
            .iter()
            .enumerate()
            .map(|(cell, first_m)| {
                let candidate = combination / 7_usize.pow(cell as u32) % 7;
                (first_m + (candidate as f64 - 3.0) * 1e-4).max(5e-5)
            })
            .collect();
        let (mean_n, std_n) = balance(position_m, gait, &bounds_m, stiffness_n_per_m, pull_n);
        let square = mean_n * mean_n + std_n * std_n;
        if square < best.0 {
            best = (square, (bounds_m, mean_n, std_n));
        }
    }
    best.1
}

#[test]
fn the_search_finds_what_brute_force_finds() {
    let on_a_slope_n = 0.333 * 9.81 * 30_f64.to_radians().sin();
    let by_eye_m = [1.9e-3, 1.4e-3, 2.05e-3, 2.15e-3];
    let cases = [
        (0.0, 0.0, by_eye_m, [980.0; 4]),
        (30.0, on_a_slope_n, by_eye_m, [980.0, 900.0, 1050.0, 700.0]),
        (0.0, 0.0, [1e-4, 5e-5, 2e-4, 3e-4], [980.0; 4]), // candidates below the smallest
    ];
    for (slope_deg, pull_n, first_m, stiffness_n_per_m) in cases {
        let (position_m, gait) = noisy(4.0, slope_deg);
        let found = search(&position_m, &gait, &first_m, &stiffness_n_per_m, pull_n).expect("four cycles");
        let (bounds_m, mean_n, std_n) = brute_force(&position_m, &gait, &first_m, &stiffness_n_per_m, pull_n);
        assert_eq!(found.max_deformation_m, bounds_m, "slope {slope_deg}°");
        assert_eq!(found.candidates, 2401);
        assert!((found.mean_force_n - mean_n).abs() < 1e-9, "{found:?}, mean {mean_n} N");
        assert!((found.force_std_n - std_n).abs() < 1e-9, "{found:?}, std {std_n} N");
    }
}

#[test]
fn there_is_nothing_to_search_without_a_whole_cycle_or_with_too_many_cells() {
    let (position_m, mut gait) = noisy(4.0, 0.0);
    let count = gait.phase.partition_point(|&phase| phase < 1.99);
    let cut: Vec<Vec<f64>> = position_m.iter().map(|series| series[..count].to_vec()).collect();
    let whole = gait.clone();
    gait.phase.truncate(count);
    assert_eq!(search(&cut, &gait, &[2e-3; 4], &[980.0; 4], 0.0), None);

    let unseen = vec![vec![f64::NAN; whole.phase.len()]; 4];
    assert_eq!(search(&unseen, &whole, &[2e-3; 4], &[980.0; 4], 0.0), None);

    let eight = [position_m.clone(), position_m].concat();
    let order = IdentifiedGait {
        step_order: (0..8).collect(),
        ..whole
    };
    assert_eq!(search(&eight, &order, &[2e-3; 8], &[980.0; 8], 0.0), None);
    assert_eq!(CANDIDATES, 7, "2401 candidates for four cells, as in the paper");
}
