//! The worms with hidden effects, tested before they test the library.

mod contact;

use testkit::hidden_effects::MAX_CELLS;
use testkit::hidden_effects::body::Worm;
use testkit::hidden_effects::campaign::{HiddenCampaign, draw_sized, draw_varied};
use testkit::hidden_effects::deviations::{Deviations, Patch};
use testkit::hidden_effects::effect::{Effect, SeverityRange};
use testkit::hidden_effects::effect_size::advances_m;
use testkit::hidden_effects::follow_up::Condition;
use testkit::hidden_effects::hidden::{Hidden, Twin};
use testkit::hidden_effects::parameters::{WormParameters, each_of};
use testkit::hidden_effects::scene::{STEP_S, Scene, SimulatedRun};
use testkit::hidden_effects::setting::CampaignSize;
use testkit::hidden_effects::split::{Case, Split, split};
use testkit::hidden_effects::truth::CampaignKind;

/// A change of the advance smaller than this counts as none, m.
const NO_CHANGE_M: f64 = 0.1e-3;

fn worm(deviations: Deviations) -> Worm {
    Worm {
        parameters: WormParameters::nominal(),
        deviations,
        unmodelled: None,
    }
}

/// Mean advance of the settled cycles of a usual run, m.
fn advance_m(worm: &Worm, slope_deg: f64) -> f64 {
    let scene = Scene {
        cycles: 8.0,
        ..Scene::ideal(slope_deg, 2.5)
    };
    let simulated = scene.simulate(worm).expect("the worm holds");
    let advances_m = advances_m(&simulated);
    let settled_m = &advances_m[2..];
    settled_m.iter().sum::<f64>() / settled_m.len() as f64
}

/// Advance of a settled cycle so slow that dynamics do not show, on tips that do not yield before they slide, m.
fn slow_advance_m(deviations: Deviations, slope_deg: f64) -> f64 {
    let parameters = WormParameters {
        damping_ratio: 1.0,
        ..WormParameters::nominal()
    };
    slow_advance_of_m(
        &Worm {
            parameters,
            ..worm(deviations)
        },
        slope_deg,
    )
}

/// The same of any worm, m.
fn slow_advance_of_m(worm: &Worm, slope_deg: f64) -> f64 {
    let scene = Scene {
        warm_up_cycles: 1.9,
        cycles: 1.2,
        // Nothing swings here, so coarser steps do.
        step_s: 2.0 * STEP_S,
        ..Scene::ideal(slope_deg, 20.0)
    };
    advances_m(&scene.simulate(worm).expect("the worm holds"))[0]
}

/// A factor on the second cell alone.
fn second(factor: f64) -> [f64; MAX_CELLS] {
    std::array::from_fn(|cell| if cell == 1 { factor } else { 1.0 })
}

#[test]
fn slow_and_stiff_it_gives_the_figures_of_another_simulation() {
    let identified_m = [2.0e-3, 1.1e-3, 1.75e-3, 2.15e-3];
    let clamps = Deviations {
        friction_factor: each_of(4, |cell| identified_m[cell] / 1.75e-3),
        ..Deviations::default()
    };
    let pads = Deviations {
        stiffness_factor: each_of(4, |cell| 1.75e-3 / identified_m[cell]),
        ..Deviations::default()
    };
    let table = [
        ("equal cells", Deviations::default(), [6.833, 4.611, 2.072]),
        ("identified, as clamp forces", clamps, [6.356, 3.333, 1.379]),
        ("identified, as stiffnesses", pads, [6.71, 4.35, 2.07]),
    ];
    for (worm, deviations, expected_mm) in table {
        for (slope_deg, expected_mm) in [0.0, 30.0, 45.0].into_iter().zip(expected_mm) {
            let advance_mm = 1e3 * slow_advance_m(deviations.clone(), slope_deg);
            println!("{worm} at {slope_deg}°: {advance_mm:.3} mm of {expected_mm} mm");
            assert!(
                (advance_mm / expected_mm - 1.0).abs() < 0.01,
                "{worm} at {slope_deg}°: {advance_mm:.3} mm should be {expected_mm} mm"
            );
        }
    }
}

