//! A recorded worm, as the statistics of the search see it.

use super::noise::RunNoise;
use super::observed::Observed;
use super::predict::Scene;
use super::predicted::Predicted;
use super::residual::Residual;
use super::torque_discrepancy;
use super::torque_noise::TorqueNoise;
use crate::explain::search::bins::Bins;
use crate::explain::search::discrepancy::repeating_columns;
use crate::explain::search::fit::Fit;
use crate::explain::search::plant::Recorded;
use crate::explain::search::problem::FitProblem;
use nalgebra::DMatrix;
use std::ops::Range;
use worm_estimator::self_sensing::GearModel;

/// Part of the stroke that changes of a smaller advance are relative to: of a worm that hardly advances, no change is small.
const OF_STROKE: f64 = 0.25;

/// The runs of a worm, with their noise once that is measured.
pub(in crate::explain) struct RecordedWorm<'a> {
    pub scene: Scene<'a>,
    /// Of each run; empty before the noise is measured.
    pub bins: Vec<Bins>,
    pub noise: Vec<RunNoise>,
    pub torque_noise: Vec<TorqueNoise>,
    /// How far a cycle's advance in each run goes with the friction of the tips, m ([`super::irregularity`]).
    pub advance_by_friction_m: Vec<f64>,
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
            torque_noise: Vec::new(),
            advance_by_friction_m: Vec::new(),
        }
    }

    /// The gait phase was recorded in some run.
    pub fn phase_recorded(&self) -> bool {
        self.scene.observed.iter().any(|observed| observed.phase_recorded)
    }

    /// What a fit predicts for each run; none of a run whose positions nobody saw, or that the worm could not have made.
    pub fn predictions(&self, fit: &Fit) -> Vec<Option<Predicted>> {
        let runs = self.scene.observed.iter().enumerate();
        runs.map(|(run, observed)| {
            let seen = observed.sees_positions.then_some(run)?;
            self.scene.predict(seen, &fit.hypothesis, &fit.at)
        })
        .collect()
    }

    /// The least advance of a run that changes of it are relative to, m.
    pub fn least_advance_m(&self, run: usize) -> f64 {
        OF_STROKE * self.scene.nominal[run].worm.stroke_m()
    }

    /// The motor's current counts as evidence in some run.
    pub fn counts_current(&self) -> bool {
        self.gear().is_some()
    }

    /// Whether positions count in some run; else the current alone is evidence.
    pub fn sees_positions(&self) -> bool {
        self.scene.observed.iter().any(|observed| observed.sees_positions)
    }

    /// What was assumed of the gears, where the current counts.
    pub fn gear(&self) -> Option<&GearModel> {
        let mut torques = self
            .scene
            .observed
            .iter()
            .filter_map(|observed| observed.torque.as_ref());
        torques.next().map(|torque| &torque.gear)
    }

    /// Number of rows of a run.
    pub fn rows(&self, run: usize) -> usize {
        self.bins[run].len() * (1 + self.channels()) + self.torque_noise[run].rows()
    }

    /// A residual of the positions, and of the torque in every bin, N m, whitened by the noise.
    pub fn whitened(&self, run: usize, residual: &Residual, torque_n_m: &[f64]) -> Vec<f64> {
        let mut rows = Vec::with_capacity(self.rows(run));
        self.noise[run].whiten(residual, &mut rows);
        self.torque_noise[run].whiten(torque_n_m, &mut rows);
        rows
    }

    /// The rows of a torque that the current shows in every bin of a run, N m, and no position.
    fn rows_of_torque(&self, run: usize, torque_n_m: &[f64]) -> Vec<f64> {
        let mut rows = vec![0.0; self.rows(run) - self.torque_noise[run].rows()];
        self.torque_noise[run].whiten(torque_n_m, &mut rows);
        rows
    }
}

/// Rows of a run: the body's in every bin, then every cell's relative to it in every bin; where the current counts, the torque's in every bin.
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
        let of_torque = 0..self.torque_noise[run].rows();
        bins.chain(of_cells).chain(of_torque).collect()
    }

    /// Those of the positions, and those of the torque where it counts.
    fn discrepancy_columns(&self, scale_m: f64) -> DMatrix<f64> {
        let (cells, bins, conditions) = (self.channels(), self.all_bins(), self.conditions());
        let rows_of = |run: usize, pattern_m: &[f64]| self.rows_of(run, pattern_m);
        let of_positions = || repeating_columns(cells, &bins, &conditions, scale_m, rows_of);
        let Some(gear) = self.gear() else {
            return of_positions();
        };
        let scale_n_m = torque_discrepancy::scale_n_m(&self.scene.nominal);
        let rows_of = |run: usize, torque_n_m: &[f64]| self.rows_of_torque(run, torque_n_m);
        let of_torque = torque_discrepancy::columns((scale_n_m, gear), cells, &bins, &conditions, rows_of);
        if !self.sees_positions() {
            return of_torque;
        }
        let of_positions = of_positions();
        let count = of_positions.ncols();
        let mut all = of_positions.resize_horizontally(count + of_torque.ncols(), 0.0);
        all.columns_mut(count, of_torque.ncols()).copy_from(&of_torque);
        all
    }

    /// Where nobody sees the cells, the torque takes it that the stepping cell's pad is deformed by its displacement.
    fn rows_of(&self, run: usize, pattern_m: &[f64]) -> Vec<f64> {
        if !self.sees_positions() {
            let n_m_per_m = torque_discrepancy::of_deformation_n_m_per_m(&self.scene.nominal[run]);
            let bins = self.bins[run].bins.iter().zip(pattern_m.chunks_exact(self.channels()));
            let torque_n_m: Vec<f64> = bins.map(|(bin, at_m)| n_m_per_m * at_m[bin.leading]).collect();
            return self.rows_of_torque(run, &torque_n_m);
        }
        let residual = Residual::of_pattern(&self.scene.observed[run], &self.bins[run], pattern_m);
        let mut rows = self.whitened(run, &residual, &[]);
        rows.resize(self.rows(run), 0.0);
        rows
    }

    /// The cells' positions relative to the body are about their means again.
    fn within(&self, run: usize, rows: &[f64], bins: Range<usize>) -> Vec<f64> {
        let (count, cells) = (self.bins[run].len(), self.channels());
        let mut within = vec![0.0; rows.len()];
        within[bins.clone()].copy_from_slice(&rows[bins.clone()]);
        let of_cells = count + bins.start * cells..count + bins.end * cells;
        within[of_cells.clone()].copy_from_slice(&rows[of_cells]);
        let of_torque = count * (1 + cells);
        if rows.len() > of_torque {
            let bins = of_torque + bins.start..of_torque + bins.end;
            within[bins.clone()].copy_from_slice(&rows[bins]);
        }
        for cell in 0..cells {
            let of_cells = &mut within[count..of_torque];
            let mut of_cell: Vec<&mut f64> = of_cells.iter_mut().skip(cell).step_by(cells).collect();
            let mean = of_cell.iter().map(|row| **row).sum::<f64>() / count as f64;
            of_cell.iter_mut().for_each(|row| **row -= mean);
        }
        within
    }
}
