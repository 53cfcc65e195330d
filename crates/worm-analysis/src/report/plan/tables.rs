//! Tables of a plan.

use super::time_unit;
use crate::report::page::Table;
use worm_estimator::number::{NONE, fixed, percent, shortest, significant};
use worm_plan::{Candidate, Interval, Plan, Trip};

/// Most designs of the trade-off that a table lists, evenly spread.
const MAX_FRONT_ROWS: usize = 20;

/// A design in words.
pub(super) fn design(trip: &Trip) -> String {
    let design = &trip.design;
    format!(
        "{} cells of {} N/mm, {} s a cycle, stepping {}",
        design.cells,
        shortest(trip.stiffness_n_per_m * 1e-3),
        shortest(design.cycle_s),
        order(&design.step_order)
    )
}

fn order(cells: &[usize]) -> String {
    cells.iter().map(usize::to_string).collect::<Vec<_>>().join("-")
}

fn with_bounds(value: Option<Interval>, scale: f64) -> String {
    value.map_or(NONE.to_owned(), |value| {
        let [mean, low, high] = [value.mean, value.low, value.high].map(|value| significant(value * scale, 3));
        format!("{mean} ({low} to {high})")
    })
}

/// Leg by leg, and in all.
pub(super) fn legs(name: &str, trip: &Trip) -> Table {
    let (unit, per_s) = time_unit(trip.time_s);
    let time = format!("time, {unit}");
    let mut table = Table::new(
        format!("Legs of {name}: {}. 90 % intervals in brackets", design(trip)),
        [
            "leg",
            "m",
            "slope",
            "mm a cycle",
            &time,
            "energy, J",
            "charge left, %",
            "arrives",
            "fails because",
        ],
    );
    for (number, leg) in (1..).zip(&trip.legs) {
        let is_first_failure = trip.failed_leg == Some(number);
        table.rows.push(vec![
            number.to_string(),
            shortest(leg.leg.length_m),
            format!("{}°", shortest(leg.leg.slope_deg)),
            scaled(leg.advance_per_cycle_m, 1e3, 2),
            with_bounds(leg.time_s, per_s),
            with_bounds(leg.energy_j, 1.0),
            with_bounds(leg.charge_left_share, 100.0),
            percent(leg.arrival_probability),
            match leg.failure {
                Some(failure) if is_first_failure => failure.to_string(),
                Some(_) => "not reached".to_owned(),
                None => String::new(),
            },
        ]);
    }
    table.rows.push(vec![
        "all".to_owned(),
        shortest(trip.length_m),
        String::new(),
        String::new(),
        with_bounds(trip.time_s, per_s),
        with_bounds(trip.energy_j, 1.0),
        with_bounds(trip.charge_left_share, 100.0),
        percent(trip.arrival_probability),
        String::new(),
    ]);
    table
}

/// The trade-off.
pub(super) fn front(plan: &Plan) -> Table {
    let front = &plan.search.front;
    let mut table = Table::new(
        "The trade-off: no design is faster for less energy",
        ["time, min", "energy, J", "cells", "N/mm", "cycle, s", "order"],
    );
    let rows = front.len().min(MAX_FRONT_ROWS);
    let spread = |row: usize| row * front.len().saturating_sub(1) / rows.saturating_sub(1).max(1);
    table.rows = (0..rows)
        .filter_map(|row| front.get(spread(row)))
        .map(front_row)
        .collect();
    table.note = (front.len() > rows).then(|| format!("{rows} of {}; plan.json has all", front.len()));
    table
}

fn front_row(candidate: &Candidate) -> Vec<String> {
    vec![
        fixed(candidate.time_s / 60.0, 1),
        significant(candidate.energy_j, 4),
        candidate.design.cells.to_string(),
        shortest(candidate.stiffness_n_per_m * 1e-3),
        shortest(candidate.design.cycle_s),
        order(&candidate.design.step_order),
    ]
}

/// The check.
pub(super) fn inertia(plan: &Plan) -> Table {
    let of = if plan.best.is_some() {
        "the best design"
    } else {
        "the configured worm"
    };
    let mut table = Table::new(
        format!("The worm with inertia beside the exact motion, for {of}, per cycle"),
        [
            "slope",
            "mm",
            "mm with inertia",
            "difference, %",
            "mJ",
            "mJ with inertia",
            "difference, %",
        ],
    );
    for check in &plan.inertia_check {
        table.rows.push(vec![
            format!("{}°", shortest(check.slope_deg)),
            scaled(check.advance_m, 1e3, 3),
            scaled(check.inertial_advance_m, 1e3, 3),
            scaled(check.advance_difference, 100.0, 2),
            scaled(check.energy_j, 1e3, 1),
            scaled(check.inertial_energy_j, 1e3, 1),
            scaled(check.energy_difference, 100.0, 2),
        ]);
    }
    table
}

/// A figure in the unit of its column, or none.
fn scaled(value: Option<f64>, scale: f64, decimals: usize) -> String {
    fixed(value.map_or(f64::NAN, |value| value * scale), decimals)
}
