//! Which cell steps when.

use crate::config::Worm;
use worm_physics::MAX_CELLS;

/// The order of the cells, for steps counted from phase 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct StepSequence {
    cells: usize,
    order: [usize; MAX_CELLS],
}

impl StepSequence {
    pub(super) fn new(worm: &Worm) -> Self {
        let mut order = [0; MAX_CELLS];
        order[..worm.cells].copy_from_slice(&worm.step_order_from_zero());
        Self {
            cells: worm.cells,
            order,
        }
    }

    /// The gait seen along the crawl: a backward one (−1) is seen from the other end of the canal, so that it runs forward, too.
    pub(super) fn seen_along(mut self, direction: i32) -> Self {
        if direction < 0 {
            self.order[..self.cells].reverse();
        }
        self
    }

    pub(super) fn cells(&self) -> usize {
        self.cells
    }

    /// The cell that steps in a step; steps may be negative.
    pub(super) fn cell_of_step(&self, step: i64) -> usize {
        self.order[step.rem_euclid(self.cells as i64) as usize]
    }

    /// The step of a cycle in which a cell steps.
    pub(super) fn step_of_cell(&self, cell: usize) -> usize {
        (0..self.cells)
            .find(|&step| self.order[step] == cell)
            .unwrap_or(self.cells)
    }
}
