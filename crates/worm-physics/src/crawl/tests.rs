//! The incremental motion against the exact one, its energy balance, and its limits.

mod agreement;
mod compliance;
mod convergence;
mod damper;
mod energy_balance;
mod memory;
mod play;
mod tables;

use crate::Worm;
use crate::effect::{Effect, LIBRARY, Parameter, Setting, named};

/// Time of a gait cycle, s.
const CYCLE_S: f64 = 2.5;

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
        .with_slope_rad(slope_deg.to_radians())
        .expect("a valid slope")
}

/// Every effect with a strong setting, on cell 2 if it needs a cell.
fn strong() -> Vec<Setting> {
    let setting = |effect: &&'static Effect| {
        let values: Vec<f64> = effect.parameters.iter().map(strong_value).collect();
        let cell = effect.name.starts_with("unequal").then_some(1);
        Setting::new(effect, cell, &values, 4).expect("in range")
    };
    LIBRARY.iter().map(setting).collect()
}

/// Fifteen times the notable change, on the side that the range allows; shape parameters keep their value.
fn strong_value(parameter: &Parameter) -> f64 {
    match parameter.name {
        "from_m" => 0.02,
        "length_m" | "time_constant_s" | "slip_m" | "grip_s" | "damping_n_s_per_m" => parameter.neutral,
        _ => {
            let strong = 15.0 * parameter.notable;
            let is_room_above = parameter.neutral + strong <= parameter.max;
            parameter.neutral + if is_room_above { strong } else { -strong }
        }
    }
}
