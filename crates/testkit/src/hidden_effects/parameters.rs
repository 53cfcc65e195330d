//! The true parameters of a worm: all near their nominal values, none exactly.

use super::MAX_CELLS;
use super::motor::Motor;
use super::tip::contact::Contact;
use crate::nominal::{DAMPING_RATIO, MASS_KG, MAX_DEFORMATION_M, SPACING_M, STIFFNESS_N_PER_M, STROKE_M};
use crate::random::{about_one, log_uniform, shuffle};
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Cells of the paper's worm.
const NOMINAL_CELLS: usize = 4;

/// A value for each of so many cells; 1 beyond them.
pub fn each_of(cells: usize, mut value: impl FnMut(usize) -> f64) -> [f64; MAX_CELLS] {
    std::array::from_fn(|cell| if cell < cells { value(cell) } else { 1.0 })
}

/// The worm's parameters, before an effect is hidden in it.
#[derive(Debug, Clone)]
pub struct WormParameters {
    pub cells: usize,
    /// Mass of the whole worm in equal shares, kg.
    pub mass_kg: f64,
    /// Friction force of each tip, N.
    pub friction_n: [f64; MAX_CELLS],
    /// Stiffness of each pad, N/m.
    pub stiffness_n_per_m: [f64; MAX_CELLS],
    pub stroke_m: f64,
    /// Distance between neighbouring cells at rest, m.
    pub spacing_m: f64,
    /// How the tips hold to the canal.
    pub contact: Contact,
    /// Damping of the contacts; 1 is critical for the body on all its tips.
    pub damping_ratio: f64,
    /// Fraction of a step in which the cam accelerates a cell, and again in which it stops it.
    pub rounding: f64,
    pub motor: Motor,
    /// Standard deviation of each tip's friction from cycle to cycle, relative.
    pub scatter: f64,
    /// Cells from 0, in the order in which they step.
    pub step_order: Vec<usize>,
}

impl WormParameters {
    /// The nominal worm of four cells, on tips that do not yield before they slide.
    pub fn nominal() -> Self {
        Self {
            cells: NOMINAL_CELLS,
            mass_kg: MASS_KG,
            friction_n: [STIFFNESS_N_PER_M * MAX_DEFORMATION_M; MAX_CELLS],
            stiffness_n_per_m: [STIFFNESS_N_PER_M; MAX_CELLS],
            stroke_m: STROKE_M,
            spacing_m: SPACING_M,
            contact: Contact::rigid(),
            damping_ratio: DAMPING_RATIO,
            rounding: 0.005,
            motor: Motor::even(),
            scatter: 0.0,
            step_order: (0..NOMINAL_CELLS).collect(),
        }
    }

    /// A worm drawn at random.
    pub fn draw(rng: &mut Xoshiro256PlusPlus) -> Self {
        let nominal = Self::nominal();
        let friction = about_one(0.08, rng);
        let stiffness = about_one(0.04, rng);
        Self {
            cells: nominal.cells,
            mass_kg: nominal.mass_kg * about_one(0.005, rng),
            friction_n: each_of(nominal.cells, |cell| {
                nominal.friction_n[cell] * friction * about_one(0.02, rng)
            }),
            stiffness_n_per_m: each_of(nominal.cells, |cell| {
                nominal.stiffness_n_per_m[cell] * stiffness * about_one(0.015, rng)
            }),
            stroke_m: nominal.stroke_m * about_one(0.01, rng),
            // Cells are said to sit "about 40 mm apart": their distance must not reveal a wrong sensor scale.
            spacing_m: rng.random_range(0.036..0.044),
            contact: Contact::draw(rng),
            damping_ratio: 10f64.powf(rng.random_range(-1.0..0.0)),
            rounding: log_uniform(0.002, 0.03, rng),
            motor: Motor::draw(rng),
            scatter: rng.random_range(0.005..0.015),
            step_order: {
                let mut order = nominal.step_order.clone();
                if rng.random_range(0..4) == 0 {
                    shuffle(&mut order, rng);
                }
                order
            },
        }
    }

    /// Each tip's friction in each cycle over its mean: `[cell][cycle]`.
    pub fn scatter_over(&self, cycles: usize, rng: &mut Xoshiro256PlusPlus) -> Vec<Vec<f64>> {
        let each = |_| (0..cycles).map(|_| about_one(self.scatter, rng)).collect();
        (0..self.cells).map(each).collect()
    }
}
