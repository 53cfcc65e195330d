//! Every effect on the motion against a figure that was calculated by hand, or a worm that must crawl in the same way.
//!
//! On the level with equal cells nothing slides backward: a pad goes from −x to x in its own step and gives 2x/(n−1) back in each
//! other one, so L = Ls − 2x n/(n−1), whatever law relates x to μN.

use super::{BOUND_M, CYCLE_S, STIFFNESS_N_PER_M, STROKE_M, effect, of_cell, paper, steady, with};
use worm_physics::cycle::CYCLES_BEFORE;
use worm_physics::effect::Setting;
use worm_physics::{Contact, Cycle, Physics, Worm};

/// L on the level for a stroke and a largest deformation, m.
fn level_m(stroke_m: f64, bound_m: f64) -> f64 {
    stroke_m - 2.0 * bound_m * 4.0 / 3.0
}

/// The paper's worm with other pads.
fn paper_with(slope_deg: f64, contact: Contact) -> Worm {
    (0..4).fold(paper(slope_deg), |worm, cell| {
        worm.with_contact(cell, contact).expect("a contact")
    })
}

#[test]
fn advances_on_the_level_are_the_closed_forms() {
    let all_stiffer: Vec<Setting> = (0..4)
        .map(|cell| of_cell("unequal-stiffness", Some(cell), &[1.6]))
        .collect();
    let all_clamped: Vec<Setting> = (0..4)
        .map(|cell| of_cell("unequal-clamping", Some(cell), &[0.6]))
        .collect();
    // x (1 + β x²) = 1 has the root 0.6823… for β = 1.
    let hardened = 0.682_327_803_828_019_3;
    let cases: [(&str, &[Setting], f64, f64, f64); 13] = [
        (
            "stiffer pads",
            &all_stiffer,
            CYCLE_S,
            level_m(STROKE_M, BOUND_M / 1.6),
            1e-9,
        ),
        (
            "softer clamps",
            &all_clamped,
            CYCLE_S,
            level_m(STROKE_M, 0.6 * BOUND_M),
            1e-9,
        ),
        (
            "lost stroke",
            &[effect("lost-stroke", &[0.2])],
            CYCLE_S,
            level_m(0.8 * STROKE_M, BOUND_M),
            1e-9,
        ),
        (
            // From one flank to the other each pad goes further by the play.
            "play",
            &[effect("backlash", &[1e-3, 1.0])],
            CYCLE_S,
            level_m(STROKE_M, BOUND_M + 0.5e-3),
            1e-8,
        ),
        // However slowly a cell crosses, before the end of a step it is across.
        (
            "damped play",
            &[effect("backlash", &[1e-3, 60.0])],
            CYCLE_S,
            level_m(STROKE_M, BOUND_M + 0.5e-3),
            1e-8,
        ),
        // The peak at breakaway is over when the step ends; what rest restores at this speed is not.
        (
            "breakaway",
            &[effect("breakaway-friction", &[1.4, 1e-4, 0.1])],
            CYCLE_S,
            level_m(
                STROKE_M,
                BOUND_M * (1.0 + 0.4 / (1.0 + 4.0 * STROKE_M / CYCLE_S * 0.1 / 1e-4)),
            ),
            1e-8,
        ),
        (
            "hardening",
            &[effect("pad-hardening", &[1.0])],
            CYCLE_S,
            level_m(STROKE_M, hardened * BOUND_M),
            1e-8,
        ),
        // Drive and pad in series: the pad is deformed by μN/k, the drive yields by C μN more.
        (
            "compliance",
            &[effect("actuator-compliance", &[3e-4])],
            CYCLE_S,
            level_m(STROKE_M, BOUND_M * (1.0 + 3e-4 * STIFFNESS_N_PER_M)),
            1e-8,
        ),
        (
            "creep, slow",
            &[effect("pad-creep", &[0.5, 0.03])],
            1e5,
            level_m(STROKE_M, BOUND_M),
            1e-6,
        ),
        (
            "creep, quick",
            &[effect("pad-creep", &[0.5, 20.0])],
            1e-3,
            level_m(STROKE_M, BOUND_M / 1.5),
            1e-6,
        ),
        (
            "drag, slow",
            &[effect("viscous-drag", &[20.0])],
            1e6,
            level_m(STROKE_M, BOUND_M),
            1e-7,
        ),
        (
            "all on the patch",
            &[effect("slick-patch", &[0.7, -0.2, 0.5])],
            CYCLE_S,
            level_m(STROKE_M, 0.7 * BOUND_M),
            1e-8,
        ),
        (
            "slope clamping",
            &[effect("slope-clamping", &[2.0])],
            CYCLE_S,
            level_m(STROKE_M, BOUND_M),
            1e-12,
        ),
    ];
    for (name, effects, cycle_s, expected_m, tolerance_m) in cases {
        let advance_m = steady(&Physics::of(paper(0.0)).with(effects), cycle_s).advance_m;
        assert!(
            (advance_m - expected_m).abs() < tolerance_m,
            "{name}: {advance_m} m, not {expected_m} m"
        );
    }
}

