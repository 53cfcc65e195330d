//! The model that runs beside the worm. Nothing else of the map uses [`Motion`].

use super::{BINS, PIECES, SIDE};
use crate::estimate::window::{CYCLES, INTERVALS};
use worm_physics::MAX_CELLS;
use worm_physics::{Motion, SlidesDown, Worm, WormError};

/// Deviations of all cells together that are allowed for, each up to a fraction.
pub(super) const ALLOWANCES: [Allowance; 2] = [
    Allowance {
        max: 0.02,
        shows_in: Part::Extension,
        deviate: |worm, fraction| {
            let stroke_m = worm.stroke_m() * (1.0 + fraction);
            worm.with_stroke_m(stroke_m)
        },
    },
    Allowance {
        max: 0.025,
        shows_in: Part::Body,
        deviate: |mut worm, fraction| {
            for cell in 0..worm.cells() {
                let mut contact = worm.contact(cell);
                contact.stiffness_n_per_m *= 1.0 + fraction;
                worm = worm.with_contact(cell, contact)?;
            }
            Ok(worm)
        },
    },
];

/// Cycles from rest after which a motion counts as steady.
const SETTLING_CYCLES: usize = 4;

/// A part of the motion.
#[derive(Debug, Clone, Copy)]
pub(super) enum Part {
    /// The translation of the cells that do not step.
    Body,
    /// The stepping cell against the others.
    Extension,
}

/// A deviation of the whole worm.
pub(super) struct Allowance {
    /// How large it may be, as a fraction.
    pub(super) max: f64,
    /// The part of the motion from which it is estimated.
    pub(super) shows_in: Part,
    deviate: fn(Worm, f64) -> Result<Worm, WormError>,
}

/// By how much a bound is changed to see what its error does, as a fraction.
const BOUND_FRACTION: f64 = 0.02;

/// The model's worm, its motion since the last start, and its path over the two cycles of the window.
///
/// Like the window it looks along the crawl: a backward crawl is that of the mirrored worm, which runs forward.
#[derive(Debug, Clone)]
pub(super) struct ReferenceModel {
    forward: Worm,
    backward: Worm,
    is_backward: bool,
    motion: Motion,
    cycles: u32,      // since the last start
    path_m: Vec<f64>, // [knot][cell] over the cycle before and the last
}

impl ReferenceModel {
    pub(super) fn new(worm: &Worm) -> Self {
        let cells = worm.cells();
        Self {
            forward: worm.clone(),
            backward: worm.clone().mirrored(),
            is_backward: false,
            motion: at_rest(worm),
            cycles: 0,
            path_m: vec![0.0; (CYCLES * cells * INTERVALS + 1) * cells],
        }
    }

    pub(super) fn set_worm(&mut self, worm: &Worm) {
        self.backward = worm.clone().mirrored();
        self.forward = worm.clone();
    }

    /// Starts again from rest, in a direction.
    pub(super) fn begin(&mut self, direction: i32) {
        self.is_backward = direction < 0;
        self.motion = at_rest(self.worm());
        self.cycles = 0;
    }

    /// Runs one more cycle.
    ///
    /// # Errors
    /// [`SlidesDown`] for a worm that the model cannot hold in this canal.
    pub(super) fn run_cycle(&mut self) -> Result<(), SlidesDown> {
        let worm = if self.is_backward {
            &self.backward
        } else {
            &self.forward
        };
        let (cells, pieces) = (worm.cells(), worm.cells() * INTERVALS);
        self.path_m.copy_within(pieces * cells.., 0);
        let begun = f64::from(self.cycles);
        for knot in 0..=pieces {
            self.motion.advance_to(worm, begun + knot as f64 / pieces as f64)?;
            self.path_m[(pieces + knot) * cells..][..cells].copy_from_slice(self.motion.positions_m());
        }
        self.cycles = self.cycles.saturating_add(1);
        Ok(())
    }

    /// Cycles since the last start.
    pub(super) fn cycles(&self) -> u32 {
        self.cycles
    }

    /// Position at a knot, counted from the beginning of the cycle before the last, m.
    pub(super) fn position_m(&self, knot: usize, cell: usize) -> f64 {
        self.path_m[knot * self.worm().cells() + cell]
    }

    /// The cell that steps in a step of the cycle, in the present direction.
    pub(super) fn stepping_cell(&self, step: usize) -> usize {
        self.worm().step_order()[step]
    }

    /// What an allowed deviation of 100 % would add to each entry of the map, m; zeros where such a worm cannot hold.
    pub(super) fn effect_of(&self, allowance: &Allowance, effect_m: &mut [f64]) {
        let deviating = (allowance.deviate)(self.worm().clone(), allowance.max);
        self.effect(deviating, allowance.max, effect_m);
    }

    /// What each metre of a cell's bound would add to each entry of the map, m/m; zeros where such a worm cannot hold.
    pub(super) fn effect_of_bound(&self, cell: usize, effect_m: &mut [f64]) {
        let mut contact = self.worm().contact(cell);
        let added_m = BOUND_FRACTION * contact.forward_bound_m;
        contact.forward_bound_m += added_m;
        contact.backward_bound_m += added_m;
        self.effect(self.worm().clone().with_contact(cell, contact), added_m, effect_m);
    }

    /// What a deviation adds to each entry of the map, for each unit of its `size`.
    fn effect(&self, deviating: Result<Worm, WormError>, size: f64, effect_m: &mut [f64]) {
        effect_m.fill(0.0);
        let cells = self.worm().cells();
        let Ok(deviating) = deviating else {
            return;
        };
        let (mut is, mut would_be) = (at_rest(self.worm()), at_rest(&deviating));
        let mut difference_in = |piece: usize| -> Result<[f64; MAX_CELLS], SlidesDown> {
            let phase = SETTLING_CYCLES as f64 + (piece as f64 + 0.5) / (cells * INTERVALS) as f64;
            is.advance_to(self.worm(), phase)?;
            would_be.advance_to(&deviating, phase)?;
            let mut difference_m = [0.0; MAX_CELLS];
            for (cell, to) in difference_m[..cells].iter_mut().enumerate() {
                *to = (would_be.positions_m()[cell] - is.positions_m()[cell]) / size;
            }
            Ok(difference_m)
        };
        // An edge is the mean over half a bin on each side, as it is for the samples.
        let mut before_m = None;
        for edge in 1..=cells * BINS + 1 {
            let mut edge_m = [0.0; MAX_CELLS];
            for piece in edge * PIECES - SIDE..edge * PIECES + SIDE {
                let Ok(at_m) = difference_in(piece) else {
                    effect_m.fill(0.0);
                    return;
                };
                for (sum_m, at_m) in edge_m.iter_mut().zip(at_m) {
                    *sum_m += at_m / (2 * SIDE) as f64;
                }
            }
            if let Some(before_m) = before_m.replace(edge_m) {
                let bin = (edge - 1) % (cells * BINS);
                for cell in 0..cells {
                    effect_m[bin * cells + cell] = edge_m[cell] - before_m[cell];
                }
            }
        }
    }

    fn worm(&self) -> &Worm {
        if self.is_backward {
            &self.backward
        } else {
            &self.forward
        }
    }
}

fn at_rest(worm: &Worm) -> Motion {
    Motion::at_rest(worm, &[0.0; MAX_CELLS][..worm.cells()])
}
