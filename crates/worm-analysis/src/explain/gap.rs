//! How far each model is off, stage by stage, from the believed one down to the noise floor.
//!
//! # The figures
//! - *rms*: of every cell's residual within a cycle, its mean in that cycle taken out; so a body that went astray earlier does not
//!   count, and a wrong advance does. Over the settled whole cycles, all cells, all runs.
//! - *advance*: how much more the worm advances in a cycle than the model, from residuals at the same phase of different cycles, by
//!   a straight line over the cycles through all phases and cells.
//! - *energy*: per cycle by (11). Nobody measured it; the reference is what the contacts of the best model take when they are
//!   carried along the measured path, that model's way with its smoothed residual on it, as [`crate::experiment`] accounts for a
//!   recording.
//!
//! # The two ends
//! The *free form* adds to the recalibrated model whatever its residual does in the mean over the cycles: about as much as any
//! law that repeats could close. The *floor* is how single cycles scatter about that: no model of what repeats goes below.

mod energy;
mod free_form;
mod mean_cycle;

use super::answer::{Stage, StageKind};
use super::cross_validation::FitWithout;
use super::fit::{Fit, FitProblem};
use super::observed::Observed;
use super::predict::Predicted;
use super::residual::Residual;
pub(super) use mean_cycle::cycles;
use std::ops::Range;

/// Share of a cycle by which the last one may fall short and still be whole.
const SHORT: f64 = 0.05;
/// Share of a cycle by which the first settled sample may miss the cycle's beginning.
const LATE: f64 = 0.1;
/// Mean of the absolute value of a normal quantity, in standard deviations.
const MEAN_ABSOLUTE: f64 = 0.797_884_560_802_865_4;

/// A campaign with the energy that its motion took by the best model's contacts: what the stages are measured by.
pub(super) struct Measured<'p, 's, 'a> {
    problem: &'p FitProblem<'s, 'a>,
    /// Of each run's settled cycles, J; none where the best model cannot make the run.
    energy_j: Vec<Option<Vec<f64>>>,
    /// What the best model leaves of each run; none where it cannot make it.
    left: Vec<Option<Left>>,
}

/// What a model leaves of a run: every cell's residual, m, `[sample][cell]`, flat; `NaN` where not seen.
#[derive(Debug, Clone)]
struct Left {
    own_m: Vec<f64>,
    body_m: Vec<f64>,
}

impl Left {
    fn new(observed: &Observed<'_>, predicted: &Predicted) -> Self {
        let residual = Residual::new(observed, predicted);
        let cells = observed.cells();
        let own_m = residual.relative_m.iter().enumerate();
        Self {
            own_m: own_m
                .map(|(at, relative_m)| residual.body_m[at / cells] + relative_m)
                .collect(),
            body_m: residual.body_m,
        }
    }

    fn of(problem: &FitProblem<'_, '_>, run: usize, fit: &Fit) -> Option<Self> {
        let predicted = problem.scene.predict(run, &fit.hypothesis, &fit.at)?;
        Some(Self::new(&problem.scene.observed[run], &predicted))
    }
}

/// A whole gait cycle that counts.
#[derive(Debug, Clone)]
struct Cycle {
    /// Number of the cycle since the first sample, from 0.
    index: usize,
    samples: Range<usize>,
}

/// A mean of squares under way.
#[derive(Debug, Clone, Copy, Default)]
struct Squares {
    sum: f64,
    count: f64,
}

impl Squares {
    fn add(&mut self, other: Self) {
        self.sum += other.sum;
        self.count += other.count;
    }

    /// `NaN` of nothing.
    fn rms(self) -> f64 {
        (self.sum / self.count).sqrt()
    }
}

impl<'p, 's, 'a> Measured<'p, 's, 'a> {
    /// The reference by the best fit there is.
    pub fn new(problem: &'p FitProblem<'s, 'a>, best: &Fit) -> Self {
        let runs = 0..problem.scene.observed.len();
        let left: Vec<Option<Left>> = runs.map(|run| Left::of(problem, run, best)).collect();
        let energy = |(run, left): (usize, &Option<Left>)| {
            let drift_m = problem.noise[run].drift.smooth(&left.as_ref()?.body_m);
            let walk = energy::carried(problem, run, best, &drift_m)?;
            Some(walk.energy_j(&problem.scene.observed[run]))
        };
        Self {
            problem,
            energy_j: left.iter().enumerate().map(energy).collect(),
            left,
        }
    }

