//! Friction over speed and load by the torque balance, and what the model makes of it.

use super::answer::{FrictionCell, FrictionPlace};
use super::recorded_servo::RecordedServo;
use super::torque_balance::moments;
use std::collections::BTreeMap;
use worm_physics::servo::ServoPhysics;

/// Ranges of the speed, rad/s, and of the load, N m.
pub(super) const SPEEDS_RAD_S: [f64; 5] = [0.15, 0.6, 2.0, 5.0, 15.0];
pub(super) const LOADS_N_M: [f64; 8] = [0.0, 0.05, 0.1, 0.17, 0.25, 0.35, 0.5, 0.8];
/// Seconds of all runs that must show a cell, and readings in each.
const MIN_SECONDS: usize = 3;
const MIN_READINGS: usize = 5;
/// Significance from which a place is listed.
const SIGNIFICANT: f64 = 3.0;

/// What one second of a run shows of a cell.
#[derive(Default)]
struct Second {
    readings: f64,
    measured: f64,
    model: f64,
    load: f64,
}

/// The cells that the campaign shows, by some physics.
pub(super) fn map(servo: &RecordedServo<'_>, physics: &ServoPhysics) -> Vec<FrictionCell> {
    let mut seconds: BTreeMap<(usize, usize), BTreeMap<(usize, usize), Second>> = BTreeMap::new();
    for (run, _) in servo.observed.iter().enumerate() {
        for moment in moments(servo, run, physics) {
            let place = |edges: &[f64], value: f64| {
                let above = edges.partition_point(|edge| *edge <= value);
                (1..edges.len()).contains(&above).then(|| above - 1)
            };
            let speed = moment.velocity_rad_s.abs();
            let load = moment.on_gears_n_m();
            let Some(cell) = place(&SPEEDS_RAD_S, speed).zip(place(&LOADS_N_M, load)) else {
                continue;
            };
            let second = seconds
                .entry(cell)
                .or_default()
                .entry((run, moment.second))
                .or_default();
            second.readings += 1.0;
            second.measured += moment.friction_n_m;
            second.model += moment.friction_of(physics);
            second.load += load;
        }
    }
    let cells = seconds.into_iter().filter_map(|((speed, load), seconds)| {
        let seconds: Vec<((usize, usize), Second)> = seconds
            .into_iter()
            .filter(|(_, second)| second.readings >= MIN_READINGS as f64)
            .collect();
        if seconds.len() < MIN_SECONDS {
            return None;
        }
        let sum = |of: &dyn Fn(&Second) -> f64| seconds.iter().map(|(_, second)| of(second)).sum::<f64>();
        let readings = sum(&|second| second.readings);
        let mean = |of: &dyn Fn(&Second) -> f64| sum(of) / readings;
        let (measured, model) = (mean(&|second| second.measured), mean(&|second| second.model));
        // Neighbouring readings are not independent, seconds nearly are.
        let off = measured - model;
        let squares = sum(&|second| (second.measured - second.model - off * second.readings).powi(2));
        let count = seconds.len() as f64;
        let sigma = (squares * count / (count - 1.0)).sqrt() / readings;
        let most = seconds.iter().max_by(|a, b| a.1.readings.total_cmp(&b.1.readings));
        Some(FrictionCell {
            speed_rad_s: [SPEEDS_RAD_S[speed], SPEEDS_RAD_S[speed + 1]],
            load_n_m: [LOADS_N_M[load], LOADS_N_M[load + 1]],
            mean_load_n_m: mean(&|second| second.load),
            measured_n_m: measured,
            sigma_n_m: sigma,
            model_n_m: model,
            run: most.map_or(0, |((run, _), _)| *run),
        })
    });
    cells.collect()
}

/// Where friction is not the model's, most significant first.
pub(super) fn places(servo: &RecordedServo<'_>, map: &[FrictionCell]) -> Vec<FrictionPlace> {
    let place = |cell: &FrictionCell| {
        let residual_n_m = cell.measured_n_m - cell.model_n_m;
        FrictionPlace {
            speed_rad_s: cell.speed_rad_s,
            load_n_m: cell.load_n_m,
            residual_n_m,
            significance: residual_n_m / cell.sigma_n_m,
            trajectory: servo.observed[cell.run].trajectory_name.clone(),
            position_p_gain: servo.observed[cell.run].gain,
        }
    };
    let mut places: Vec<FrictionPlace> = map.iter().map(place).collect();
    places.retain(|place| place.significance.abs() > SIGNIFICANT);
    places.sort_by(|a, b| b.significance.abs().total_cmp(&a.significance.abs()));
    places
}
