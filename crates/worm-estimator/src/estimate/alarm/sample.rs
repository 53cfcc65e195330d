//! One tracker sample for the position detectors: filtered positions of the cells that the tracker sees.

use crate::message::{Estimate, State};
use worm_physics::MAX_CELLS;

/// A filtered position is trusted while its cell was seen in one of this many newest samples.
pub(super) const TRUSTED_SAMPLES: u32 = 6;

/// Which cells the tracker sees, so that a position that the filter only predicts does not count as a measurement.
#[derive(Debug, Clone)]
pub(super) struct VisibleCells {
    unseen: [u32; MAX_CELLS], // samples since the cell was seen
}

/// Positions of the cells that are trusted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Positions {
    pub metres: [f64; MAX_CELLS],
    /// Bit i is set when `metres[i]` is finite and trusted.
    pub mask: u32,
}

impl VisibleCells {
    pub(super) const fn new() -> Self {
        Self {
            unseen: [TRUSTED_SAMPLES; MAX_CELLS],
        }
    }

    pub(super) fn follow(&mut self, state: &State, cells: usize) {
        if state.sample_is_new == 0 {
            return;
        }
        for (cell, unseen) in self.unseen.iter_mut().enumerate().take(cells) {
            *unseen = match state.position_of(cell) {
                Some(_) => 0,
                None => unseen.saturating_add(1),
            };
        }
    }

    pub(super) fn positions(&self, estimate: &Estimate, cells: usize) -> Positions {
        let mut positions = Positions {
            metres: estimate.position_m,
            mask: 0,
        };
        for cell in 0..cells {
            // Beyond 1000 km a difference of two positions is no longer a distance.
            if self.unseen[cell] < TRUSTED_SAMPLES && positions.metres[cell].abs() < 1e6 {
                positions.mask |= 1 << cell;
            }
        }
        positions
    }
}

impl Positions {
    pub(super) const NONE: Self = Self {
        metres: [f64::NAN; MAX_CELLS],
        mask: 0,
    };

    pub(super) const fn has(&self, cell: usize) -> bool {
        self.mask >> cell & 1 == 1
    }

    /// Mean displacement since `earlier` over the cells that are in both, m.
    pub(super) fn moved_since(&self, earlier: &Self) -> Option<f64> {
        self.moved_without(earlier, 0)
    }

    /// The same without the cells of `left_out`.
    pub(super) fn moved_without(&self, earlier: &Self, left_out: u32) -> Option<f64> {
        let both = self.mask & earlier.mask & !left_out;
        let sum: f64 = cells_of(both)
            .map(|cell| self.metres[cell] - earlier.metres[cell])
            .sum();
        (both != 0).then(|| sum / f64::from(both.count_ones()))
    }

    /// Median displacement over the cells that are in both, m: one bad marker does not move it.
    pub(super) fn median_moved_since(&self, earlier: &Self) -> Option<f64> {
        let mut moved = [0.0; MAX_CELLS];
        let mut count = 0;
        for cell in cells_of(self.mask & earlier.mask) {
            moved[count] = self.metres[cell] - earlier.metres[cell];
            count += 1;
        }
        let moved = &mut moved[..count];
        moved.sort_unstable_by(f64::total_cmp);
        match count {
            0 => None,
            _ => Some(0.5 * (moved[(count - 1) / 2] + moved[count / 2])),
        }
    }
}

fn cells_of(mask: u32) -> impl Iterator<Item = usize> {
    (0..MAX_CELLS).filter(move |cell| mask >> cell & 1 == 1)
}
