//! Draws that several simulated worms share. The same generator in the same state gives the same values.

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Standard deviations beyond which a normal value is drawn again.
const MAX_SIGMAS: f64 = 2.2;

/// A value from a range, log-uniform.
pub fn log_uniform(min: f64, max: f64, rng: &mut Xoshiro256PlusPlus) -> f64 {
    min * (max / min).powf(rng.random::<f64>())
}

/// A standard normal value.
pub fn normal(rng: &mut Xoshiro256PlusPlus) -> f64 {
    StandardNormal.sample(rng)
}

/// A standard normal value, truncated at 2.2 standard deviations.
pub fn truncated_normal(rng: &mut Xoshiro256PlusPlus) -> f64 {
    loop {
        let value = normal(rng);
        if value.abs() <= MAX_SIGMAS {
            return value;
        }
    }
}

/// A factor about 1 with a standard deviation `sigma`, truncated as [`truncated_normal`].
pub fn about_one(sigma: f64, rng: &mut Xoshiro256PlusPlus) -> f64 {
    1.0 + sigma * truncated_normal(rng)
}

/// Puts the entries in a random order, each order as likely as any other.
pub fn shuffle(order: &mut [usize], rng: &mut Xoshiro256PlusPlus) {
    for last in (1..order.len()).rev() {
        order.swap(last, rng.random_range(0..=last));
    }
}