#[test]
fn every_effect_changes_the_advance_in_its_own_direction() {
    let none = Deviations::default;
    #[rustfmt::skip]
    // Effect, deviation, and whether the advance on the level and on a slope grows or shrinks.
    let table = [
        // Lower friction costs less of the stroke on the level, and holds less on a slope.
        ("unequal-clamping", Deviations { friction_factor: second(0.4), ..none() }, [0, -1]),
        ("unequal-clamping", Deviations { friction_factor: second(1.6), ..none() }, [-1, -1]),
        ("unequal-stiffness", Deviations { stiffness_factor: second(0.4), ..none() }, [-1, -1]),
        ("unequal-stiffness", Deviations { stiffness_factor: second(1.6), ..none() }, [1, 1]),
        ("directional-friction", Deviations { backward_over_forward: 0.8, ..none() }, [-1, -1]),
        ("directional-friction", Deviations { backward_over_forward: 1.6, ..none() }, [0, 1]),
        ("breakaway-friction", Deviations { static_over_kinetic: 1.8, ..none() }, [0, 1]),
        ("pad-hardening", Deviations { hardening: 1.5, ..none() }, [1, 1]),
        ("pad-creep", Deviations { creep_share: 1.0, creep_s: 0.5, ..none() }, [1, 1]),
        ("pad-hysteresis", Deviations { yielding_share: 0.5, ..none() }, [-1, -1]),
        ("viscous-drag", Deviations { drag_n_s_per_m: 20.0, ..none() }, [-1, -1]),
        ("constant-drag", Deviations { force_n: 0.5, ..none() }, [-1, -1]),
        ("payload", Deviations { mass_kg: 0.08, ..none() }, [0, -1]),
        ("slope-error", Deviations { angle_deg: 4.0, ..none() }, [-1, -1]),
        ("slope-error", Deviations { angle_deg: -4.0, ..none() }, [1, 1]),
        ("tether-drag", Deviations { tether_n_per_m: 10.0, ..none() }, [-1, -1]),
        ("lost-stroke", Deviations { stroke_factor: second(0.88), ..none() }, [-1, -1]),
        ("lost-stroke", Deviations { stroke_factor: [0.88; MAX_CELLS], ..none() }, [-1, -1]),
        ("actuator-compliance", Deviations { compliance_m_per_n: 2e-4, ..none() }, [-1, -1]),
        ("backlash", Deviations { play_m: 1e-3, ..none() }, [-1, -1]),
        ("step-overlap", Deviations { overlap: 0.2, ..none() }, [-1, -1]),
        ("slick-patch", Deviations { patch: Some(Patch { from_m: -0.05, length_m: 0.02, friction_factor: 0.3 }), ..none() }, [0, -1]),
        // On 30° a tenth less friction costs as much less stroke as it holds less: the worm is near its best friction there.
        ("wear", Deviations { loss_per_cycle: 0.02, ..none() }, [1, 0]),
        ("motor-droop", Deviations { slowdown_per_n: 0.3, ..none() }, [0, 0]),
        ("sensor-scale", Deviations { scale: 1.1, ..none() }, [1, 1]),
        ("sensor-scale", Deviations { scale: 0.9, ..none() }, [-1, -1]),
        ("sensor-latency", Deviations { latency_s: 0.06, ..none() }, [0, 0]),
        ("slope-clamping", Deviations { slope_sensitivity: 0.6, ..none() }, [0, 0]),
    ];
    let usual = worm(none());
    let slopes_deg = [0.0, 30.0];
    let baseline_m = slopes_deg.map(|slope_deg| advance_m(&usual, slope_deg));
    for (name, deviations, expected) in &table {
        assert!(Effect::named(name).is_some(), "the library has no effect {name}");
        let deviating = Worm {
            deviations: deviations.clone(),
            ..usual.clone()
        };
        for ((slope_deg, baseline_m), &expected) in slopes_deg.into_iter().zip(baseline_m).zip(expected) {
            let change_m = advance_m(&deviating, slope_deg) - baseline_m;
            let sign = if change_m.abs() < NO_CHANGE_M {
                0
            } else {
                change_m.signum() as i32
            };
            println!("{name} at {slope_deg}°: {:+.3} mm", 1e3 * change_m);
            assert_eq!(sign, expected, "{name} at {slope_deg}°: {:+.3} mm", 1e3 * change_m);
        }
    }
    for effect in Effect::ALL {
        assert!(
            table.iter().any(|row| row.0 == effect.name()),
            "{} is not tested",
            effect.name()
        );
    }
}