/// Unequal clamps against the independent simulation of the identified worm: 6.356, 3.333 and 1.379 mm.
#[test]
fn unequal_clamps_advance_as_in_the_independent_simulation() {
    let clamps: Vec<Setting> = [2.0, 1.1, 1.75, 2.15]
        .iter()
        .enumerate()
        .map(|(cell, bound_mm)| of_cell("unequal-clamping", Some(cell), &[bound_mm / 1.75]))
        .collect();
    for (slope_deg, advance_mm) in [(0.0, 6.356), (30.0, 3.333), (45.0, 1.379)] {
        let cycle = with(slope_deg, &clamps);
        assert!(
            (cycle.advance_m * 1e3 - advance_mm).abs() < 1e-3,
            "{slope_deg}: {cycle:?}"
        );
    }
}

/// Largest difference of advance and slides, m.
fn difference_m(one: &Cycle, other: &Cycle) -> f64 {
    let slides = |cycle: &Cycle| [cycle.forward_slide_m, cycle.backward_slide_m].concat();
    let (one_m, other_m) = (slides(one), slides(other));
    let slides_m = one_m.iter().zip(&other_m).map(|(one, other)| (one - other).abs());
    slides_m.fold((one.advance_m - other.advance_m).abs(), f64::max)
}

#[test]
fn twins_crawl_alike() {
    let plain = |worm: Worm| steady(&Physics::of(worm), CYCLE_S);
    let weight_n = 0.333 * 9.81;
    // Bounds d and r d are bounds (1 + r) d/2 about a mean of (1 − r) d/2, as a constant force makes it.
    let backward = 1.3;
    let symmetric = Contact::symmetric(STIFFNESS_N_PER_M, 0.5 * (1.0 + backward) * BOUND_M);
    let mean_n = 4.0 * STIFFNESS_N_PER_M * 0.5 * (1.0 - backward) * BOUND_M;
    let softer = Contact::symmetric(STIFFNESS_N_PER_M * 0.333 / 0.433, BOUND_M);
    let slipping = Contact::symmetric(
        STIFFNESS_N_PER_M,
        BOUND_M * (1.0 - 0.8 * (1.0 - 30f64.to_radians().cos())),
    );
    let pairs = [
        (
            "directional friction, a constant force",
            with(20.0, &[effect("directional-friction", &[backward])]),
            steady(
                &Physics::of(paper_with(20.0, symmetric)).with([&effect("constant-drag", &[mean_n])]),
                CYCLE_S,
            ),
        ),
        (
            "a constant force, weight on a slope",
            with(0.0, &[effect("constant-drag", &[0.5 * weight_n])]),
            plain(paper(30.0)),
        ),
        (
            "payload, softer pads",
            with(30.0, &[effect("payload", &[0.1])]),
            plain(paper_with(30.0, softer)),
        ),
        (
            "an error of the slope, that slope",
            with(30.0, &[effect("slope-error", &[-5.0])]),
            plain(paper(25.0)),
        ),
        (
            "clamps that press less on a slope, less friction",
            with(30.0, &[effect("slope-clamping", &[0.8])]),
            plain(paper_with(30.0, slipping)),
        ),
    ];
    for (name, one, other) in pairs {
        assert!(difference_m(&one, &other) < 1e-12, "{name}: {one:?} {other:?}");
    }
}

/// The advance on a slope with a compliant drive is that of pads as soft as both in series, with the same friction.
#[test]
fn a_compliant_drive_is_a_softer_pad_to_the_body() {
    let compliance = 3e-4;
    let give = 1.0 + compliance * STIFFNESS_N_PER_M;
    let series = Contact::symmetric(STIFFNESS_N_PER_M / give, BOUND_M * give);
    let one = with(30.0, &[effect("actuator-compliance", &[compliance])]);
    let other = steady(&Physics::of(paper_with(30.0, series)), CYCLE_S);
    assert!(difference_m(&one, &other) < 1e-8, "{one:?} {other:?}");
}

