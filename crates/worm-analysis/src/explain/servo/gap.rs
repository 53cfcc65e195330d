//! How far each model is off, stage by stage, from the nominal one down to the noise.
//!
//! Residuals are those of the positions, predicted from the first reading of a run on. Held out are whole trajectories, and whole gains. The
//! free form has a table of friction over speed and load instead of any law: about as much as any friction of these two could explain.

use super::answer::ServoStage;
use super::nuisance::Nuisance;
use super::predict::predict;
use super::recorded_servo::{RecordedServo, ServoProblem};
use crate::explain::answer::StageKind;
use crate::explain::search::cross_validation::hold_out;
use crate::explain::search::fit::{Fit, FitWithout};
use crate::explain::search::folds::Folds;
use crate::explain::search::held_out::HeldOut;
use crate::explain::search::hypothesis::Hypothesis;
use crate::explain::search::plant::Recorded;
use crate::explain::search::squares::{Clusters, Squares};
use rayon::prelude::*;

/// Residuals of a run, rad.
pub(super) fn residual_rad(servo: &RecordedServo<'_>, run: usize, fit: &Fit) -> Vec<f64> {
    let observed = &servo.observed[run];
    let predicted = predict(observed, &servo.physics(fit));
    let pairs = predicted.angle_rad.iter().zip(&observed.recording.position_rad);
    pairs.map(|(predicted, measured)| predicted - measured).collect()
}

/// Mean of the absolute values.
pub(super) fn mean_absolute(values: &[f64]) -> f64 {
    values.iter().map(|value| value.abs()).sum::<f64>() / values.len() as f64
}

/// Root mean square.
pub(super) fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// Squares of every run held out; of all with no folds. Errors of a run hang together, so the scatter is that of runs.
fn clusters(servo: &RecordedServo<'_>, all: &Fit, folds: &[&FitWithout]) -> Clusters {
    let every = vec![vec![true; 1]; servo.runs()];
    let of_all = (all, &every);
    let parts: Vec<(&Fit, &Vec<Vec<bool>>)> = match folds.is_empty() {
        true => vec![of_all],
        false => folds.iter().map(|(fit, out)| (fit, out)).collect(),
    };
    let mut clusters = Clusters::default();
    for (fit, out) in parts {
        let runs: Vec<usize> = (0..servo.runs()).filter(|&run| out[run].contains(&true)).collect();
        let residuals: Vec<Vec<f64>> = runs.par_iter().map(|&run| residual_rad(servo, run, fit)).collect();
        for (&run, residual) in runs.iter().zip(&residuals) {
            for bin in &servo.observed[run].bins.bins {
                if out[run].get(bin.cycle).is_some_and(|out| !out) {
                    continue;
                }
                let here = &residual[bin.samples.clone()];
                let squares = Squares {
                    sum: here.iter().map(|rad| rad * rad).sum(),
                    count: here.len() as f64,
                };
                clusters.add(run, 0, squares);
            }
        }
    }
    clusters
}

/// The fraction of the squared gap that one fit leaves open and another closes on data held out, down to a floor, with its 90 % interval; `NaN` where that is within its error.
pub(super) fn closed(
    servo: &RecordedServo<'_>,
    (open, open_folds): (&Fit, &[&FitWithout]),
    (left, left_folds): (&Fit, &[&FitWithout]),
    floor_rad: f64,
) -> (f64, [f64; 2]) {
    clusters(servo, open, open_folds).closure(&clusters(servo, left, left_folds), floor_rad)
}

/// The stages of a campaign.
pub(super) struct Stages<'s, 'a> {
    servo: &'s RecordedServo<'a>,
    /// Folds that leave out trajectories, of all; the rest leave out gains.
    of_trajectories: usize,
}

impl<'s, 'a> Stages<'s, 'a> {
    pub fn new(servo: &'s RecordedServo<'a>, folds: &Folds) -> Self {
        let mut trajectories: Vec<usize> = servo.observed.iter().map(|observed| observed.trajectory).collect();
        trajectories.sort_unstable();
        trajectories.dedup();
        let of_trajectories = match trajectories.len() {
            1 => 0,
            count => count.min(folds.each.len()),
        };
        Self { servo, of_trajectories }
    }

    /// The stage of a model; without folds it was fitted to nothing, and all data are held out.
    pub fn stage(&self, stage: StageKind, effect: Option<String>, all: &Fit, held_out: Option<&HeldOut>) -> ServoStage {
        let servo = self.servo;
        let runs: Vec<usize> = (0..servo.runs()).collect();
        let residuals: Vec<Vec<f64>> = runs.par_iter().map(|&run| residual_rad(servo, run, all)).collect();
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let of_runs: Vec<f64> = residuals.iter().map(|residual| mean_absolute(residual)).collect();
        let fits = held_out.map_or(&[][..], |held_out| &held_out.fits);
        let clusters = clusters(servo, all, &fits.iter().collect::<Vec<_>>());
        // Mean over the runs, each predicted without its trajectory, or without its gain.
        let left_out = |folds: &[FitWithout]| -> Option<f64> {
            let errors: Vec<f64> = folds
                .par_iter()
                .flat_map_iter(|(fit, out)| {
                    let runs = (0..servo.runs()).filter(|&run| out[run].iter().all(|out| *out));
                    runs.map(|run| mean_absolute(&residual_rad(servo, run, fit)))
                        .collect::<Vec<f64>>()
                })
                .collect();
            (!errors.is_empty()).then(|| mean(&errors))
        };
        let (of_trajectories, of_gains) = fits.split_at(self.of_trajectories.min(fits.len()));
        ServoStage {
            stage,
            effect,
            fit_mean_absolute_error_rad: mean(&of_runs),
            fit_rms_rad: root_mean_square(&residuals.concat()),
            held_out_rms_rad: clusters.total().rms(),
            held_out_interval_rad: clusters.interval_m(),
            without_trajectory_mean_absolute_error_rad: left_out(of_trajectories),
            without_gain_mean_absolute_error_rad: left_out(of_gains),
        }
    }

    /// The recalibrated model with a table of friction over speed and load.
    pub fn free_form(&self, problem: &ServoProblem<'_, '_>, recalibrated: &Fit, folds: &Folds) -> ServoStage {
        let table = Nuisance::table(&self.servo.nominal.motor);
        let mut hypothesis: Hypothesis = recalibrated.hypothesis.clone();
        let mut at = recalibrated.at.clone();
        at.extend(table.iter().map(|free| free.quantity.centre));
        hypothesis.free.extend(table);
        let mut fit = problem.fit(&hypothesis, at, None);
        problem.compute_jacobian(&mut fit);
        let held_out = hold_out(problem, &fit, folds);
        self.stage(StageKind::FreeForm, None, &fit, Some(&held_out))
    }

    /// The noise.
    pub fn floor(&self) -> ServoStage {
        let rad = self.servo.scatter_rad;
        ServoStage {
            stage: StageKind::Floor,
            effect: None,
            fit_mean_absolute_error_rad: rad * (2.0 / std::f64::consts::PI).sqrt(),
            fit_rms_rad: rad,
            held_out_rms_rad: rad,
            held_out_interval_rad: [f64::NAN; 2],
            without_trajectory_mean_absolute_error_rad: None,
            without_gain_mean_absolute_error_rad: None,
        }
    }
}