#[test]
fn droop_and_latency_shift_times_and_not_positions() {
    let simulate = |deviations: Deviations| -> SimulatedRun {
        let scene = Scene {
            cycles: 3.0,
            ..Scene::ideal(30.0, 2.5)
        };
        scene.simulate(&worm(deviations)).expect("the worm holds")
    };
    let baseline = simulate(Deviations::default());
    let droop = simulate(Deviations {
        slowdown_per_n: 0.3,
        ..Deviations::default()
    });
    // The stepping cell's force goes from −1.7 to +1.7 N, and only what is above 0 slows the cam down.
    let slower = droop.recording.samples() as f64 / baseline.recording.samples() as f64;
    assert!((1.1..1.5).contains(&slower), "three cycles take {slower} times as long");

    // Six samples late: the position that was seen is the one of six samples ago, and the phase is that of now.
    let late = simulate(Deviations {
        latency_s: 6.0 / 120.0,
        ..Deviations::default()
    });
    for sample in (0..baseline.recording.samples() - 6).step_by(7) {
        assert!((late.position_m[2][sample] - baseline.position_m[2][sample]).abs() < 1e-9);
        assert!((late.phase[sample] - baseline.phase[sample + 6]).abs() < 1e-9);
    }
}

#[test]
fn exact_twins_move_alike() {
    let none = Deviations::default;
    // Four tips of 1.715 N that hold 0.8 as much backward are four of 0.9 as much both ways and 0.4 of one tip's friction.
    let drag_n = 0.4 * WormParameters::nominal().friction_n[0];
    #[rustfmt::skip]
    let table = [
        (
            Deviations { backward_over_forward: 0.8, ..none() },
            Deviations { friction_factor: [0.9; MAX_CELLS], force_n: drag_n, ..none() },
        ),
        (
            Deviations { mass_kg: 0.111, ..none() },
            Deviations { friction_factor: [0.75; MAX_CELLS], stiffness_factor: [0.75; MAX_CELLS], ..none() },
        ),
        (
            Deviations { scale: 0.9, ..none() },
            Deviations { stroke_factor: [0.9; MAX_CELLS], friction_factor: [0.9; MAX_CELLS], mass_kg: -0.0333, ..none() },
        ),
    ];
    for (one, other) in table {
        for slope_deg in [0.0, 30.0] {
            let [one_m, other_m] = [&one, &other].map(|deviations| slow_advance_m(deviations.clone(), slope_deg));
            assert!(
                (one_m - other_m).abs() < 0.01e-3,
                "at {slope_deg}°: {one_m} m and {other_m} m of {one:?} and {other:?}"
            );
        }
    }
}

#[test]
fn clamps_that_give_on_a_slope_are_weaker_clamps_there() {
    let giving = |slope_deg: f64| {
        let deviations = Deviations {
            slope_sensitivity: 0.6,
            ..Deviations::default()
        };
        slow_advance_m(deviations, slope_deg)
    };
    for slope_deg in [0.0, 45.0_f64] {
        let weaker = Deviations {
            friction_factor: [1.0 - 0.6 * (1.0 - slope_deg.to_radians().cos()); MAX_CELLS],
            ..Deviations::default()
        };
        assert!((giving(slope_deg) - slow_advance_m(weaker, slope_deg)).abs() < 1e-6);
    }
}

