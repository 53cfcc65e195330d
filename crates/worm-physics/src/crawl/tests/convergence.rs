//! Limits of the incremental motion: small increments, slow gaits, free oscillation.

use super::{CYCLE_S, effect, paper, strong};
use crate::{Crawl, Locomotion, Mechanics, Physics};
use std::f64::consts::TAU;

/// Stiffness of the paper's pads, N/m.
const STIFFNESS_N_PER_M: f64 = 980.0;

/// Mean position of the cells after two cycles of `cycle_s`, m, in `parts` calls that make one increment each.
fn displacement_m(physics: &Physics, damping_ratio: Option<f64>, cycle_s: f64, parts: u32) -> f64 {
    let mechanics = Mechanics::new(physics);
    let mut crawl = Crawl::at_rest(&mechanics, 0.0, &[0.12, 0.08, 0.04, 0.0], damping_ratio).expect("it holds");
    for part in 1..=parts {
        let phase = 2.0 * f64::from(part) / f64::from(parts);
        crawl
            .advance_to(&mechanics, phase, 2.0 * cycle_s / f64::from(parts))
            .expect("it holds");
    }
    crawl.mean_position_m()
}

/// Calls in two cycles for a law that needs the finest increments.
const FINEST: u32 = 102_400;

/// With breakaway friction every slide starts with a jump, which an increment finds only when it is over: the error falls with the
/// increment, not with its square, so this law, alone or with all others, needs the finest increments.
#[test]
fn halving_the_increments_gives_the_same_displacement() {
    let level = Physics::of(paper(10.0));
    for damping_ratio in [None, Some(0.1)] {
        let change_m = |physics: &Physics, parts: u32| {
            let whole_m = displacement_m(physics, damping_ratio, CYCLE_S, parts);
            (displacement_m(physics, damping_ratio, CYCLE_S, 2 * parts) - whole_m).abs() / 2.0
        };
        for setting in strong() {
            let parts = if setting.effect().name == "breakaway-friction" {
                FINEST
            } else {
                6_400
            };
            let change_m = change_m(&level.clone().with([&setting]), parts);
            assert!(
                change_m < 1e-6,
                "{}, inertia {damping_ratio:?}: {change_m} m a cycle",
                setting.effect().name
            );
        }
        let change_m = change_m(&level.clone().with(&strong()), FINEST);
        assert!(
            change_m < 1e-6,
            "all together, inertia {damping_ratio:?}: {change_m} m a cycle"
        );
    }
}

#[test]
fn inertia_vanishes_in_a_slow_gait() {
    let physics = Physics::of(paper(20.0));
    let mut still = Locomotion::at_rest(&physics, &[0.12, 0.08, 0.04, 0.0]).expect("it holds");
    still.advance_to(2.0, 1.0).expect("it holds");
    let apart_m = |cycle_s: f64| {
        let parts = (2.0 * cycle_s / 4e-3) as u32;
        (displacement_m(&physics, Some(0.1), cycle_s, parts) - still.mean_position_m()).abs()
    };
    let (quick_m, slow_m) = (apart_m(2.5), apart_m(100.0));
    // The difference is that of the last oscillations, and falls with the speed.
    assert!(slow_m < 1e-5 && slow_m < quick_m / 25.0, "{quick_m} m, then {slow_m} m");
}

/// Released under another pull, with all tips holding, the body oscillates with √(K/m).
#[test]
fn the_body_oscillates_at_its_natural_frequency() {
    let calm = Physics::of(paper(0.0));
    let mut crawl = Crawl::at_rest(&Mechanics::new(&calm), 0.0, &[0.0; 4], Some(0.0)).expect("it holds");
    let pulled = Mechanics::new(&calm.with([&effect("constant-drag", &[0.5])]));
    let middle_m = -0.5 / (4.0 * STIFFNESS_N_PER_M);
    let step_s = 1e-4;
    let mut crossings_s = Vec::new();
    let mut before_m = 0.0;
    for step in 1..=5_000 {
        crawl.advance_to(&pulled, 0.0, step_s).expect("it holds");
        let now_m = crawl.mean_position_m();
        if before_m >= middle_m && now_m < middle_m {
            crossings_s.push(step_s * (f64::from(step) - (middle_m - now_m) / (before_m - now_m)));
        }
        before_m = now_m;
    }
    let period_s = (crossings_s[5] - crossings_s[0]) / 5.0;
    let expected_s = TAU * (0.333 / (4.0 * STIFFNESS_N_PER_M)).sqrt();
    assert!(
        (period_s / expected_s - 1.0).abs() < 1e-4,
        "{period_s} s, not {expected_s} s"
    );
}
