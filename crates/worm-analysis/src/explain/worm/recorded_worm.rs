//! A recorded worm, as the statistics of the search see it.

use super::noise::RunNoise;
use super::observed::Observed;
use super::predict::Scene;
use super::residual::Residual;
use crate::explain::search::bins::Bins;
use crate::explain::search::plant::Recorded;
use crate::explain::search::problem::FitProblem;
use std::ops::Range;

/// Part of the stroke that changes of a smaller advance are relative to: of a worm that hardly advances, no change is small.
const OF_STROKE: f64 = 0.25;

/// The runs of a worm, with their noise once that is measured.
pub(in crate::explain) struct RecordedWorm<'a> {
    pub scene: Scene<'a>,
    /// Of each run; empty before the noise is measured.
    pub bins: Vec<Bins>,
    pub noise: Vec<RunNoise>,
}

/// A recorded worm, as a problem of least squares.
pub(in crate::explain) type WormProblem<'p, 'a> = FitProblem<'p, RecordedWorm<'a>>;

impl<'a> RecordedWorm<'a> {
    /// Before its noise is measured.
    pub fn new(scene: Scene<'a>) -> Self {
        Self {
            scene,
            bins: Vec::new(),
            noise: Vec::new(),
        }
    }

    /// The gait phase was recorded in some run.
    pub fn phase_recorded(&self) -> bool {
        self.scene.observed.iter().any(|observed| observed.phase_recorded)
    }

    /// The least advance of a run that changes of it are relative to, m.
    pub fn least_advance_m(&self, run: usize) -> f64 {
        OF_STROKE * self.scene.nominal[run].worm.stroke_m()
    }

    /// A residual, whitened by the noise.
    pub fn whitened(&self, run: usize, residual: &Residual) -> Vec<f64> {
        let mut rows = Vec::with_capacity(self.bins[run].len() * (1 + self.channels()));
        self.noise[run].whiten(residual, &mut rows);
        rows
    }
}

/// Rows of a run: the body's in every bin, then every cell's relative to it in every bin.
impl Recorded for RecordedWorm<'_> {
    fn runs(&self) -> usize {
        self.scene.observed.len()
    }

    fn channels(&self) -> usize {
        self.scene.observed.first().map_or(0, Observed::cells)
    }

    fn condition(&self, run: usize) -> f64 {
        self.scene.observed[run].run.slope_deg.to_radians().sin()
    }

    fn bins(&self, run: usize) -> &Bins {
        &self.bins[run]
    }

    fn bin_of_rows(&self, run: usize) -> Vec<usize> {
        let (bins, cells) = (0..self.bins[run].len(), self.channels());
        let of_cells = bins.clone().flat_map(|bin| std::iter::repeat_n(bin, cells));
        bins.chain(of_cells).collect()
    }

    fn rows_of(&self, run: usize, pattern_m: &[f64]) -> Vec<f64> {
        let residual = Residual::of_pattern(&self.scene.observed[run], &self.bins[run], pattern_m);
        self.whitened(run, &residual)
    }

    /// The cells' positions relative to the body are about their means again.
    fn within(&self, run: usize, rows: &[f64], bins: Range<usize>) -> Vec<f64> {
        let (count, cells) = (self.bins[run].len(), self.channels());
        let mut within = vec![0.0; rows.len()];
        within[bins.clone()].copy_from_slice(&rows[bins.clone()]);
        let of_cells = count + bins.start * cells..count + bins.end * cells;
        within[of_cells.clone()].copy_from_slice(&rows[of_cells]);
        for cell in 0..cells {
            let mut of_cell: Vec<&mut f64> = within[count..].iter_mut().skip(cell).step_by(cells).collect();
            let mean = of_cell.iter().map(|row| **row).sum::<f64>() / count as f64;
            of_cell.iter_mut().for_each(|row| **row -= mean);
        }
        within
    }
}
