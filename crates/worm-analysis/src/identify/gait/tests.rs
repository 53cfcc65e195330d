//! Gaits of worms that pause, begin and end anywhere, and are seen badly; and what is not a gait.

use super::{IdentifiedGait, Prior, find};
use crate::identify::GaitError;
use crate::recording::Recording;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use worm_physics::{Contact, Motion, Worm};

const NOISE_M: f64 = 1e-4;
const PERIOD_S: f64 = 1.0 / 120.0;

/// How a crawl is seen.
#[derive(Debug, Clone, Copy)]
struct Visibility {
    dropout_share: f64,
    outlier_fraction: f64, // 5 mm off
    pauses: usize,
}

const GOOD: Visibility = Visibility {
    dropout_share: 0.0,
    outlier_fraction: 0.0,
    pauses: 0,
};
const BAD: Visibility = Visibility {
    dropout_share: 0.05,
    outlier_fraction: 0.005,
    pauses: 2,
};

struct SeenCrawl {
    time_s: Vec<f64>,
    phase: Vec<f64>,
    measured_m: Vec<Vec<f64>>,
}

impl SeenCrawl {
    fn find(&self, step_order: &[usize], phase: Option<&[f64]>) -> Result<IdentifiedGait, GaitError> {
        let filled_m = Recording {
            source: "seen".into(),
            cell_names: Vec::new(),
            time_s: self.time_s.clone(),
            position_m: self.measured_m.clone(),
            gait_phase: None,
            motor: None,
            warnings: Vec::new(),
            repairs: Vec::new(),
        }
        .filled();
        find(&self.time_s, &self.measured_m, &filled_m, Prior { step_order, phase })
    }

    fn mirrored(mut self) -> Self {
        self.measured_m.iter_mut().flatten().for_each(|at_m| *at_m = -*at_m);
        self
    }
}

/// A worm on the level crawls from a phase for some cycles of 80 samples a step, and pauses where it pleases.
fn crawl(step_order: &[usize], from: f64, cycles: f64, visibility: Visibility, seed: u64) -> SeenCrawl {
    let cells = step_order.len();
    let worm = Worm::uniform(cells, Contact::symmetric(980.0, 1.75e-3), 0.333, 11.5e-3)
        .and_then(|worm| worm.with_step_order(step_order))
        .expect("a worm");
    let places_m: Vec<f64> = (0..cells).rev().map(|behind| behind as f64 * 0.04).collect();
    let mut motion = Motion::under_way(&worm, from, &places_m, &vec![0.0; cells]);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let per_sample = 1.0 / (80.0 * cells as f64);
    let pauses: Vec<f64> = (0..visibility.pauses)
        .map(|_| from + cycles * rng.random_range(0.2..0.8))
        .collect();
    let mut seen = SeenCrawl {
        time_s: Vec::new(),
        phase: Vec::new(),
        measured_m: vec![Vec::new(); cells],
    };
    let mut phase = from;
    while phase <= from + cycles {
        motion.advance_to(&worm, phase).expect("on the level it holds");
        let rests = pauses
            .iter()
            .filter(|&&pause| (phase..phase + per_sample).contains(&pause))
            .count();
        for _ in 0..=rests * 150 {
            seen.time_s.push(seen.time_s.len() as f64 * PERIOD_S);
            seen.phase.push(phase);
            for (series, true_m) in seen.measured_m.iter_mut().zip(motion.positions_m()) {
                let noise: f64 = StandardNormal.sample(&mut rng);
                let mut at_m = true_m + NOISE_M * noise;
                if rng.random_bool(visibility.outlier_fraction) {
                    at_m += 5e-3;
                }
                series.push(if rng.random_bool(visibility.dropout_share) {
                    f64::NAN
                } else {
                    at_m
                });
            }
        }
        phase += per_sample;
    }
    seen
}

fn shuffled(cells: usize, seed: u64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..cells).collect();
    order.shuffle(&mut Xoshiro256PlusPlus::seed_from_u64(seed));
    order
}

