//! The independent worm against what is known of it: before it judges others it is judged itself.

use testkit::independent_worm::body::Body;
use testkit::independent_worm::cam::Cam;
use testkit::independent_worm::camera::Camera;
use testkit::independent_worm::scene::{Scene, SlidDown};
use testkit::independent_worm::truth::Truth;

/// Cells, slope, advance mm, positive mJ, net mJ of a worm of equal cells of 83.25 g and 1.75 mm: another simulation.
const EQUAL_CELLS: [(usize, f64, [f64; 3]); 11] = [
    (3, 0.0, [6.250, 38.91, 32.16]),
    (3, 30.0, [2.500, 45.65, 41.65]),
    (4, 0.0, [6.833, 54.88, 46.88]),
    (4, 30.0, [4.611, 67.12, 62.03]),
    (4, 45.0, [2.072, 71.96, 67.99]),
    (5, 0.0, [7.125, 70.48, 61.10]),
    (5, 30.0, [5.111, 87.70, 81.89]),
    (5, 45.0, [3.673, 93.87, 89.46]),
    (6, 0.0, [7.300, 85.92, 75.12]),
    (6, 30.0, [5.500, 107.47, 100.94]),
    (6, 45.0, [4.429, 115.44, 110.16]),
];

/// A slow and damped worm: where dynamics should not be seen.
fn slow(bound_m: &[f64], slope_deg: f64) -> Scene {
    let mut scene = Scene::ideal(Body::with_bounds(bound_m, slope_deg), 40.0);
    scene.body.mass_kg = 0.08325 * bound_m.len() as f64;
    scene.body.damping_ratio = 1.0;
    scene.cam.rounding = 0.02;
    // Nothing swings here, so coarser steps do.
    scene.step_s *= 2.0;
    scene.warm_up_cycles = 1.9;
    scene.cycles = 1.2;
    scene
}

fn play(scene: &Scene) -> Truth {
    let (_, truth) = scene.record().expect("the worm holds");
    truth
}

#[track_caller]
fn assert_within(fraction: f64, what: &str, value: f64, expected: f64) {
    assert!(
        (value / expected - 1.0).abs() <= fraction,
        "{what}: {value} should be {expected} within {} %",
        100.0 * fraction
    );
}

#[test]
fn slow_it_gives_the_figures_of_equal_cells() {
    for (cells, slope_deg, [advance_mm, positive_mj, net_mj]) in EQUAL_CELLS {
        let truth = play(&slow(&vec![1.75e-3; cells], slope_deg));
        let balance = &truth.cycles[0].balance;
        println!(
            "{cells} cells {slope_deg:>2}°: advance {:.3} mm of {advance_mm}, positive {:.2} mJ of {positive_mj}, net {:.2} mJ of {net_mj}, (11) {:.2} mJ",
            1e3 * balance.advance_m(),
            1e3 * balance.actuator_positive_j,
            1e3 * balance.actuator_net_j,
            1e3 * balance.loss_j(),
        );
        let what = format!("{cells} cells at {slope_deg}°");
        assert_within(0.01, &what, 1e3 * balance.advance_m(), advance_mm);
        assert_within(0.01, &what, 1e3 * balance.actuator_positive_j, positive_mj);
        assert_within(0.01, &what, 1e3 * balance.actuator_net_j, net_mj);
        assert_within(0.01, &what, 1e3 * balance.loss_j(), net_mj);
    }
}

#[test]
fn slow_it_gives_the_figures_of_the_identified_worm() {
    for (slope_deg, advance_mm) in [(0.0, 6.356), (30.0, 3.333), (45.0, 1.379)] {
        let truth = play(&slow(&[2.0e-3, 1.1e-3, 1.75e-3, 2.15e-3], slope_deg));
        let balance = &truth.cycles[0].balance;
        println!(
            "identified at {slope_deg}°: {:.3} mm of {advance_mm}",
            1e3 * balance.advance_m()
        );
        assert_within(0.01, "identified", 1e3 * balance.advance_m(), advance_mm);
        if slope_deg == 0.0 {
            let mean_mm = |slide_m: &[f64]| 1e3 * slide_m.iter().sum::<f64>() / 4.0;
            assert_within(0.01, "forward", mean_mm(&balance.forward_slide_m), 6.99);
            assert_within(0.02, "backward", mean_mm(&balance.backward_slide_m), 0.63);
            assert_within(0.01, "cell 2", 1e3 * balance.backward_slide_m[1], 2.05);
        }
    }
}

/// Where the other tips cannot hold a stepping cell, all are pushed back instead; where all together cannot hold the
/// weight, the worm is gone.
#[test]
fn a_worm_that_cannot_hold_does_not_advance_or_is_lost() {
    assert!(!Body::with_bounds(&[1.75e-3; 3], 45.0).holds());
    let advance_m = play(&slow(&[1.75e-3; 3], 60.0)).cycles[0].balance.advance_m();
    assert!(advance_m < 1e-4, "{advance_m} m");
    assert!(matches!(slow(&[0.5e-3; 3], 60.0).record(), Err(SlidDown)));
}