    /// The stage of a model, fitted to everything in `all`. In each of `folds` it was fitted without the cycles for which the list
    /// of their run says so, numbered by whole cycles from the first sample; without folds it was fitted to nothing, and is
    /// off by as much everywhere. Figures are `NaN` where the model cannot make a run.
    pub fn stage(&self, stage: StageKind, effect: Option<String>, all: &Fit, folds: &[FitWithout]) -> Stage {
        let left = self.left(all);
        let fit_rms_m = self.rms(&left, |_, _| true);
        let mut held_out = Squares::default();
        for (fit, out) in folds {
            let is_out = |run: usize, cycle: usize| out.get(run).and_then(|run| run.get(cycle)) == Some(&true);
            held_out.add(self.squares(&self.left(fit), is_out));
        }
        let energy_j = |run: usize| energy::own(self.problem, run, all).map(|walk| walk.energy_j(self.observed(run)));
        Stage {
            stage,
            effect,
            fit_rms_m,
            held_out_rms_m: if folds.is_empty() { fit_rms_m } else { held_out.rms() },
            advance_error_m: self.mean_over_runs(|run| Some(advance_m(self.observed(run), left[run].as_ref()?).abs())),
            energy_error_j: self.energy_error_j(energy_j),
        }
    }

    /// The stage of the recalibrated model with whatever its residual does in the mean over a run's cycles: fitted with all of them,
    /// held out in blocks with the others, there with a trend over the cycles where that foretells them better. It knows no cause: its
    /// energy is what the recalibrated contacts take on its way.
    pub fn free_form_stage(&self, recalibrated: &Fit) -> Stage {
        let left = self.left(recalibrated);
        let all = self.free_forms(&left, free_form::all);
        let alone = self.free_forms(&left, |observed, left| free_form::held_out(observed, left, false));
        let trend = self.free_forms(&left, |observed, left| free_form::held_out(observed, left, true));
        let rms = |left: &[Option<Left>]| self.rms(left, |_, _| true);
        let energy_j = |run: usize| {
            let observed = self.observed(run);
            let beyond_m = free_form::mean_displacement_m(observed, left[run].as_ref()?);
            Some(energy::carried(self.problem, run, recalibrated, &beyond_m)?.energy_j(observed))
        };
        Stage {
            stage: StageKind::FreeForm,
            effect: None,
            fit_rms_m: rms(&all),
            held_out_rms_m: f64::min(rms(&alone), rms(&trend)),
            advance_error_m: self.mean_over_runs(|run| Some(advance_m(self.observed(run), all[run].as_ref()?).abs())),
            energy_error_j: self.energy_error_j(energy_j),
        }
    }

    /// The noise floor: how single cycles scatter about their mean and trend, by the best model's residual, corrected for what mean
    /// and trend took with them; and how far chance puts the mean of as many cycles off the truth.
    pub fn floor_stage(&self) -> Stage {
        let scatter = self.free_forms(&self.left, free_form::all);
        let mut squares = Squares::default();
        for (run, scatter) in scatter.iter().enumerate() {
            squares.add(match scatter {
                Some(left) => free_form::floor(self.observed(run), left),
                None => Squares {
                    sum: f64::NAN,
                    count: 0.0,
                },
            });
        }
        let chance = |sigma: f64, run: usize| {
            let cycles = settled_cycles(self.observed(run)).len() as f64;
            MEAN_ABSOLUTE * sigma / cycles.sqrt()
        };
        Stage {
            stage: StageKind::Floor,
            effect: None,
            fit_rms_m: squares.rms(),
            held_out_rms_m: squares.rms(),
            advance_error_m: self.mean_over_runs(|run| Some(chance(self.problem.noise[run].drift_per_cycle_m(), run))),
            energy_error_j: self.mean_over_runs(|run| Some(chance(deviation(self.energy_j[run].as_ref()?), run))),
        }
    }

    fn runs(&self) -> usize {
        self.problem.scene.observed.len()
    }

