//! Physics prepared for the incremental motion: every table that does not change while the worm moves.

use super::pad::{ELEMENTS, PadLaw};
use super::physics::{Laws, Physics};
use super::table::Tables;
use super::worm::Worm;
use crate::MAX_CELLS;

/// Distance over which a patch of different friction begins and ends, m: a tip has a width.
const PATCH_EDGE_M: f64 = 1e-3;

/// The angle of the cam.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cam {
    turns: f64, // whole
    steps: f64, // since the last whole turn, 0 to the number of cells
}

/// Physics prepared for [`super::Crawl`].
#[derive(Debug, Clone)]
pub struct Mechanics {
    pub(super) worm: Worm, // with the effect of the slope on its clamps
    pub(super) laws: Laws,
    pub(super) tables: Tables,
    pub(super) pad: [PadLaw; MAX_CELLS],
    pub(super) pull_n: f64,
    pub(super) mass_kg: f64,
    pub(super) full_force_n: f64,
    pub(super) standing_n: [f64; MAX_CELLS], // weight along the canal and part of the constant force, for each cell
    pub(super) critical_n_s_per_m: f64,      // critical damping, for one cell
    place_of: [usize; MAX_CELLS],            // in the step order, for each cell
}

impl Mechanics {
    /// The tables for some physics.
    pub fn new(physics: &Physics) -> Self {
        let worm = physics.clamped_worm();
        let laws = physics.laws;
        let mut pad = [PadLaw::default(); MAX_CELLS];
        for (law, contact) in pad.iter_mut().zip(worm.contacts()) {
            let stiffness = contact.stiffness_n_per_m;
            let bound_m = contact.forward_bound_m;
            *law = PadLaw {
                stiffness_n_per_m: (1.0 - laws.yielding_share) * stiffness,
                forward_n: stiffness * bound_m,
                backward_n: stiffness * contact.backward_bound_m,
                static_over_kinetic: laws.static_over_kinetic,
                slip_m: laws.slip_m,
                grip_s: laws.grip_s,
                presliding: laws.presliding,
                hardening_per_m2: if bound_m > 0.0 {
                    laws.hardening / (bound_m * bound_m)
                } else {
                    0.0
                },
                creep_n_per_m: laws.creep_share * stiffness,
                element_n_per_m: laws.yielding_share * stiffness / ELEMENTS as f64,
                element_yield_m: std::array::from_fn(|at| bound_m * (at as f64 + 0.5) / ELEMENTS as f64),
            };
        }
        let mut place_of = [0; MAX_CELLS];
        for (place, &cell) in worm.step_order().iter().enumerate() {
            place_of[cell] = place;
        }
        let mut standing_n = [0.0; MAX_CELLS];
        let mut whole_n_per_m = 0.0;
        for (cell, contact) in worm.contacts().iter().enumerate() {
            standing_n[cell] = worm.cell_weight_n(cell) + worm.cell_resistance_n();
            whole_n_per_m += contact.stiffness_n_per_m;
        }
        Self {
            standing_n,
            critical_n_s_per_m: 2.0 * (whole_n_per_m * worm.mass_kg()).sqrt() / worm.cells() as f64,
            pull_n: worm.pull_n(),
            mass_kg: worm.mass_kg(),
            full_force_n: pad.iter().map(|law| law.forward_n.max(law.backward_n)).sum::<f64>()
                + physics.tables.full_force_n(worm.cells()),
            tables: physics.tables.clone(),
            laws,
            pad,
            place_of,
            worm,
        }
    }

    /// The worm, with the effect of the slope on its clamps.
    pub fn worm(&self) -> &Worm {
        &self.worm
    }

    /// Displacement of a cell in the body by the drive at a phase, m, since phase 0.
    pub fn drive_m(&self, cell: usize, phase: f64) -> f64 {
        self.drive_at_m(cell, &self.cam(phase))
    }

