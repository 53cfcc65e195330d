//! The first estimate on recordings on which the paper's assumption is exact: equal cells on the level, no noise.

use super::find;
use crate::experiment::{Simulation, simulate};
use crate::identify::{Prior, gait};
use worm_estimator::config::{Config, PerCell};

#[test]
fn on_the_level_equal_cells_show_their_bound() {
    for (cells, bound_m) in [(3, 1.0e-3), (4, 0.8e-3), (4, 1.75e-3), (4, 2.5e-3), (6, 1.75e-3)] {
        let mut config = Config::default();
        config.worm.cells = cells;
        config.worm.step_order = (1..=cells).collect();
        config.worm.max_deformation_m = PerCell::Same(bound_m);
        // Long enough that the first cycle, which begins with tips laid down, weighs little.
        let simulation = Simulation {
            cycles: 40.0,
            noise_m: 0.0,
            ..Simulation::default()
        };
        let recording = simulate(&config, &simulation).expect("it crawls");
        let prior = Prior {
            step_order: &config.worm.step_order_from_zero(),
            phase: recording.gait_phase.as_deref(),
        };
        let gait = gait::find(&recording.time_s, &recording.position_m, &recording.filled(), prior).expect("a gait");
        let retraction_m = 2.0 * bound_m / (cells as f64 - 1.0);
        for (cell, onset) in find(&gait).iter().enumerate() {
            let context = format!("{cells} cells, {bound_m} m, cell {cell}: {onset:?}");
            assert!((onset.max_deformation_m / bound_m - 1.0).abs() < 0.03, "{context}");
            assert!((onset.retraction_m / retraction_m - 1.0).abs() < 0.05, "{context}");
        }
    }
}