#[test]
fn a_campaign_is_what_its_seed_says() {
    let hidden = Hidden::Single(Effect::PadCreep, SeverityRange::UPPER_HALF);
    let [one, same] = [5, 5].map(|seed| draw_sized(hidden, seed, CampaignSize::SMALL));
    let bits = |campaign: &HiddenCampaign| -> Vec<u64> {
        let positions = campaign
            .recordings
            .iter()
            .flat_map(|recording| recording.position_m.concat());
        positions.map(f64::to_bits).collect()
    };
    assert_eq!(one.truth, same.truth);
    assert_eq!(bits(&one), bits(&same), "the same seed draws the same");
    assert!(
        one.effect_size.advance_m > 0.1e-3,
        "strong creep can be seen: {:?}",
        one.effect_size
    );
    assert_ne!(bits(&one), bits(&draw_sized(hidden, 6, CampaignSize::SMALL)));

    let clean = draw_sized(Hidden::Clean, 5, CampaignSize::SMALL);
    assert_eq!(
        (
            clean.truth.effects.len(),
            clean.effect_size.advance_m,
            clean.effect_size.within_cycle_m
        ),
        (0, 0.0, 0.0)
    );
    for recording in &clean.recordings {
        let seen = recording.position_m.concat();
        let lost = seen.iter().filter(|m| m.is_nan()).count() as f64 / seen.len() as f64;
        assert!((0.005..0.015).contains(&lost), "{lost} of the positions are lost");
    }
    let late = draw_sized(
        Hidden::Single(Effect::SensorLatency, SeverityRange::WHOLE),
        8,
        CampaignSize::SMALL,
    );
    assert!(late.recordings.iter().all(|recording| recording.gait_phase.is_some()));
}

#[test]
fn one_more_run_is_of_the_same_worm() {
    let campaign = draw_sized(Hidden::Twin(Twin::Payload), 3, CampaignSize::SMALL);
    let usual = campaign.usual(0.0);
    let run = |condition: Condition| {
        campaign
            .follow_up(condition, 1)
            .expect("the worm crawls on the level")
            .recording
    };
    let slow = run(Condition {
        cycle_s: 5.0,
        cycles: 6.0,
        ..usual
    });
    let dwelling = run(Condition { dwell_s: 1.0, ..usual });
    let shifted = run(Condition {
        start_shift_m: 0.1,
        ..usual
    });
    let lasts_s = |recording: &worm_analysis::recording::Recording| recording.time_s[recording.samples() - 1];
    assert!((lasts_s(&slow) - 30.0).abs() < 2.0, "{} s", lasts_s(&slow));
    // Five rests lie between six cycles, and half a second at most before and after them.
    assert!((lasts_s(&dwelling) - lasts_s(&run(usual)) - 5.0).abs() < 1.5);
    let first_m =
        |recording: &worm_analysis::recording::Recording| recording.position_m[0][..20].iter().sum::<f64>() / 20.0;
    assert!((first_m(&shifted) - 0.1).abs() < 1e-3);
}

/// What recalibration leaves of a wave differs from worm to worm by factors; what is put in must not.
#[test]
fn a_discrepancy_is_as_large_as_asked_for() {
    for (micrometres, seed) in [(5, 601), (20, 602), (40, 603)] {
        let campaign = draw_varied(Hidden::Discrepant(micrometres), seed);
        let (left_m, asked_m) = (campaign.truth.discrepancy_m, 1e-6 * f64::from(micrometres));
        println!("seed {seed}: {left_m} m left of {asked_m} m");
        assert!(
            (left_m / asked_m - 1.0).abs() < 0.1,
            "seed {seed}: {left_m} m left of {asked_m} m"
        );
        assert_eq!(campaign.truth.kind, CampaignKind::Clean);
    }
}

#[test]
fn the_splits_are_whole_and_apart() {
    let [development, test] = [Split::Development, Split::Test].map(|which| split(which, 1.0));
    let mut seeds: Vec<u64> = development.iter().chain(&test).map(|case| case.seed).collect();
    seeds.sort_unstable();
    seeds.dedup();
    assert_eq!(seeds.len(), development.len() + test.len(), "no two cases share a seed");
    let kinds = |cases: &[Case]| -> Vec<u64> {
        let kind = |case: &Case| match case.hidden {
            Hidden::Outside(kind) => Some(kind),
            _ => None,
        };
        cases.iter().filter_map(kind).collect()
    };
    let (known, sealed) = (kinds(&development), kinds(&test));
    assert!(
        known.iter().all(|kind| !sealed.contains(kind)),
        "no stranger is in both"
    );
    let of = |kind: CampaignKind| test.iter().filter(|case| case.hidden.kind() == kind).count();
    for (kind, least) in [
        (CampaignKind::Clean, 130),
        (CampaignKind::Single, 200),
        (CampaignKind::Stranger, 100),
        (CampaignKind::Pair, 100),
        (CampaignKind::Onset, 100),
    ] {
        assert!(of(kind) >= least, "{} of {kind:?}", of(kind));
    }
}
