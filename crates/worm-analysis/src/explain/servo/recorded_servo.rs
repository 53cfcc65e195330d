//! A recorded servo, as the statistics of the search see it.

use super::discrepancy;
use super::observed::Observed;
use super::supply::SupplyReading;
use crate::explain::search::bins::Bins;
use crate::explain::search::fit::Fit;
use crate::explain::search::folds::{Fold, Folds};
use crate::explain::search::plant::Recorded;
use crate::explain::search::problem::FitProblem;
use nalgebra::DMatrix;
use std::ops::Range;
use worm_physics::servo::{COUNT_RAD, ServoPhysics};

/// The runs of a servo, with their noise once that is measured.
pub(in crate::explain) struct RecordedServo<'a> {
    pub(super) observed: Vec<Observed<'a>>,
    pub(super) nominal: ServoPhysics,
    /// Standard deviation of the mean residual of a bin that is taken for noise, rad; and what of it is in the data: how far a bin's residual
    /// is from the mean of its neighbours.
    pub(super) noise_rad: f64,
    pub(super) scatter_rad: f64,
    /// What the voltages say of the supply.
    pub(super) supply: Option<SupplyReading>,
}

/// A recorded servo, as a problem of least squares.
pub(super) type ServoProblem<'p, 'a> = FitProblem<'p, RecordedServo<'a>>;

impl<'a> RecordedServo<'a> {
    /// Before its noise is measured.
    pub(super) fn new(observed: Vec<Observed<'a>>, nominal: ServoPhysics) -> Self {
        Self {
            observed,
            nominal,
            noise_rad: COUNT_RAD,
            scatter_rad: COUNT_RAD,
            supply: None,
        }
    }

    /// The physics of a fit.
    pub(super) fn physics(&self, fit: &Fit) -> ServoPhysics {
        super::predict::physics(&self.nominal, &fit.hypothesis, &fit.at)
    }

    /// Root mean square of the positions, rad: what the discrepancy's scale is a fraction of.
    pub(super) fn rms_position_rad(&self) -> f64 {
        let all = self
            .observed
            .iter()
            .flat_map(|observed| &observed.recording.position_rad);
        let (sum, count) = all.fold((0.0, 0.0), |(sum, count), rad| (sum + rad * rad, count + 1.0));
        (sum / count).sqrt()
    }

    /// Mean residual of every bin of a run, rad, for the residuals of every reading.
    pub(super) fn binned(&self, run: usize, residual_rad: impl Fn(usize) -> f64) -> Vec<f64> {
        let bins = self.observed[run].bins.bins.iter();
        bins.map(|bin| bin.samples.clone().map(&residual_rad).sum::<f64>() / bin.samples.len() as f64)
            .collect()
    }

    /// For each kind, a mark for each run: its trajectory, and its gain.
    fn partitions(&self) -> [Vec<usize>; 2] {
        let trajectories = self.observed.iter().map(|observed| observed.trajectory).collect();
        let gains = self
            .observed
            .iter()
            .map(|observed| observed.gain.to_bits() as usize)
            .collect();
        [trajectories, gains]
    }
}

/// Rows of a run: the position's in every bin, then one for what the voltages say of the supply.
impl Recorded for RecordedServo<'_> {
    fn runs(&self) -> usize {
        self.observed.len()
    }

    fn channels(&self) -> usize {
        1
    }

    /// The logarithm of the gain.
    fn condition(&self, run: usize) -> f64 {
        self.observed[run].gain.ln()
    }

    fn bins(&self, run: usize) -> &Bins {
        &self.observed[run].bins
    }

    fn bin_of_rows(&self, run: usize) -> Vec<usize> {
        let bins = self.observed[run].bins.len();
        (0..bins).chain([bins.saturating_sub(1)]).collect()
    }

    fn rows_of(&self, _run: usize, pattern_rad: &[f64]) -> Vec<f64> {
        let rows = pattern_rad.iter().map(|rad| rad / self.noise_rad);
        rows.chain([0.0]).collect()
    }

    fn within(&self, _run: usize, rows: &[f64], bins: Range<usize>) -> Vec<f64> {
        let mut within = vec![0.0; rows.len()];
        within[bins.clone()].copy_from_slice(&rows[bins]);
        within
    }

    fn has_cycles(&self) -> bool {
        false
    }

    fn discrepancy_columns(&self, scale_rad: f64) -> DMatrix<f64> {
        let rows_of = |run: usize, pattern_rad: &[f64]| self.rows_of(run, pattern_rad);
        discrepancy::columns(&self.observed, &self.conditions(), scale_rad, rows_of)
    }

    /// Whole trajectories, then whole gains; where all runs have the same of both, the runs.
    fn folds(&self) -> Folds {
        let mut folds = Folds {
            each: Vec::new(),
            partitions: 0.0,
        };
        for marks in self.partitions() {
            folds.leave_out(self, &marks);
        }
        if folds.each.is_empty() {
            folds.leave_out(self, &(0..self.runs()).collect::<Vec<_>>());
        }
        if folds.each.is_empty() {
            return Folds::of_runs_and_cycles(&self.all_bins());
        }
        folds
    }

    /// What is left out is far from the rest, so a refit needs more than a step or two.
    fn steps_without(&self) -> usize {
        8
    }
}

impl Folds {
    /// Leaves out the runs of each mark in turn, where there are several.
    fn leave_out(&mut self, servo: &RecordedServo<'_>, marks: &[usize]) {
        let mut different = marks.to_vec();
        different.sort_unstable();
        different.dedup();
        if different.len() < 2 {
            return;
        }
        self.partitions += 1.0;
        for mark in different {
            let of_run = |run: usize| vec![marks[run] == mark; servo.observed[run].bins.cycles];
            self.each.push(Fold {
                left_out: (0..marks.len()).map(of_run).collect(),
            });
        }
    }
}
