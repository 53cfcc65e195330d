//! Why a description is refused, and why a worm cannot hold.

use crate::MAX_CELLS;
use thiserror::Error;

/// Why a description cannot be a worm.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum WormError {
    /// Too few cells to step against one another, or more than the fixed tables hold.
    #[error("{0} cells: give 2 to {MAX_CELLS}")]
    CellCount(usize),
    /// A quantity outside its range.
    #[error("{quantity} = {value}: give a finite number, {range}")]
    OutOfRange {
        /// The quantity with its unit.
        quantity: &'static str,
        /// What it was.
        value: f64,
        /// What it may be.
        range: &'static str,
    },
    /// A list whose length is not the number of cells.
    #[error("{quantity} lists {given} values for {cells} cells: give one for each cell")]
    ListLength {
        /// The quantity with its unit.
        quantity: &'static str,
        /// How many values came.
        given: usize,
        /// How many cells there are.
        cells: usize,
    },
    /// A cell index beyond the last cell.
    #[error("cell {cell}, counted from 0, of {cells} cells: give at most {}", cells - 1)]
    NoSuchCell {
        /// The index given.
        cell: usize,
        /// How many cells there are.
        cells: usize,
    },
    /// A step order that leaves out or repeats a cell.
    #[error("step order {0:?}: name each cell, counted from 0, exactly once")]
    StepOrder(Vec<usize>),
}

/// An error unless `holds` and `value` is finite.
pub(super) fn require(holds: bool, quantity: &'static str, value: f64, range: &'static str) -> Result<(), WormError> {
    if holds && value.is_finite() {
        Ok(())
    } else {
        Err(WormError::OutOfRange { quantity, value, range })
    }
}

/// The pull along the canal exceeds what all tips together can hold: no quasi-static motion exists.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error("the worm slides down: it is pulled by {:.3} N and its tips hold at most {hold_n:.3} N", pull_n.abs())]
pub struct SlidesDown {
    /// Pull on the body, N; positive towards smaller positions (uphill canal), negative the other way.
    pub pull_n: f64,
    /// What the tips hold at most against it, N.
    pub hold_n: f64,
}