/// Each yielding element, of stiffness s k/4 and yield deformation y, makes heat 2 s k y (D − 2y)/4 over a swing D and back.
#[test]
fn hysteresis_loses_the_area_of_its_loops() {
    let fraction = 0.4;
    let cycle = with(0.0, &[effect("pad-hysteresis", &[fraction])]);
    assert!(
        cycle.backward_slide_m[..4].iter().all(|slide_m| *slide_m < 1e-9),
        "{cycle:?}"
    );
    let swing_m = 3.0 * (STROKE_M - cycle.advance_m) / 4.0;
    let loop_j: f64 = [0.125, 0.375, 0.625, 0.875]
        .iter()
        .map(|yield_fraction| {
            let yield_m = yield_fraction * BOUND_M;
            2.0 * fraction * STIFFNESS_N_PER_M / 4.0 * yield_m * (swing_m - 2.0 * yield_m).max(0.0)
        })
        .sum();
    let lost_j = cycle.energy_actuator_net_j - cycle.energy_loss_j;
    assert!(
        (lost_j - 4.0 * loop_j).abs() < 0.01 * lost_j,
        "{lost_j} J, not {} J",
        4.0 * loop_j
    );
}

/// Wear: the cycle after n others is that of a worm with (1 − w)ⁿ to (1 − w)ⁿ⁺¹ of the friction.
#[test]
fn wear_takes_its_share_with_every_cycle() {
    let loss: f64 = 0.02;
    let advance_m = with(0.0, &[effect("wear", &[loss])]).advance_m;
    let after_m = |cycles: u32| level_m(STROKE_M, BOUND_M * (1.0 - loss).powi(cycles as i32));
    assert!(
        after_m(CYCLES_BEFORE) < advance_m && advance_m < after_m(CYCLES_BEFORE + 1),
        "{advance_m}"
    );
}

/// A tether acts like a constant force of its value halfway through the cycle.
#[test]
fn a_tether_is_a_force_that_grows_with_the_way() {
    let per_metre_n = 5.0;
    let physics = Physics::of(paper(0.0)).with([&effect("tether-drag", &[per_metre_n])]);
    let cycle = steady(&physics, CYCLE_S);
    let mut force_n = 0.0;
    for _ in 0..CYCLES_BEFORE {
        force_n += per_metre_n * with(0.0, &[effect("constant-drag", &[force_n])]).advance_m;
    }
    let expected_m = with(0.0, &[effect("constant-drag", &[force_n])]).advance_m;
    assert!(
        (cycle.advance_m - expected_m).abs() < 1e-4,
        "{} {expected_m}",
        cycle.advance_m
    );
}

/// While a tip slides its cell alone moves, so n cells in a cycle of T drag with c n Ls/T, and so much more actuator force.
#[test]
fn drag_in_a_quick_cycle_is_a_constant_force() {
    let (drag, cycle_s) = (2.0, CYCLE_S);
    let viscous = with(0.0, &[effect("viscous-drag", &[drag])]);
    let force_n = drag * 4.0 * STROKE_M / cycle_s;
    let constant = with(0.0, &[effect("constant-drag", &[force_n])]);
    let (lost_m, expected_m) = (
        level_m(STROKE_M, BOUND_M) - viscous.advance_m,
        level_m(STROKE_M, BOUND_M) - constant.advance_m,
    );
    assert!(
        lost_m > 0.0 && (lost_m - expected_m).abs() < 0.1 * expected_m,
        "{lost_m} m, not {expected_m} m"
    );
}

/// On nearly rigid tips the worm advances by its whole stroke, as long as more cells hold than step.
#[test]
fn overlapping_steps_are_whole_strokes() {
    let contact = Contact::symmetric(1e6, 1e-6);
    for overlap in [0.0, 0.2, 0.5] {
        let worm = Worm::uniform(6, contact, 0.5, STROKE_M).expect("a worm");
        let cycle = steady(&Physics::of(worm).with([&effect("step-overlap", &[overlap])]), CYCLE_S);
        assert!((cycle.advance_m - STROKE_M).abs() < 1e-5, "{overlap}: {cycle:?}");
        assert!(
            cycle.backward_slide_m[..6].iter().all(|slide_m| *slide_m < 1e-5),
            "{overlap}: {cycle:?}"
        );
    }
}
