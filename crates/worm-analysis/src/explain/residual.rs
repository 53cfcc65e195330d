//! What a prediction leaves of the data.
//!
//! The position of cell i is cᵢ + b + (what its drive does): its place in the body, the displacement of the body, and its steps. The
//! residual of the positions has a part common to all cells, the body's, and each cell's part relative to that; the places cᵢ are
//! removed as means. The body's part wanders like a random walk whatever the model, for no worm repeats its cycles exactly; the drift
//! that the data show from cycle to cycle whitens it (see [`super::noise`]). Where the phase had to be found from the positions, it
//! was found from the motion of the stepping cell relative to the others, so that component carries no information and is removed.

use super::observed::Observed;
use super::predict::Predicted;

/// The residual of one run.
#[derive(Debug, Clone, Default)]
pub(super) struct Residual {
    /// The body's part at each sample, m; `NaN` where no cell was seen.
    pub body_m: Vec<f64>,
    /// Each cell's part relative to it, m: `[sample][cell]`, flat; `NaN` where not seen.
    pub relative_m: Vec<f64>,
}

impl Residual {
    /// What a prediction leaves of a run.
    pub fn new(observed: &Observed<'_>, predicted: &Predicted) -> Self {
        let cells = observed.cells();
        let samples = observed.samples();
        let own_m = |sample: usize, cell: usize| {
            observed.position_m[cell][sample] - predicted.position_m[sample * cells + cell]
        };
        // The places of the cells in the body, by the samples in which all of them were seen.
        let mut place_m = vec![0.0; cells];
        let mut complete = 0.0;
        for sample in observed.counts_from..samples {
            let sum_m: f64 = (0..cells).map(|cell| own_m(sample, cell)).sum();
            if sum_m.is_finite() {
                complete += 1.0;
                for (cell, place_m) in place_m.iter_mut().enumerate() {
                    *place_m += own_m(sample, cell) - sum_m / cells as f64;
                }
            }
        }
        place_m
            .iter_mut()
            .for_each(|place_m| *place_m /= f64::max(complete, 1.0));
        let mut residual = Self {
            body_m: Vec::with_capacity(samples),
            relative_m: Vec::with_capacity(samples * cells),
        };
        for sample in 0..samples {
            let stepping = observed.stepping(sample);
            let (mut sum_m, mut seen) = (0.0, 0.0);
            for (cell, place_m) in place_m.iter().enumerate() {
                let own_m = own_m(sample, cell) - place_m;
                if own_m.is_finite() && (observed.phase_recorded || cell != stepping) {
                    sum_m += own_m;
                    seen += 1.0;
                }
            }
            let body_m = sum_m / seen; // NaN where none was seen
            residual.body_m.push(body_m);
            for (cell, place_m) in place_m.iter().enumerate() {
                let relative_m = own_m(sample, cell) - place_m - body_m;
                let is_independent = observed.phase_recorded || cell != stepping;
                residual
                    .relative_m
                    .push(if is_independent { relative_m } else { f64::NAN });
            }
        }
        residual
    }
}
