//! The effects that the paper's theory leaves out: their settings, and each against a figure that was calculated without the model.

use std::f64::consts::PI;
use worm_physics::effect::{Setting, named};
use worm_physics::{Cycle, Physics, Worm, steady_cycle_of};

mod figures;
mod settings;

/// Time of a gait cycle, s.
const CYCLE_S: f64 = 2.5;
/// Stroke, largest tip deformation and stiffness of the paper's worm.
const STROKE_M: f64 = 11.5e-3;
const BOUND_M: f64 = 1.75e-3;
const STIFFNESS_N_PER_M: f64 = 980.0;

/// An effect of the whole worm.
fn effect(name: &str, values: &[f64]) -> Setting {
    of_cell(name, None, values)
}

fn of_cell(name: &str, cell: Option<usize>, values: &[f64]) -> Setting {
    Setting::new(named(name).expect("in the library"), cell, values, 6).expect("in range")
}

/// The paper's worm on a slope.
fn paper(slope_deg: f64) -> Worm {
    Worm::paper()
        .with_slope_rad(slope_deg * PI / 180.0)
        .expect("a valid slope")
}

fn steady(physics: &Physics, cycle_s: f64) -> Cycle {
    let outcome = steady_cycle_of(physics, cycle_s);
    outcome.cycle().unwrap_or_else(|| panic!("{outcome:?}")).clone()
}

/// The cycle of the paper's worm on a slope with effects.
fn with(slope_deg: f64, effects: &[Setting]) -> Cycle {
    steady(&Physics::of(paper(slope_deg)).with(effects), CYCLE_S)
}