#[test]
fn half_the_time_step_changes_nothing_that_matters() {
    for scene in testkit::independent_worm::draw::crawling(4, &[0.0, 30.0], 7) {
        let fine = Scene {
            step_s: 0.5 * scene.step_s,
            ..scene.clone()
        };
        let figures = |scene: &Scene| {
            let cycles = play(scene).cycles.into_iter().map(|cycle| cycle.balance);
            let each = cycles.map(|a| [a.advance_m(), a.loss_j(), a.actuator_net_j, a.actuator_positive_j]);
            each.collect::<Vec<_>>().concat()
        };
        let (coarse, fine) = (figures(&scene), figures(&fine));
        let changes = coarse
            .iter()
            .zip(&fine)
            .map(|(coarse, fine)| (coarse / fine - 1.0).abs());
        let largest = changes.fold(0.0, f64::max);
        println!("{}°: largest change {:.4} %", scene.body.slope_deg, 100.0 * largest);
        assert_eq!(coarse.len(), 4 * 12);
        assert!(largest < 0.002, "{coarse:?}\n{fine:?}");
    }
}

/// What the cam gives goes into friction, height, dampers, springs and motion, and nowhere else.
#[test]
fn the_energy_closes() {
    for scene in testkit::independent_worm::draw::crawling(4, &[0.0, 30.0], 3) {
        for drag in [0.0, 0.5] {
            let mut scene = scene.clone();
            scene.body.slip_drag_n_s_per_m = drag;
            let truth = play(&scene);
            let spent = truth.overall();
            let stored_j = truth.stored_j[1] - truth.stored_j[0];
            let sum_j = spent.loss_j() + spent.damping_j + stored_j;
            println!(
                "{}°, drag {drag}: cam {:.3} mJ, friction and weight {:.3} mJ, dampers {:.3} mJ, stored {:.3} mJ",
                scene.body.slope_deg,
                1e3 * spent.cam_j,
                1e3 * spent.loss_j(),
                1e3 * spent.damping_j,
                1e3 * stored_j,
            );
            assert_within(0.002, "the cam's work", spent.cam_j, sum_j);
        }
    }
}

/// The cam carries each cell once a turn, in order, and is smooth.
#[test]
fn the_cam_moves_one_cell_after_the_other() {
    let cam = Cam::new(0.0115, vec![2, 0, 3, 1]);
    let mut extension_m = [0.0; 4];
    for (phase, expected) in [
        (0.125, [0.0, 0.0, 0.5, 0.0]),
        (0.5, [1.0, 0.0, 1.0, 0.0]),
        (0.875, [1.0, 0.5, 1.0, 1.0]),
        (3.3, [3.2, 3.0, 4.0, 3.0]),
        (-0.125, [0.0, -0.5, 0.0, 0.0]),
    ] {
        cam.extensions_m(phase, &mut extension_m);
        for (cell, (extension_m, expected)) in extension_m.iter().zip(expected).enumerate() {
            let strokes = extension_m / 0.0115;
            assert!(
                (strokes - expected).abs() < 0.006,
                "phase {phase}, cell {cell}: {strokes} strokes"
            );
        }
    }
}

/// A camera switched on in mid-crawl sees the same crawl as one that ran from the start.
#[test]
fn a_warm_up_only_hides_the_beginning() {
    let whole = testkit::independent_worm::draw::crawling(4, &[30.0], 5).remove(0);
    let late = Scene {
        warm_up_cycles: 3.4,
        cycles: 8.6,
        ..whole.clone()
    };
    let (whole, late) = (play(&whole), play(&late));
    assert_eq!((whole.cycles.len(), late.cycles.len()), (12, 8));
    for (early, late) in whole.cycles[4..].iter().zip(&late.cycles) {
        assert_within(1e-4, "duration", late.end_s - late.start_s, early.end_s - early.start_s);
        assert_within(1e-3, "advance", late.balance.advance_m(), early.balance.advance_m());
    }
}

/// Noise, gaps and the clock are as poor as they are told to be.
#[test]
fn the_camera_is_as_poor_as_told() {
    let mut scene = Scene::ideal(Body::with_bounds(&[1.75e-3; 4], 0.0), 2.5);
    scene.camera = Camera {
        jitter: 0.3,
        dropout_share: 0.03,
        hidden_fraction: 0.02,
        outlier_fraction: 0.01,
        ..Camera::default()
    };
    let (recording, truth) = scene.record().expect("the worm holds");
    let seen = recording.position_m.iter().flatten();
    let errors_m: Vec<f64> = seen
        .zip(truth.sample_position_m.iter().flatten())
        .map(|(seen, truly)| seen - truly)
        .collect();
    let fraction = |kind: fn(f64) -> bool| {
        errors_m.iter().filter(|&&error_m| kind(error_m)).count() as f64 / errors_m.len() as f64
    };
    let (lost, far) = (fraction(f64::is_nan), fraction(|error_m| error_m.abs() > 4e-3));
    assert!((0.03..0.07).contains(&lost), "{lost} lost");
    assert!((0.005..0.015).contains(&far), "{far} far off");
    let near: Vec<f64> = errors_m.into_iter().filter(|error_m| error_m.abs() < 1e-3).collect();
    assert_within(
        0.05,
        "noise",
        testkit::independent_worm::score::rms(near.into_iter()),
        1e-4,
    );

    let gaps_s: Vec<f64> = recording.time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let period_s = 1.0 / scene.camera.rate_hz;
    assert!(
        gaps_s
            .iter()
            .all(|gap_s| (0.39 * period_s..1.61 * period_s).contains(gap_s))
    );
    assert!(gaps_s.iter().any(|gap_s| (gap_s - period_s).abs() > 0.4 * period_s));
}
