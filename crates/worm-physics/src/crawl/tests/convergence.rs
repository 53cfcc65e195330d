//! Where the incremental motion must arrive: ever smaller increments, ever slower gaits, a free swing.

use super::{CYCLE_S, effect, paper, strong};
use crate::{Crawl, Locomotion, Mechanics, Physics};
use std::f64::consts::TAU;

/// Stiffness of the paper's pads, N/m.
const STIFFNESS_N_PER_M: f64 = 980.0;

/// Where the mean of the cells is after two cycles of `cycle_s`, m, in `parts` calls of each of which makes one increment.
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

/// Calls in two cycles where a law asks for the finest increments.
const FINEST: u32 = 102_400;

/// Breakaway makes a jump of every tip's first slide, which an increment finds only when it is over: the way's error falls as the
/// increment does, not as its square, so that this law, alone or with all others, asks for the finest.
#[test]
fn half_the_increments_make_the_same_way() {
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
fn a_slow_gait_knows_no_inertia() {
    let physics = Physics::of(paper(20.0));
    let mut still = Locomotion::at_rest(&physics, &[0.12, 0.08, 0.04, 0.0]).expect("it holds");
    still.advance_to(2.0, 1.0).expect("it holds");
    let apart_m = |cycle_s: f64| {
        let parts = (2.0 * cycle_s / 4e-3) as u32;
        (displacement_m(&physics, Some(0.1), cycle_s, parts) - still.mean_position_m()).abs()
    };
    let (quick_m, slow_m) = (apart_m(2.5), apart_m(100.0));
    // The way lags by what the last swings leave, which falls as the speed does.
    assert!(slow_m < 1e-5 && slow_m < quick_m / 25.0, "{quick_m} m, then {slow_m} m");
}

/// Let go under another pull, all tips holding, the body swings with √(K/m).
#[test]
fn the_body_swings_at_its_frequency() {
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
