//! The laws beyond the paper's theory: both motions against each other, the books, and every effect against a figure that was worked
//! out without the model.

use std::f64::consts::PI;
use worm_physics::effect::{Effect, LIBRARY, Setting, named};
use worm_physics::{Cycle, Physics, Worm, steady_cycle_of};

mod agreement;
mod books;
mod figures;
mod limits;
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

/// Every effect, strong, of cell 2 where one is meant.
fn strong() -> Vec<Setting> {
    let setting = |effect: &&'static Effect| {
        let values: Vec<f64> = effect.parameters.iter().map(strong_value).collect();
        let cell = effect.name.starts_with("unequal").then_some(1);
        Setting::new(effect, cell, &values, 4).expect("in range")
    };
    LIBRARY.iter().map(setting).collect()
}

/// Fifteen times what is just noticed, to the side where there is room for it, but for places.
fn strong_value(parameter: &worm_physics::effect::Parameter) -> f64 {
    match parameter.name {
        "from_m" => 0.02,
        "length_m" | "time_constant_s" | "slip_m" | "grip_s" => parameter.neutral,
        _ => {
            let strong = 15.0 * parameter.notable;
            let is_room_above = parameter.neutral + strong <= parameter.max;
            parameter.neutral + if is_room_above { strong } else { -strong }
        }
    }
}
