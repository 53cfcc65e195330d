//! A worm, drawn: its cells, contacts, canal, gait, motor and what its tracker sees.

use crate::link::virtual_worm::body::{SCATTER_LIMIT, true_worm};
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use worm_estimator::config::{Config, ConfigError};
use worm_physics::{Worm, steady_cycle};

/// How often a worm is drawn anew that is not sound.
const ATTEMPTS: u32 = 100;
/// A worm that gains less of its stroke in a cycle does not progress, so that an alarm which says so is true.
const MIN_ADVANCE_FRACTION: f64 = 0.05;

/// Draws configurations until one is of a sound worm: it holds itself on its slope, and gets ahead in both directions.
///
/// # Errors
/// What is wrong with the last one; never seen with the ranges below.
pub fn draw(rng: &mut Xoshiro256PlusPlus) -> Result<Config, ConfigError> {
    let mut config = Err(ConfigError::Values {
        file: "drawn worm".into(),
        problems: Vec::new(),
    });
    for _ in 0..ATTEMPTS {
        config = Config::from_toml(&toml(rng), "drawn worm".as_ref());
        if config.as_ref().is_ok_and(gets_ahead) {
            break;
        }
    }
    config
}

/// Whether the worm as it is gets ahead in both directions, whatever scatter makes of its tips: the operator turns it round, what crawls
/// down may not climb, and near the steepest slope that a worm climbs one step with weaker tips takes back what the others gained.
fn gets_ahead(config: &Config) -> bool {
    let Ok(worm) = true_worm(config) else {
        return false;
    };
    let scatter = SCATTER_LIMIT * config.virtual_worm.scatter_share;
    // The cell that steps holds at its most, and the others hold it at their least.
    let at_worst = |stepping: usize| {
        let mut worm = worm.clone();
        for cell in 0..worm.cells() {
            let sense = if cell == stepping { 1.0 } else { -1.0 };
            worm.scale_friction(Some(cell), 1.0 + sense * scatter);
        }
        worm
    };
    let advances = |worm: &Worm| {
        let enough_m = MIN_ADVANCE_FRACTION * worm.stroke_m();
        steady_cycle(worm)
            .cycle()
            .is_some_and(|cycle| cycle.advance_m >= enough_m)
    };
    (0..worm.cells())
        .map(at_worst)
        .all(|worm| advances(&worm) && advances(&worm.mirrored()))
}

/// A number between, evenly on a logarithmic scale.
fn log_uniform(rng: &mut Xoshiro256PlusPlus, from: f64, to: f64) -> f64 {
    rng.random_range(from.ln()..to.ln()).exp()
}

fn toml(rng: &mut Xoshiro256PlusPlus) -> String {
    let cells: usize = rng.random_range(3..=6);
    // In a steeper canal most of these worms make next to no advance. Three cells hold less.
    let slopes: &[f64] = match cells {
        3 => &[0.0, 0.0, 10.0, 20.0],
        _ => &[0.0, 0.0, 10.0, 20.0, 30.0],
    };
    let slope_deg = slopes[rng.random_range(0..slopes.len())];
    let order: Vec<String> = (1..=cells).map(|cell| cell.to_string()).collect();
    let deformation_m = rng.random_range(0.0015..0.0019);
    let bounds: Vec<String> = (0..cells)
        .map(|_| format!("{:.6}", deformation_m * rng.random_range(0.85..1.15)))
        .collect();
    let bounds = format!("[{}]", bounds.join(", "));
    // Known bounds, or a first guess that the estimator has to improve, as after the first power-up.
    let (known, source) = if rng.random_bool(0.7) {
        (bounds.clone(), "measured")
    } else {
        (format!("{:.6}", 0.9 * deformation_m), "identified")
    };
    let noise_m = log_uniform(rng, 5e-5, 3e-4);
    let dropout_share = if rng.random_bool(0.5) {
        0.0
    } else {
        rng.random_range(0.0..0.1)
    };
    format!(
        "canal.slope_deg = {slope_deg}\n\
         gait.cycle_s = {cycle_s:.4}\n\
         gait.direction = \"{direction}\"\n\
         tracker.noise_m = {noise_m:.7}\n\
         servo.winding_resistance_ohm = {resistance:.3}\n\
         servo.torque_constant_n_m_per_a = {torque_constant:.4}\n\
         control.rate_hz = {rate_hz}\n\
         [worm]\n\
         cells = {cells}\n\
         step_order = [{order}]\n\
         mass_kg = {mass:.4}\n\
         stroke_m = {stroke:.5}\n\
         stiffness_n_per_m = {stiffness:.1}\n\
         max_deformation_m = {known}\n\
         max_deformation = \"{source}\"\n\
         [virtual_worm]\n\
         max_deformation_m = {bounds}\n\
         noise_m = {noise_m:.7}\n\
         dropout_share = {dropout_share:.4}\n\
         scatter_share = {scatter:.4}\n\
         inner_friction_n_m = {friction:.4}\n\
         inertia_kg_m2 = {inertia:.6}\n\
         ambient_c = {ambient:.1}\n",
        cycle_s = log_uniform(rng, 1.25, 10.0),
        direction = if rng.random_bool(0.8) { "forward" } else { "backward" },
        resistance = rng.random_range(3.0..3.6),
        torque_constant = rng.random_range(0.345..0.4),
        rate_hz = super::RATE_HZ,
        order = order.join(", "),
        mass = 0.083 * cells as f64 * rng.random_range(0.9..1.1),
        stroke = rng.random_range(0.0105..0.0135),
        stiffness = rng.random_range(850.0..1100.0),
        scatter = rng.random_range(0.0..0.015),
        friction = rng.random_range(0.0065..0.012),
        inertia = rng.random_range(1.5e-3..2.3e-3),
        ambient = rng.random_range(10.0..35.0),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A worm of the paper with three cells advances by 1.0 mm just below 44.43°, and loses 12.5 mm just above; downward it always crawls.
    #[test]
    fn a_worm_that_does_not_climb_or_only_just_does_is_not_sound() {
        for (slope_deg, scatter, is_sound) in [
            (40.0, 0.0, true),
            (44.3, 0.0, true),
            (44.3, 0.01, false),
            (44.5, 0.0, false),
        ] {
            for direction in ["forward", "backward"] {
                let text = format!(
                    "canal.slope_deg = {slope_deg}\ngait.direction = \"{direction}\"\nworm.cells = 3\n\
                     worm.step_order = [1, 2, 3]\nworm.mass_kg = 0.24975\nvirtual_worm.scatter_share = {scatter}\n"
                );
                let config = Config::from_toml(&text, "three cells".as_ref()).expect("a configuration");
                assert_eq!(
                    gets_ahead(&config),
                    is_sound,
                    "{slope_deg}°, {direction}, scatter {scatter}"
                );
            }
        }
    }
}