/// Root mean square of the error of the phase, whole cycles apart, cycles.
fn phase_error(gait: &IdentifiedGait, truth: &[f64]) -> f64 {
    let apart = (gait.phase[truth.len() / 2] - truth[truth.len() / 2]).round();
    let squares = gait
        .phase
        .iter()
        .zip(truth)
        .map(|(found, truth)| (found - truth - apart).powi(2));
    (squares.sum::<f64>() / truth.len() as f64).sqrt()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, rng_seed: RngSeed::Fixed(2016), failure_persistence: None, ..ProptestConfig::default() })]

    /// Where the configured order has the same cyclic order, its first cell begins the cycle.
    #[test]
    fn any_order_is_found_from_badly_seen_positions(
        cells in 2_usize..=16,
        seed in any::<u64>(),
        from in 0.0..1.0,
        cycles in 3.2..6.0,
    ) {
        let order = shuffled(cells, seed);
        let seen = crawl(&order, from, cycles, BAD, seed);
        let gait = match seen.find(&order, None) {
            // Two cells do not tell how far the phase is while the motor pauses.
            Err(GaitError::Uneven { .. }) if cells == 2 => return Ok(()),
            found => found.map_err(|error| TestCaseError::fail(error.to_string()))?,
        };
        prop_assert_eq!(&gait.step_order, &order);
        if cells > 2 {
            let error = phase_error(&gait, &seen.phase);
            prop_assert!(error < 0.05 / cells as f64, "phase off by {} cycles", error);
            prop_assert!((gait.stroke_m / 11.5e-3 - 1.0).abs() < 0.01, "stroke {} m", gait.stroke_m);
        }
        prop_assert!(gait.phase.windows(2).all(|pair| pair[1] >= pair[0]));
    }

    /// Noise has no gait, and whatever it is taken for, nothing panics.
    #[test]
    fn nothing_but_noise_is_an_error(cells in 2_usize..=6, samples in 0_usize..400, seed in any::<u64>()) {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut noise = || -> Vec<f64> { (0..samples).map(|_| StandardNormal.sample(&mut rng)).collect() };
        let seen = SeenCrawl {
            time_s: (0..samples).map(|at| at as f64 * PERIOD_S).collect(),
            phase: (0..samples).map(|at| at as f64 * 0.01).collect(),
            measured_m: (0..cells).map(|_| noise()).collect(),
        };
        let order = shuffled(cells, seed);
        prop_assert!(seen.find(&order, None).is_err());
    }
}

#[test]
fn an_order_that_was_configured_otherwise_is_found_all_the_same() {
    let seen = crawl(&[2, 0, 3, 1], 0.4, 6.0, GOOD, 3);
    let gait = seen.find(&[0, 1, 2, 3], None).expect("a gait");
    let first = gait
        .step_order
        .iter()
        .position(|&cell| cell == 2)
        .expect("cell 3 steps");
    let mut order = gait.step_order.clone();
    order.rotate_left(first);
    assert_eq!(order, [2, 0, 3, 1]);
    // The same cyclic order, configured to begin elsewhere.
    let gait = seen.find(&[3, 1, 2, 0], None).expect("a gait");
    assert_eq!(gait.step_order, [3, 1, 2, 0]);
}

#[test]
fn two_cells_have_a_gait_while_the_motor_turns_evenly() {
    for (seed, from) in [(1, 0.0), (2, 0.3), (3, 0.7)] {
        let seen = crawl(&[1, 0], from, 5.0, Visibility { pauses: 0, ..BAD }, seed);
        let gait = seen.find(&[1, 0], None).expect("a gait");
        assert_eq!(gait.step_order, [1, 0]);
        assert!(
            (gait.stroke_m / 11.5e-3 - 1.0).abs() < 0.04,
            "stroke {} m",
            gait.stroke_m
        );
        assert!(phase_error(&gait, &seen.phase) < 0.05, "seed {seed}");
    }
}

#[test]
fn outliers_are_counted_and_left_out() {
    let mut seen = crawl(&[0, 1, 2, 3], 0.0, 6.0, GOOD, 4);
    for sample in (50..seen.time_s.len()).step_by(100) {
        seen.measured_m[sample / 100 % 4][sample] += 5e-3;
    }
    let outliers = (50..seen.time_s.len()).step_by(100).count();
    let gait = seen.find(&[0, 1, 2, 3], None).expect("a gait");
    assert!(
        (outliers..outliers + 4).contains(&gait.outliers),
        "{} of {outliers}",
        gait.outliers
    );
    assert!((gait.noise_m / NOISE_M - 1.0).abs() < 0.2, "noise {} m", gait.noise_m);
}

