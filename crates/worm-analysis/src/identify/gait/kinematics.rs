//! Places and stroke of the cells, by those that stand still in the body.

use super::Finder;
use nalgebra::{DMatrix, DVector};

/// Steps before and after its own in which a cell is not yet taken to stand still in the body: cams have rounded corners.
const CORNER: f64 = 0.04;

impl Finder<'_> {
    /// Whether a cell stands still in the body at a phase, well away from its own step, so that its place there is known
    /// whatever the shape of the cam. With two cells none ever does, and both are used.
    pub(super) fn rests(&self, cell: usize, phase: f64) -> bool {
        let cells = self.cells() as f64;
        let steps = (phase * cells - self.place_of[cell] as f64).rem_euclid(cells);
        self.cells() == 2 || (1.0 + CORNER..cells - CORNER).contains(&steps)
    }

    /// Cells that are seen at rest in a sample: which, where, and how many steps they have made.
    pub(super) fn resting(&self, sample: usize, rows: &mut Vec<(usize, f64, f64)>) {
        rows.clear();
        let phase = self.phase[sample];
        for cell in 0..self.cells() {
            let at_m = self.seen_m[cell][sample];
            if at_m.is_finite() && self.rests(cell, phase) {
                rows.push((cell, at_m, self.steps_made(cell, phase)));
            }
        }
    }

    /// Least squares for places and stroke with the phase as it is, on the cells at rest in the body; the displacement of the
    /// body is eliminated sample by sample.
    pub(super) fn fit_kinematics(&mut self) {
        let cells = self.cells();
        let mut normal = DMatrix::<f64>::zeros(cells + 1, cells + 1);
        let mut right = DVector::<f64>::zeros(cells + 1);
        let mut rows = Vec::with_capacity(cells);
        for sample in 0..self.phase.len() {
            self.resting(sample, &mut rows);
            let count = rows.len() as f64;
            let mean_m = rows.iter().map(|row| row.1).sum::<f64>() / count;
            let mean_steps = rows.iter().map(|row| row.2).sum::<f64>() / count;
            // Rows of the projected design: unit vector of the cell less the mean over those seen.
            for &(cell, at_m, made) in &rows {
                let (at_m, made) = (at_m - mean_m, made - mean_steps);
                for &(other, ..) in &rows {
                    normal[(cell, other)] += if cell == other { 1.0 } else { 0.0 } - 1.0 / count;
                }
                normal[(cell, cells)] += made;
                normal[(cells, cell)] += made;
                normal[(cells, cells)] += made * made;
                right[cell] += at_m;
                right[cells] += made * at_m;
            }
        }
        for row in 0..cells {
            for column in 0..cells {
                normal[(row, column)] += 1.0; // the places sum to 0
            }
        }
        if let Some(solution) = normal.cholesky().map(|factor| factor.solve(&right)) {
            self.place_m.copy_from_slice(&solution.as_slice()[..cells]);
            self.stroke_m = solution[cells];
        }
        self.measure_noise();
    }

    /// The noise of one position by the residual of the cells at rest; with two cells it cannot be separated from the phase.
    pub(super) fn measure_noise(&mut self) {
        if self.cells() > 2 {
            self.noise_m = self.residual_m();
        }
    }

    /// Standard deviation of the residual of the cells at rest, given places, stroke and phase, m.
    pub(super) fn residual_m(&self) -> f64 {
        let (mut squares, mut equations) = (0.0, 0.0);
        let mut rows = Vec::with_capacity(self.cells());
        for sample in 0..self.phase.len() {
            self.resting(sample, &mut rows);
            let own_m = rows
                .iter()
                .map(|&(cell, at_m, made)| at_m - self.place_m[cell] - self.stroke_m * made);
            let (sum_m, sum_squares) = own_m.fold((0.0, 0.0), |(sum, squares), own| (sum + own, squares + own * own));
            if !rows.is_empty() {
                squares += sum_squares - sum_m * sum_m / rows.len() as f64;
                equations += rows.len() as f64 - 1.0;
            }
        }
        if equations > 0.0 {
            (squares / equations).max(0.0).sqrt()
        } else {
            self.noise_m
        }
    }
}