    /// The cam's angle at a phase.
    pub(super) fn cam(&self, phase: f64) -> Cam {
        let turns = phase.floor();
        Cam {
            turns,
            steps: (phase - turns) * self.worm.cells() as f64,
        }
    }

    /// As [`drive_m`](Self::drive_m), for a known angle of the cam.
    #[inline]
    pub(super) fn drive_at_m(&self, cell: usize, cam: &Cam) -> f64 {
        let cells = self.worm.cells() as f64;
        let stroke_m = self.worm.stroke_of_m(cell);
        let overlap = self.laws.overlap;
        // Steps since this cell began a step of its own, early by the overlap.
        let mut turns = cam.turns;
        let mut steps = cam.steps - self.place_of[cell] as f64 + overlap;
        if steps < 0.0 {
            turns -= 1.0;
            steps += cells;
        } else if steps >= cells {
            turns += 1.0;
            steps -= cells;
        }
        let fraction = self.rounded((steps / (1.0 + overlap)).min(1.0));
        stroke_m * (turns + fraction)
    }

    /// Rate at which the drive moves a cell in the body, m per cycle of phase.
    pub(super) fn drive_slope_m(&self, cell: usize, cam: &Cam) -> f64 {
        let cells = self.worm.cells() as f64;
        let steps = (cam.steps - self.place_of[cell] as f64 + self.laws.overlap).rem_euclid(cells);
        let fraction = steps / (1.0 + self.laws.overlap);
        if fraction < 1.0 {
            self.worm.stroke_of_m(cell) * self.speed(fraction) * cells / (1.0 + self.laws.overlap)
        } else {
            0.0
        }
    }

    /// Fraction of a step that is done after a fraction of its time: uniform, except at the rounded corners of the cam, where the cell
    /// accelerates and decelerates uniformly.
    #[inline]
    fn rounded(&self, fraction: f64) -> f64 {
        let rounding = self.laws.rounding;
        if rounding == 0.0 {
            return fraction;
        }
        let from_end = fraction.min(1.0 - fraction);
        let near = if from_end < rounding {
            0.5 * from_end * from_end / rounding
        } else {
            from_end - 0.5 * rounding
        } / (1.0 - rounding);
        if fraction < 0.5 { near } else { 1.0 - near }
    }

    /// Speed over the mean speed of the step, after a fraction of its time.
    fn speed(&self, fraction: f64) -> f64 {
        let rounding = self.laws.rounding;
        let from_end = fraction.min(1.0 - fraction);
        if from_end < rounding {
            from_end / rounding / (1.0 - rounding)
        } else {
            1.0 / (1.0 - rounding)
        }
    }

    /// Part of a gait cycle since a cell's own step began, 0 to 1.
    pub(super) fn own_phase(&self, cell: usize, cam: &Cam) -> f64 {
        let cells = self.worm.cells() as f64;
        (cam.steps - self.place_of[cell] as f64).rem_euclid(cells) / cells
    }

    /// Friction of a tip at a place after some cycles, in either direction, relative to its initial friction.
    pub(super) fn friction(&self, tip_m: f64, cycles: f64) -> f64 {
        let laws = &self.laws;
        let mut friction = 1.0;
        if laws.wear_per_cycle != 0.0 {
            friction *= (1.0 - laws.wear_per_cycle).powf(cycles.abs());
        }
        if laws.patch.friction_factor != 1.0 {
            let patch = &laws.patch;
            let inside_m = (tip_m - patch.from_m).min(patch.from_m + patch.length_m - tip_m);
            let fraction = (0.5 + inside_m / PATCH_EDGE_M).clamp(0.0, 1.0);
            friction *= 1.0 + fraction * (patch.friction_factor - 1.0);
        }
        friction
    }

    /// Whether friction does not depend on place and time, tables apart.
    pub(super) fn has_even_friction(&self) -> bool {
        self.laws.wear_per_cycle == 0.0 && self.laws.patch.friction_factor == 1.0
    }
}
