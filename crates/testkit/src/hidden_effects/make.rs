//! How a worm was made: everywhere near what is believed of it, nowhere quite.

use super::CELLS;
use super::motor::Motor;
use super::tip::contact::{Contact, between};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Deviations beyond so many standard deviations are thrown again.
const WIDEST: f64 = 2.2;

/// The worm's own figures, before anything is hidden in it.
#[derive(Debug, Clone)]
pub struct Make {
    /// Mass of the whole worm in equal shares, kg.
    pub mass_kg: f64,
    /// Friction force of each tip, N.
    pub friction_n: [f64; CELLS],
    /// Stiffness of each pad, N/m.
    pub stiffness_n_per_m: [f64; CELLS],
    pub stroke_m: f64,
    /// Distance between neighbouring cells at rest, m.
    pub spacing_m: f64,
    /// How the tips hold to the canal.
    pub contact: Contact,
    /// Damping of the contacts; 1 is critical for the body on all its tips.
    pub damping_ratio: f64,
    /// Share of a step in which the cam gets a cell to speed, and again in which it stops it.
    pub rounding: f64,
    pub motor: Motor,
    /// Standard deviation of each tip's friction from cycle to cycle, as a share.
    pub scatter: f64,
    /// Cells from 0, in the order in which they step.
    pub step_order: [usize; CELLS],
}

impl Make {
    /// The worm that is believed in, on tips that do not give before they slide.
    pub fn nominal() -> Self {
        Self {
            mass_kg: 0.333,
            friction_n: [980.0 * 1.75e-3; CELLS],
            stiffness_n_per_m: [980.0; CELLS],
            stroke_m: 0.0115,
            spacing_m: 0.040,
            contact: Contact::rigid(),
            damping_ratio: 0.3,
            rounding: 0.005,
            motor: Motor::even(),
            scatter: 0.0,
            step_order: std::array::from_fn(|cell| cell),
        }
    }

    /// A worm as one finds them.
    pub fn draw(rng: &mut Xoshiro256PlusPlus) -> Self {
        let nominal = Self::nominal();
        let friction = about_one(0.08, rng);
        let stiffness = about_one(0.04, rng);
        Self {
            mass_kg: nominal.mass_kg * about_one(0.005, rng),
            friction_n: nominal.friction_n.map(|n| n * friction * about_one(0.02, rng)),
            stiffness_n_per_m: nominal
                .stiffness_n_per_m
                .map(|n_per_m| n_per_m * stiffness * about_one(0.015, rng)),
            stroke_m: nominal.stroke_m * about_one(0.01, rng),
            // Cells are said to sit "about 40 mm apart": their distance must not give a wrong ruler away.
            spacing_m: rng.random_range(0.036..0.044),
            contact: Contact::draw(rng),
            damping_ratio: 10f64.powf(rng.random_range(-1.0..0.0)),
            rounding: between(0.002, 0.03, rng),
            motor: Motor::draw(rng),
            scatter: rng.random_range(0.005..0.015),
            step_order: if rng.random_range(0..4) == 0 {
                shuffled(rng)
            } else {
                nominal.step_order
            },
        }
    }

    /// Each tip's friction in each cycle over its mean: `[cell][cycle]`.
    pub fn scatter_over(&self, cycles: usize, rng: &mut Xoshiro256PlusPlus) -> Vec<Vec<f64>> {
        let each = |_| (0..cycles).map(|_| about_one(self.scatter, rng)).collect();
        (0..CELLS).map(each).collect()
    }
}

/// A factor about 1 with a standard deviation, its far ends cut off.
pub fn about_one(sigma: f64, rng: &mut Xoshiro256PlusPlus) -> f64 {
    1.0 + sigma * normal(rng)
}

/// A standard normal value, its far ends cut off.
pub fn normal(rng: &mut Xoshiro256PlusPlus) -> f64 {
    loop {
        let value: f64 = StandardNormal.sample(rng);
        if value.abs() <= WIDEST {
            return value;
        }
    }
}

fn shuffled(rng: &mut Xoshiro256PlusPlus) -> [usize; CELLS] {
    let mut order = std::array::from_fn(|cell| cell);
    for last in (1..CELLS).rev() {
        order.swap(last, rng.random_range(0..=last));
    }
    order
}
