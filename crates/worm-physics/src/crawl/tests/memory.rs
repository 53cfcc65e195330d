//! Tables over what was before, against the effects of the library that remember.

use super::{CYCLE_S, effect, paper};
use crate::effect::Setting;
use crate::{ActsOn, Axis, Crawl, Mechanics, Physics, Table, Worm};

const STIFFNESS_N_PER_M: f64 = 980.0;

/// Places of all cells at the ends of the tenths of some cycles, m.
fn crawl(worm: &Worm, settings: &[Setting]) -> Vec<f64> {
    let mechanics = Mechanics::new(&Physics::of(worm.clone()).with(settings));
    let mut crawl = Crawl::at_rest(&mechanics, 0.0, &[0.0, 0.04, 0.08, 0.12], None).expect("it holds");
    let mut places_m = Vec::new();
    for tenth in 1..=40 {
        let phase = 0.1 * f64::from(tenth);
        crawl.advance_to(&mechanics, phase, 0.1 * CYCLE_S).expect("it holds");
        places_m.extend_from_slice(crawl.positions_m());
    }
    places_m
}

fn furthest_apart_m(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// A force in proportion to the recent deformation is that of a spring with a dashpot in series: with the deformations as they turn out,
/// and what the dashpot has not given way to of them, forces balance at all times.
#[test]
fn a_force_over_the_recent_deformation_is_that_of_a_spring_with_a_dashpot() {
    let (bound_m, spring_n_per_m, steps) = (0.05, 600.0, 4000);
    let holds = paper(20.0).with_max_deformations_m(&[bound_m; 4]).expect("a bound");
    let axis = [(Axis::RecentDeformation, vec![-bound_m, bound_m])];
    let force_n = spring_n_per_m * bound_m;
    for memory_s in [0.1, 1.0, 6.0] {
        let table = Table::new(ActsOn::ContactForce, &axis, vec![-force_n, force_n], None).expect("a table");
        let of_cell = Setting::of_table(table.with_memory(memory_s).expect("a time"), Some(1), 4).expect("of a cell");
        let mechanics = Mechanics::new(&Physics::of(holds.clone()).with(&[of_cell]));
        let mut crawl = Crawl::at_rest(&mechanics, 0.0, &[0.0, 0.04, 0.08, 0.12], None).expect("it holds");
        let springs_n = |crawl: &Crawl| STIFFNESS_N_PER_M * (0..4).map(|cell| crawl.deformation_m(cell)).sum::<f64>();
        let (at_rest_n, step_s) = (springs_n(&crawl), CYCLE_S / f64::from(steps));
        let (mut sprung_m, mut largest_m) = (0.0, 0.0_f64);
        for step in 1..=steps {
            let before_m = crawl.deformation_m(1);
            crawl
                .advance_to(&mechanics, f64::from(step) / f64::from(steps), step_s)
                .expect("it holds");
            // The dashpot gives way at (strain of the spring)/memory, by the mean of both ends.
            let half = 0.5 * step_s / memory_s;
            sprung_m = (sprung_m * (1.0 - half) + crawl.deformation_m(1) - before_m) / (1.0 + half);
            largest_m = largest_m.max(sprung_m.abs());
            let off_n = springs_n(&crawl) + spring_n_per_m * sprung_m - at_rest_n;
            assert!(
                off_n.abs() < 0.01 * spring_n_per_m * largest_m,
                "{memory_s} s, step {step}: {off_n} N off"
            );
        }
        assert!(largest_m > 1e-3, "{memory_s} s: {largest_m} m");
    }
}

/// Friction that falls with the recent slide does most of what breakaway friction does: the same in a steady slide, and nearly the same when
/// a tip leaves its rest.
#[test]
fn friction_over_the_recent_slide_is_breakaway_friction() {
    let (ratio, slip_m, grip_s) = (1.3, 3e-4, 0.3);
    let slides_m: Vec<f64> = (0..200).map(|point| 0.2 * f64::from(point) * slip_m).collect();
    let factors = slides_m
        .iter()
        .map(|slide_m| 1.0 + (ratio - 1.0) / (1.0 + slide_m / slip_m));
    let factors = factors.collect();
    let table = Table::new(ActsOn::FrictionFactor, &[(Axis::RecentSlide, slides_m)], factors, None).expect("a table");
    let table = table.with_memory(grip_s).expect("a time");
    let by_table = Setting::of_table(table, None, 4).expect("of all cells");
    for slope_deg in [0.0, 15.0, 25.0, 35.0] {
        let worm = paper(slope_deg);
        let [plain, breakaway, by_table] = [
            crawl(&worm, &[]),
            crawl(&worm, &[effect("breakaway-friction", &[ratio, slip_m, grip_s])]),
            crawl(&worm, std::slice::from_ref(&by_table)),
        ];
        let effect_m = furthest_apart_m(&plain, &breakaway);
        let apart_m = furthest_apart_m(&breakaway, &by_table);
        assert!(
            apart_m < 0.5 * effect_m,
            "{slope_deg}°: {apart_m} m apart, of {effect_m}"
        );
    }
}
