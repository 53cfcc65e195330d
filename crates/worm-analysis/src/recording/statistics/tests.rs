use super::{moves, noise, quantile, spread};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// A ramp of 1 mm a sample with Gaussian noise of 0.1 mm.
fn noisy_ramp(seed: u64, slope_m: f64) -> Vec<f64> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let normal = Normal::new(0.0, 1e-4).expect("a width");
    (0..2_000)
        .map(|sample| slope_m * f64::from(sample) + normal.sample(&mut rng))
        .collect()
}

#[test]
fn quantiles_are_those_of_the_seen_values() {
    let values = [f64::NAN, 5.0, 1.0, 3.0, f64::NAN, 2.0, 4.0];
    for (fraction, expected) in [(0.0, 1.0), (0.25, 2.0), (0.5, 3.0), (0.75, 4.0), (1.0, 5.0)] {
        assert_eq!(quantile(values, fraction), Some(expected), "{fraction}");
    }
    assert_eq!(quantile([f64::NAN], 0.5), None);
    assert_eq!(spread([f64::NAN]), 0.0);
}

#[test]
fn noise_is_found_under_any_steady_motion_and_beside_stray_values() {
    for seed in 0..5 {
        for slope_m in [0.0, 1e-3, -2e-2] {
            let mut series = noisy_ramp(seed, slope_m);
            for stray in 0..20 {
                series[97 * stray + 5] += 0.05;
            }
            let found_m = noise(&series);
            assert!(
                (found_m / 1e-4 - 1.0).abs() < 0.1,
                "seed {seed}, {slope_m} m: {found_m}"
            );
        }
    }
}

#[test]
fn a_series_moves_when_it_leaves_its_noise_behind() {
    for seed in 0..5 {
        assert!(!moves(&noisy_ramp(seed, 0.0)), "seed {seed}");
        assert!(moves(&noisy_ramp(seed, 1e-6)), "seed {seed}: 2 mm in all");
    }
    assert!(!moves(&[0.1; 100]));
}
