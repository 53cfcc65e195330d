//! The drift against random walks that are known to be ones.

use super::Drift;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

const SAMPLES: usize = 3000;
const PER_CYCLE_M2: f64 = 2.5e-9; // 50 µm in a cycle
const NOISE_M2: f64 = 1e-10;

/// Phases of a motor that runs unevenly, 100 samples to a cycle.
fn phases() -> Vec<f64> {
    (0..SAMPLES)
        .map(|at| at as f64 * 0.01 + 0.004 * (at as f64 * 0.37).sin())
        .collect()
}

/// A third of the samples is twice as noisy, every seventh is not seen.
fn variances() -> Vec<f64> {
    (0..SAMPLES)
        .map(|at| match at {
            at if at % 7 == 3 => f64::INFINITY,
            at if at % 3 == 0 => 4.0 * NOISE_M2,
            _ => NOISE_M2,
        })
        .collect()
}

fn walk(seed: u64) -> Vec<f64> {
    let (phase, variance_m2) = (phases(), variances());
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut drift_m = 0.3;
    (0..SAMPLES)
        .map(|at| {
            drift_m += (PER_CYCLE_M2 * (phase[at] - phase[at.saturating_sub(1)])).sqrt() * normal();
            if variance_m2[at].is_finite() {
                drift_m + variance_m2[at].sqrt() * normal()
            } else {
                f64::NAN
            }
        })
        .collect()
}

fn drift(per_cycle_m2: f64) -> Drift {
    Drift::new(&phases(), &variances(), per_cycle_m2)
}

fn whitened_residuals(drift: &Drift, series: &[f64]) -> Vec<f64> {
    let mut whitened_residuals = Vec::new();
    drift.whiten(series.iter().copied(), |whitened| whitened_residuals.push(whitened));
    whitened_residuals
}

#[test]
fn whitening_is_linear() {
    let drift = drift(PER_CYCLE_M2);
    let (a, b) = (walk(1), walk(2));
    let sum: Vec<f64> = a.iter().zip(&b).map(|(a, b)| 2.0 * a - 3.0 * b).collect();
    let (white_a, white_b) = (whitened_residuals(&drift, &a), whitened_residuals(&drift, &b));
    for (at, white) in whitened_residuals(&drift, &sum).into_iter().enumerate() {
        let expected = 2.0 * white_a[at] - 3.0 * white_b[at];
        assert!((white - expected).abs() < 1e-8, "sample {at}: {white}, not {expected}");
    }
}

#[test]
fn surprises_of_a_walk_are_independent_with_variance_1() {
    let drift = drift(PER_CYCLE_M2);
    for seed in 1..=5 {
        let all = whitened_residuals(&drift, &walk(seed));
        let seen: Vec<f64> = (1..SAMPLES).filter(|at| at % 7 != 3).map(|at| all[at]).collect();
        let count = seen.len() as f64;
        let variance = seen.iter().map(|whitened| whitened * whitened).sum::<f64>() / count;
        let error = (2.0 / count).sqrt();
        assert!((variance - 1.0).abs() < 4.0 * error, "seed {seed}: variance {variance}");
        for lag in 1..=3 {
            let products = seen.iter().zip(&seen[lag..]).map(|(a, b)| a * b);
            let correlation = products.sum::<f64>() / count;
            assert!(
                correlation.abs() < 4.0 / count.sqrt(),
                "seed {seed}, lag {lag}: {correlation}"
            );
        }
    }
}

#[test]
fn the_true_drift_is_the_likeliest() {
    for seed in 1..=5 {
        let series = walk(seed);
        let chi_squareds = [0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 16.0].map(|factor| {
            (
                drift(factor * factor * PER_CYCLE_M2).chi_squared(series.iter().copied()),
                factor,
            )
        });
        let min = chi_squareds
            .iter()
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .expect("candidates");
        assert_eq!(min.1, 1.0, "seed {seed}: {chi_squareds:?}");
    }
}

#[test]
fn smoothing_keeps_constants_and_bridges_gaps_with_straight_lines() {
    let phase: Vec<f64> = (0..100).map(|at| f64::from(at) * 0.01).collect();
    let mut variance_m2 = vec![NOISE_M2; 100];
    for gap in [0..5, 40..60, 90..100] {
        variance_m2[gap].fill(f64::INFINITY);
    }
    let drift = Drift::new(&phase, &variance_m2, PER_CYCLE_M2);
    let series_of = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
        (0..100)
            .map(|at| if variance_m2[at].is_finite() { of(at) } else { f64::NAN })
            .collect()
    };
    let level = drift.smooth(&series_of(&|_| 7e-3));
    assert!(level.iter().all(|drift_m| (drift_m - 7e-3).abs() < 1e-15), "{level:?}");

    let step = drift.smooth(&series_of(&|at| if at < 50 { 0.0 } else { 1e-3 }));
    for at in 41..59 {
        let bend_m = step[at - 1] - 2.0 * step[at] + step[at + 1];
        assert!(bend_m.abs() < 1e-15, "sample {at}: {bend_m} m");
    }
    assert!(step[39] < 0.2e-3 && step[60] > 0.8e-3, "{} m, {} m", step[39], step[60]);
    assert!(
        (step[0] - step[5]).abs() < 1e-15 && (step[99] - step[89]).abs() < 1e-15,
        "held beyond the ends"
    );
}

#[test]
fn a_walk_that_nobody_saw_is_0() {
    let drift = Drift::new(&[0.0, 0.1, 0.2], &[f64::INFINITY; 3], PER_CYCLE_M2);
    assert_eq!(drift.smooth(&[f64::NAN; 3]), [0.0; 3]);
    assert_eq!(whitened_residuals(&drift, &[f64::NAN; 3]), [0.0; 3]);
    assert!(Drift::new(&[], &[], PER_CYCLE_M2).smooth(&[]).is_empty());
}