#[test]
fn what_is_no_gait_is_said() {
    let order = [0, 1, 2, 3];
    let plain = |cycles| crawl(&order, 0.0, cycles, GOOD, 5);

    assert_eq!(
        plain(6.0).mirrored().find(&order, None).expect_err("no gait"),
        GaitError::Backward
    );

    for cell in 0..4 {
        for (what, still) in [
            ("lies on the canal", vec![0.1; 4000]),
            ("is a marker between the others", Vec::new()),
        ] {
            let mut seen = plain(6.0);
            for sample in 0..seen.time_s.len() {
                let others_m = (0..4)
                    .filter(|&other| other != cell)
                    .map(|other| seen.measured_m[other][sample]);
                let middle_m = others_m.sum::<f64>() / 3.0;
                seen.measured_m[cell][sample] = still.get(sample).copied().unwrap_or(middle_m);
            }
            match seen.find(&order, None).expect_err("no gait") {
                GaitError::NoStep { cell: named, .. } => assert_eq!(named, cell, "cell {cell} {what}"),
                other => panic!("cell {cell} {what}: {other}"),
            }
        }
    }

    let too_short = plain(1.6).find(&order, None).expect_err("no gait");
    assert!(matches!(too_short, GaitError::TooFewSteps { .. }), "{too_short}");

    // Cells that step when they please.
    for seed in 1..=20 {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut seen = plain(0.0);
        let mut at_m = [0.12, 0.08, 0.04, 0.0];
        seen.measured_m = vec![Vec::new(); 4];
        for _ in 0..40 {
            let stepping = rng.random_range(0..4);
            for _ in 0..80 {
                at_m[stepping] += 11.5e-3 / 80.0;
                for (series, at_m) in seen.measured_m.iter_mut().zip(at_m) {
                    let noise: f64 = StandardNormal.sample(&mut rng);
                    series.push(at_m + NOISE_M * noise);
                }
            }
        }
        seen.time_s = (0..3200).map(|at| f64::from(at) * PERIOD_S).collect();
        let error = seen.find(&order, None).expect_err("there is no order");
        assert!(
            matches!(
                error,
                GaitError::Disorder { .. } | GaitError::NoStep { .. } | GaitError::TooFewSteps { .. }
            ),
            "seed {seed}: {error}"
        );
    }
}

#[test]
fn a_phase_that_contradicts_the_positions_is_refused() {
    let order = [0, 1, 2, 3];
    let seen = crawl(&order, 0.0, 6.0, GOOD, 6);
    let of = |change: &dyn Fn(f64) -> f64| {
        seen.find(
            &order,
            Some(&seen.phase.iter().map(|&phase| change(phase)).collect::<Vec<_>>()),
        )
    };
    assert_eq!(of(&|phase| phase).expect("the true phase").step_order, order);
    type Change<'c> = &'c dyn Fn(f64) -> f64;
    let table: [(&str, Change<'_>, &str); 7] = [
        ("counted in steps", &|phase| 4.0 * phase, "counted in cycles"),
        ("counted in degrees", &|phase| 360.0 * phase, "counted in cycles"),
        ("of another gait", &|phase| 0.73 * phase, "counted in cycles"),
        ("wound up again each cycle", &f64::fract, "begins anew"),
        ("beyond all counting", &|phase| 1e13 + phase, "count whole cycles"),
        ("no number", &|_| f64::NAN, "count whole cycles"),
        (
            "infinite",
            &|phase| if phase > 3.0 { f64::INFINITY } else { phase },
            "count whole cycles",
        ),
    ];
    for (what, change, words) in table {
        let error = of(change).map(|gait| gait.step_order).expect_err(what);
        let is_said = error.to_string().contains(words);
        assert!(matches!(error, GaitError::Phase(_)) && is_said, "{what}: {error}");
    }
    assert_eq!(
        of(&|phase| -phase).map(|gait| gait.step_order).expect_err("backward"),
        GaitError::Backward
    );
    let short = of(&|phase| phase / 10.0)
        .map(|gait| gait.step_order)
        .expect_err("half a cycle");
    assert!(matches!(short, GaitError::TooFewSteps { .. }), "{short}");
}

#[test]
fn tiny_constant_and_unseen_recordings_are_errors() {
    for samples in [0, 1, 2, 3, 4, 9, 10, 11, 50] {
        for at_m in [0.0, 1.0, f64::NAN, f64::INFINITY] {
            for cells in [2, 4] {
                let seen = SeenCrawl {
                    time_s: (0..samples).map(|at| at as f64 * PERIOD_S).collect(),
                    phase: (0..samples).map(|at| at as f64).collect(),
                    measured_m: vec![vec![at_m; samples]; cells],
                };
                let order = shuffled(cells, 1);
                assert!(
                    seen.find(&order, None).is_err(),
                    "{cells} cells at {at_m}, {samples} samples"
                );
                // With a recorded phase the stroke may come out as nothing, but nothing panics.
                if let Ok(gait) = seen.find(&order, Some(&seen.phase)) {
                    assert!(gait.stroke_m.is_nan() || gait.stroke_m < 1e-6, "{gait:?}");
                }
            }
        }
    }
}
