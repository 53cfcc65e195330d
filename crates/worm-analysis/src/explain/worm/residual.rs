//! What a prediction leaves of the data.
//!
//! The position of cell i is cᵢ + b + (what its drive does): its place in the body, the displacement of the body, and its steps. The
//! residual of the positions has a part common to all cells, the body's, and each cell's part relative to that; the places cᵢ are
//! removed as means. The body's part wanders like a random walk whatever the model, for no worm repeats its cycles exactly; the drift
//! that the data show from cycle to cycle whitens it (see [`super::noise`]). Where the phase had to be found from the positions, it
//! was found from the motion of the stepping cell relative to the others, so that component carries no information and is removed.

use super::observed::Observed;
use super::predicted::Predicted;
use crate::explain::search::bins::Bins;

/// The residual of one run, sample by sample or bin by bin.
#[derive(Debug, Clone, Default)]
pub(in crate::explain) struct Residual {
    /// The body's part in each row, m; `NaN` where no cell was seen.
    pub body_m: Vec<f64>,
    /// Each cell's part relative to it, m: `[row][cell]`, flat; `NaN` where not seen.
    pub relative_m: Vec<f64>,
}

impl Residual {
    /// What a prediction leaves of a run at each sample.
    pub fn new(observed: &Observed<'_>, predicted: &Predicted) -> Self {
        let cells = observed.cells();
        let own_m: Vec<f64> = (0..observed.samples())
            .flat_map(|sample| (0..cells).map(move |cell| (sample, cell)))
            .map(|(sample, cell)| observed.position_m[cell][sample] - predicted.position_m[sample * cells + cell])
            .collect();
        let stepping = |sample: usize| (!observed.phase_recorded).then(|| observed.stepping(sample));
        Self::split(&own_m, cells, observed.counts_from, stepping)
    }

    /// What a prediction leaves of a run in each bin.
    pub fn binned(observed: &Observed<'_>, bins: &Bins, predicted: &Predicted) -> Self {
        let cells = observed.cells();
        let mut own_m = Vec::with_capacity(bins.len() * cells);
        for bin in &bins.bins {
            for cell in 0..cells {
                let (mut sum_m, mut seen) = (0.0, 0.0);
                for sample in bin.samples.clone() {
                    let at_m = observed.position_m[cell][sample] - predicted.position_m[sample * cells + cell];
                    if at_m.is_finite() {
                        sum_m += at_m;
                        seen += 1.0;
                    }
                }
                own_m.push(sum_m / seen); // NaN where not seen
            }
        }
        Self::of_pattern(observed, bins, &own_m)
    }

    /// The parts of displacements of every cell in every bin, m: `[bin][cell]`, flat; `NaN` where not seen.
    pub fn of_pattern(observed: &Observed<'_>, bins: &Bins, own_m: &[f64]) -> Self {
        let stepping = |bin: usize| (!observed.phase_recorded).then(|| bins.bins[bin].leading);
        Self::split(own_m, observed.cells(), 0, stepping)
    }

    /// Splits each cell's residual into the body's part and its own. `left_out` is the cell that shows nothing in a row; rows before
    /// `counts_from` do not count for the places of the cells.
    fn split(own_m: &[f64], cells: usize, counts_from: usize, left_out: impl Fn(usize) -> Option<usize>) -> Self {
        let rows = own_m.len() / cells;
        // The places of the cells in the body, by the rows in which all of them were seen.
        let mut place_m = vec![0.0; cells];
        let mut complete = 0.0;
        for row_m in own_m.chunks_exact(cells).skip(counts_from) {
            let sum_m: f64 = row_m.iter().sum();
            if sum_m.is_finite() {
                complete += 1.0;
                for (place_m, own_m) in place_m.iter_mut().zip(row_m) {
                    *place_m += own_m - sum_m / cells as f64;
                }
            }
        }
        place_m
            .iter_mut()
            .for_each(|place_m| *place_m /= f64::max(complete, 1.0));
        let mut residual = Self {
            body_m: Vec::with_capacity(rows),
            relative_m: Vec::with_capacity(rows * cells),
        };
        for (row, row_m) in own_m.chunks_exact(cells).enumerate() {
            let left_out = left_out(row);
            let (mut sum_m, mut seen) = (0.0, 0.0);
            for (cell, (own_m, place_m)) in row_m.iter().zip(&place_m).enumerate() {
                let own_m = own_m - place_m;
                if own_m.is_finite() && Some(cell) != left_out {
                    sum_m += own_m;
                    seen += 1.0;
                }
            }
            let body_m = sum_m / seen; // NaN where none was seen
            residual.body_m.push(body_m);
            for (cell, (own_m, place_m)) in row_m.iter().zip(&place_m).enumerate() {
                let relative_m = own_m - place_m - body_m;
                residual
                    .relative_m
                    .push(if Some(cell) == left_out { f64::NAN } else { relative_m });
            }
        }
        residual
    }
}