    fn observed(&self, run: usize) -> &Observed<'a> {
        &self.problem.scene.observed[run]
    }

    fn left(&self, fit: &Fit) -> Vec<Option<Left>> {
        (0..self.runs()).map(|run| Left::of(self.problem, run, fit)).collect()
    }

    fn free_forms(&self, left: &[Option<Left>], without: impl Fn(&Observed<'_>, &Left) -> Left) -> Vec<Option<Left>> {
        let runs = left.iter().enumerate();
        runs.map(|(run, left)| Some(without(self.observed(run), left.as_ref()?)))
            .collect()
    }

    fn squares(&self, left: &[Option<Left>], counts: impl Fn(usize, usize) -> bool) -> Squares {
        let mut squares = Squares::default();
        for (run, left) in left.iter().enumerate() {
            squares.add(match left {
                Some(left) => within_cycles(self.observed(run), left, |cycle| counts(run, cycle)),
                None => Squares {
                    sum: f64::NAN,
                    count: 0.0,
                },
            });
        }
        squares
    }

    fn rms(&self, left: &[Option<Left>], counts: impl Fn(usize, usize) -> bool) -> f64 {
        self.squares(left, counts).rms()
    }

    /// `NaN` where a run has no figure.
    fn mean_over_runs(&self, of: impl Fn(usize) -> Option<f64>) -> f64 {
        let sum: f64 = (0..self.runs()).map(|run| of(run).unwrap_or(f64::NAN)).sum();
        sum / self.runs() as f64
    }

    /// How far a model's energy per cycle is off the reference's, J.
    fn energy_error_j(&self, of: impl Fn(usize) -> Option<Vec<f64>>) -> f64 {
        self.mean_over_runs(|run| Some((mean(&of(run)?) - mean(self.energy_j[run].as_ref()?)).abs()))
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Standard deviation of single values; `NaN` of fewer than two.
fn deviation(values: &[f64]) -> f64 {
    let mean = mean(values);
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (squares / (values.len() as f64 - 1.0)).sqrt()
}

/// The whole cycles, counted from the first sample, in which the crawl is settled.
fn settled_cycles(observed: &Observed<'_>) -> Vec<Cycle> {
    let phase = &observed.phase;
    let since_first = |sample: usize| phase[sample] - phase[0];
    let last = observed.samples() - 1;
    let from = (since_first(observed.settled_from().min(last)) - LATE).ceil().max(0.0) as usize;
    let until = (since_first(last) + SHORT).floor().max(0.0) as usize;
    let begin = |index: usize| phase.partition_point(|&here| here - phase[0] < index as f64);
    (from..until)
        .map(|index| Cycle {
            index,
            samples: begin(index)..begin(index + 1),
        })
        .collect()
}

/// A series at the beginnings of these cycles and at the end of the last, in straight lines between samples.
fn at_boundaries(observed: &Observed<'_>, cycles: &[Cycle], series: &[f64]) -> Vec<f64> {
    let phase = &observed.phase;
    let indices = cycles.iter().map(|cycle| cycle.index);
    let boundaries = indices.chain(cycles.last().map(|cycle| cycle.index + 1));
    boundaries
        .map(|index| {
            let boundary = phase[0] + index as f64;
            let high = phase.partition_point(|&here| here < boundary).clamp(1, phase.len() - 1);
            let width = phase[high] - phase[high - 1];
            let fraction = if width > 0.0 {
                (boundary - phase[high - 1]) / width
            } else {
                1.0
            };
            series[high - 1] + fraction * (series[high] - series[high - 1])
        })
        .collect()
}

/// Squares of every cell's residual within the cycles that count, about its mean in each.
fn within_cycles(observed: &Observed<'_>, left: &Left, counts: impl Fn(usize) -> bool) -> Squares {
    let cells = observed.cells();
    let mut squares = Squares::default();
    for cycle in settled_cycles(observed).iter().filter(|cycle| counts(cycle.index)) {
        for cell in 0..cells {
            let own_m = || {
                let of_cell = cycle.samples.clone().map(|sample| left.own_m[sample * cells + cell]);
                of_cell.filter(|own_m| own_m.is_finite())
            };
            let seen = own_m().count() as f64;
            if seen > 1.0 {
                let mean_m = own_m().sum::<f64>() / seen;
                squares.add(Squares {
                    sum: own_m().map(|own_m| (own_m - mean_m).powi(2)).sum(),
                    count: seen - 1.0,
                });
            }
        }
    }
    squares
}

/// How much more the worm advances in a cycle than the model has it, m: mean over the cells; `NaN` where no phase is seen twice.
fn advance_m(observed: &Observed<'_>, left: &Left) -> f64 {
    let cycles = settled_cycles(observed);
    let bins = free_form::bins(observed);
    let binned = free_form::binned(observed, &cycles, left, bins);
    let of_cell = |cell: usize| {
        let (mut along, mut across) = (0.0, 0.0);
        for bin in 0..bins {
            let seen: Vec<(f64, f64)> = cycles
                .iter()
                .zip(&binned)
                .map(|(cycle, own_m)| (cycle.index as f64, own_m[cell * bins + bin]))
                .filter(|(_, own_m)| own_m.is_finite())
                .collect();
            let middle = seen.iter().map(|(index, _)| index).sum::<f64>() / seen.len() as f64;
            along += seen.iter().map(|(index, own_m)| (index - middle) * own_m).sum::<f64>();
            across += seen.iter().map(|(index, _)| (index - middle).powi(2)).sum::<f64>();
        }
        along / across
    };
    let advances_m: Vec<f64> = (0..observed.cells())
        .map(of_cell)
        .filter(|advance_m| advance_m.is_finite())
        .collect();
    mean(&advances_m)
}

#[cfg(test)]
mod tests;
