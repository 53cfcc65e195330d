//! The smoother on a gait phase whose truth is known.

use super::{never_falling, smooth};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

const SIGMA: f64 = 3e-3; // of one reading, cycles
const PERIOD_S: f64 = 1.0 / 120.0;

/// A gait phase that gets faster at half-time.
fn truth(time_s: f64) -> f64 {
    0.3 * time_s + 0.25 * (time_s - 6.0).max(0.0)
}

fn times() -> Vec<f64> {
    (0..1440).map(|at| f64::from(at) * PERIOD_S).collect()
}

fn readings(seed: u64, is_seen: impl Fn(usize, &mut Xoshiro256PlusPlus) -> bool) -> Vec<Option<(f64, f64)>> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let read = |(at, time_s): (usize, f64)| {
        let noise: f64 = StandardNormal.sample(&mut rng);
        is_seen(at, &mut rng).then_some((truth(time_s) + SIGMA * noise, SIGMA * SIGMA))
    };
    times().into_iter().enumerate().map(read).collect()
}

fn rms_error(value: &[f64]) -> f64 {
    let squares = value
        .iter()
        .zip(times())
        .map(|(value, time_s)| (value - truth(time_s)).powi(2));
    (squares.sum::<f64>() / value.len() as f64).sqrt()
}

#[test]
fn a_ramp_with_a_kink_is_at_least_twice_as_exact_smoothed() {
    for seed in 1..=5 {
        let smoothed = smooth(&times(), &readings(seed, |_, _| true));
        let error = rms_error(&smoothed.value);
        assert!(error < 0.5 * SIGMA, "seed {seed}: {error} of {SIGMA}");
        let told = smoothed.sigma / error;
        assert!(
            (0.5..2.0).contains(&told),
            "seed {seed}: {} is told, {error} true",
            smoothed.sigma
        );
    }
}

#[test]
fn missing_readings_are_bridged() {
    for seed in 1..=5 {
        let gappy = readings(seed, |at, rng| !(300..330).contains(&at) && rng.random_bool(0.7));
        let value = smooth(&times(), &gappy).value;
        let error = rms_error(&value);
        assert!(error < 0.5 * SIGMA, "seed {seed}: {error} of {SIGMA}");
        let in_gap = (300..330)
            .map(|at| (value[at] - truth(times()[at])).abs())
            .fold(0.0, f64::max);
        assert!(in_gap < 2.0 * SIGMA, "seed {seed}: off by {in_gap} in the gap");
    }
}

#[test]
fn nothing_read_is_nothing_known_but_no_panic() {
    assert!(smooth(&[], &[]).value.is_empty());
    assert_eq!(smooth(&[0.0, 1.0, 2.0], &[None; 3]).value, [0.0; 3]);
    let one = smooth(&[0.0, 1.0, 2.0], &[None, Some((5.0, 1e-6)), None]).value;
    assert!(one.iter().all(|value| (value - 5.0).abs() < 1e-3), "{one:?}");
}

#[test]
fn what_falls_is_levelled() {
    assert_eq!(never_falling(&[1.0, 3.0, 2.0, 4.0, 0.0]), [1.0, 2.25, 2.25, 2.25, 2.25]);
    assert_eq!(never_falling(&[0.0, 9.0, 1.0, 2.0, 8.0]), [0.0, 4.0, 4.0, 4.0, 8.0]);
    assert!(never_falling(&[]).is_empty());
}
