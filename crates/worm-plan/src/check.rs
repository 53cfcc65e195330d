//! The worm with inertia against the exact motion.
//!
//! Planning rests on the exact motion, which has neither inertia nor damping. The incremental motion has both; its steady cycle at the
//! design's own speed says what the exact one left out.

use super::design::{Design, Workbench};
use super::route::Route;
use serde::Serialize;
use worm_physics::{Crawl, MAX_CELLS, Mechanics, driven_cycle};

/// Damping ratio of the body, as identified from recordings.
const DAMPING_RATIO: f64 = 0.1;
/// Gait cycles from rest before the one that counts.
const CYCLES_BEFORE: u32 = 10;

/// Both motions on one slope. What is absent (null in JSON) slides down.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InertiaCheck {
    /// Slope, degrees.
    pub slope_deg: f64,
    /// Advance per cycle by the exact motion, m.
    pub advance_m: Option<f64>,
    /// Advance per cycle with inertia, m.
    pub inertial_advance_m: Option<f64>,
    /// The latter over the former, less 1.
    pub advance_difference: Option<f64>,
    /// Positive actuator work per cycle by the exact motion, J.
    pub energy_j: Option<f64>,
    /// The same with inertia, J.
    pub inertial_energy_j: Option<f64>,
    /// The latter over the former, less 1.
    pub energy_difference: Option<f64>,
}

/// Both motions of a design on every slope of a route.
pub fn check(bench: &Workbench, design: &Design, route: &Route) -> Vec<InertiaCheck> {
    let (slopes_deg, _) = route.slopes();
    slopes_deg
        .into_iter()
        .map(|slope_deg| on_slope(bench, design, slope_deg))
        .collect()
}

fn on_slope(bench: &Workbench, design: &Design, slope_deg: f64) -> InertiaCheck {
    let physics = bench.physics(design, slope_deg);
    let exact = physics
        .as_ref()
        .and_then(|physics| driven_cycle(physics, design.cycle_s).ok())
        .map(|(cycle, _)| (cycle.advance_m, cycle.energy_actuator_positive_j));
    let inertial = physics.as_ref().and_then(|physics| {
        let mechanics = Mechanics::new(physics);
        let rest = &[0.0; MAX_CELLS][..design.cells];
        let mut crawl = Crawl::at_rest(&mechanics, 0.0, rest, Some(DAMPING_RATIO)).ok()?;
        for cycle in 1..=CYCLES_BEFORE {
            crawl.advance_to(&mechanics, f64::from(cycle), design.cycle_s).ok()?;
        }
        let (start_m, start) = (crawl.mean_position_m(), crawl.ledger().clone());
        crawl
            .advance_to(&mechanics, f64::from(CYCLES_BEFORE + 1), design.cycle_s)
            .ok()?;
        let positive_j = crawl.ledger().since(&start).actuator_positive_j;
        Some((crawl.mean_position_m() - start_m, positive_j))
    });
    let difference = |of: fn(&(f64, f64)) -> f64| Some(of(inertial.as_ref()?) / of(exact.as_ref()?) - 1.0);
    InertiaCheck {
        slope_deg,
        advance_m: exact.map(|exact| exact.0),
        inertial_advance_m: inertial.map(|inertial| inertial.0),
        advance_difference: difference(|motion| motion.0),
        energy_j: exact.map(|exact| exact.1),
        inertial_energy_j: inertial.map(|inertial| inertial.1),
        energy_difference: difference(|motion| motion.1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;
    use worm_estimator::config::Config;

    /// At its own speed inertia hardly matters to the paper's worm; at a cycle of 0.5 s it matters more.
    #[test]
    fn inertia_matters_more_to_a_fast_worm() {
        let bench = Workbench::new(&Config::default()).expect("the paper's worm");
        let route = Route::from_csv("length_m,slope_deg\n1,0\n1,30\n", Path::new("route.csv")).expect("a route");
        let usual = check(&bench, &bench.configured(), &route);
        assert_eq!(
            usual.iter().map(|check| check.slope_deg).collect::<Vec<_>>(),
            [0.0, 30.0]
        );
        let of = |checks: &[InertiaCheck]| checks[0].advance_difference.expect("it holds").abs();
        assert!(of(&usual) < 0.02, "{usual:?}");
        let fast = Design {
            cycle_s: 0.5,
            ..bench.configured()
        };
        let fast = check(&bench, &fast, &route);
        assert!(of(&fast) > of(&usual), "{fast:?} {usual:?}");
    }
}
