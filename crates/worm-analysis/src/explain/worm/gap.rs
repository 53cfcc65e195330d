//! How far each model is off, stage by stage, from the nominal one down to the noise floor.
//!
//! # The figures
//! - *rms*: of every cell's residual within a cycle, its mean in that cycle removed; so earlier errors of the body do not count, and a
//!   wrong advance does. Over the settled whole cycles, all cells, all runs.
//! - *advance*: how much more the worm advances in a cycle than the model: the slope of a straight line over the cycles through
//!   residuals at the same phase, common to all phases and cells.
//! - *energy*: per cycle by (11). Where the motor's current counts, it is the net work of the drive (13), and the reference the work that
//!   the current shows the cam take, by the gears of the best model. Elsewhere nobody measured it; the reference is the energy that the contacts of the best model take along the
//!   measured path, which is that model's path plus its smoothed residual, as [`crate::experiment`] computes it for a recording.
//!
//! - *torque*: where the motor's current counts, its residual in the bins of the same cycles. Of a campaign without positions it takes the
//!   place of the first two: nobody measured an advance, and closures are those of the torque.
//!
//! # The two ends
//! The *free form* adds the mean cycle of its residual to the recalibrated model: about as much as any periodic law could explain.
//! The *floor* is the scatter of single cycles about that: no periodic model falls below it.

mod free_form;
mod mean_cycle;
mod torque;

use super::energy;
use super::observed::Observed;
use super::predicted::Predicted;
use super::recorded_worm::RecordedWorm;
use super::residual::Residual;
use super::settled_cycles::{Cycle, settled_cycles};
use super::torque_discrepancy;
use crate::explain::answer::{Stage, StageKind, TorqueGap};
use crate::explain::search::fit::{Fit, FitWithout};
use crate::explain::search::squares::{Clusters, NINETY, Squares};
pub(in crate::explain) use mean_cycle::cycles;

/// Mean of the absolute value of a normal quantity, in standard deviations.
const MEAN_ABSOLUTE: f64 = 0.797_884_560_802_865_4;

/// A campaign with the energy that its motion took by the contacts of the best model: the reference for all stages.
pub(in crate::explain) struct Measured<'p, 'a> {
    worm: &'p RecordedWorm<'a>,
    /// Of each run's settled cycles, J; none where the best model cannot make the run.
    energy_j: Vec<Option<Vec<f64>>>,
    /// Residuals of the best model in each run; none where it cannot make the run.
    residuals: Vec<Option<CellResiduals>>,
    best: &'p Fit,
}

/// Every cell's residual in a run, m, `[sample][cell]`, flat, and the body's, m; `NaN` where not seen.
#[derive(Debug, Clone)]
struct CellResiduals {
    own_m: Vec<f64>,
    body_m: Vec<f64>,
}

impl CellResiduals {
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

    fn of(worm: &RecordedWorm<'_>, run: usize, fit: &Fit) -> Option<Self> {
        let predicted = worm.scene.predict(run, &fit.hypothesis, &fit.at)?;
        Some(Self::new(&worm.scene.observed[run], &predicted))
    }
}

/// Squares of each cycle held out, by which closures are judged: of the positions, or of the torque where nobody sees the cells.
pub(in crate::explain) fn clusters(worm: &RecordedWorm<'_>, all: &Fit, folds: &[&FitWithout]) -> Clusters {
    match worm.sees_positions() {
        true => clusters_by(worm, all, folds, of_cycles),
        false => clusters_by(worm, all, folds, torque::of_cycles),
    }
}

/// Squares of each cycle held out: `of_cycles` gives those of all settled cycles of a run under a fit. Without folds all are held out.
fn clusters_by(
    worm: &RecordedWorm<'_>,
    all: &Fit,
    folds: &[&FitWithout],
    of_cycles: impl Fn(&RecordedWorm<'_>, usize, &Fit) -> Option<Vec<Squares>>,
) -> Clusters {
    let mut clusters = Clusters::default();
    let mut add = |fit: &Fit, is_out: &dyn Fn(usize, usize) -> bool| {
        for (run, observed) in worm.scene.observed.iter().enumerate() {
            let squares = of_cycles(worm, run, fit);
            for (number, cycle) in settled_cycles(observed).iter().enumerate() {
                if is_out(run, cycle.index) {
                    let of_cycle = squares.as_ref().map_or(Squares::IMPOSSIBLE, |squares| squares[number]);
                    clusters.add(run, cycle.index, of_cycle);
                }
            }
        }
    };
    for (fit, out) in folds {
        add(fit, &|run, cycle| {
            out.get(run).and_then(|run| run.get(cycle)) == Some(&true)
        });
    }
    if folds.is_empty() {
        add(all, &|_, _| true);
    }
    clusters
}

/// 90 % interval of the fraction of the squared gap that one fit leaves open and another closes on data held out, down to the scatter of
/// single cycles and a discrepancy that no model is without (`discrepancy_m` of the positions, of a torque the ripple of the gears, too);
/// none where that is within its error.
pub(in crate::explain) fn closed(
    worm: &RecordedWorm<'_>,
    (open, open_folds): (&Fit, &[&FitWithout]),
    (left, left_folds): (&Fit, &[&FitWithout]),
    discrepancy_m: f64,
) -> Option<[f64; 2]> {
    let floor = if worm.sees_positions() {
        let runs = 0..worm.scene.observed.len();
        let residuals: Vec<Option<CellResiduals>> = runs.map(|run| CellResiduals::of(worm, run, left)).collect();
        scatter(worm, &residuals).rms().hypot(discrepancy_m)
    } else {
        let gear = worm.gear()?;
        torque::floor(worm, left)
            .rms()
            .hypot(torque_discrepancy::rms_n_m(&worm.scene.nominal, gear))
    };
    let left = clusters(worm, left, left_folds);
    let (_, interval) = clusters(worm, open, open_folds).closure(&left, floor);
    interval.iter().all(|end| end.is_finite()).then_some(interval)
}

/// Squares of the scatter of single cycles about their mean and trend, by the residuals of a model, corrected for the degrees of freedom
/// of mean and trend.
fn scatter(worm: &RecordedWorm<'_>, residuals: &[Option<CellResiduals>]) -> Squares {
    let mut squares = Squares::default();
    for (observed, residuals) in worm.scene.observed.iter().zip(residuals) {
        squares.add(match residuals {
            Some(_) if !observed.sees_positions => Squares::default(),
            Some(residuals) => free_form::floor(observed, &free_form::all(observed, residuals)),
            None => Squares::IMPOSSIBLE,
        });
    }
    squares
}

impl<'p, 'a> Measured<'p, 'a> {
    /// The reference by the best fit.
    pub fn new(worm: &'p RecordedWorm<'a>, best: &'p Fit) -> Self {
        let runs = 0..worm.scene.observed.len();
        let residuals: Vec<Option<CellResiduals>> = runs.map(|run| CellResiduals::of(worm, run, best)).collect();
        let energy = |(run, residuals): (usize, &Option<CellResiduals>)| {
            let observed = &worm.scene.observed[run];
            if let Some(torque) = &observed.torque {
                let gears = worm.scene.predict(run, &best.hypothesis, &best.at)?.gears;
                let work_j = torque.cumulative_j(&observed.phase, &gears);
                return Some(energy::of_cycles(observed, &work_j));
            }
            let drift_m = worm.noise[run].smooth(&worm.scene.observed[run], &residuals.as_ref()?.body_m);
            let walk = energy::carried(&worm.scene, run, best, &drift_m)?;
            Some(walk.energy_j(&worm.scene.observed[run]))
        };
        Self {
            worm,
            energy_j: residuals.iter().enumerate().map(energy).collect(),
            residuals,
            best,
        }
    }

    /// The stage of a model. `all` is its fit to all data; each of `folds` is its fit without some cycles, marked in the list of their
    /// run, which counts whole cycles from the first sample. Without folds it was fitted to nothing, and all data are held out.
    /// Figures are `NaN` where the model cannot make a run.
    pub fn stage(&self, stage: StageKind, effect: Option<String>, all: &Fit, folds: &[FitWithout]) -> Stage {
        let residuals = self.residuals(all);
        let fit_rms_m = self.rms(&residuals, |_, _| true);
        let folds: Vec<&FitWithout> = folds.iter().collect();
        let held_out = clusters_by(self.worm, all, &folds, of_cycles);
        let energy_j = |run: usize| {
            let (observed, under) = (self.observed(run), (&all.hypothesis, &all.at[..]));
            if observed.torque.is_some() {
                let predicted = self.worm.scene.predict(run, under.0, under.1)?;
                return Some(energy::of_cycles(observed, &predicted.work_j));
            }
            Some(energy::own(&self.worm.scene, run, under)?.energy_j(observed))
        };
        Stage {
            stage,
            effect,
            fit_rms_m,
            held_out_rms_m: held_out.total().rms(),
            held_out_interval_m: held_out.interval_m(),
            advance_error_interval_m: self.advance_interval_m(&residuals),
            advance_error_m: self
                .mean_over_seen(|run| Some(advance_m(self.observed(run), residuals[run].as_ref()?).abs())),
            energy_error_j: self.energy_error_j(energy_j),
            torque: self.of_torque(|| {
                let fitted = clusters_by(self.worm, all, &[], torque::of_cycles).total();
                torque::gap(fitted, &clusters_by(self.worm, all, &folds, torque::of_cycles))
            }),
        }
    }

    /// Of the torque, where it counts.
    fn of_torque(&self, gap: impl FnOnce() -> TorqueGap) -> Option<TorqueGap> {
        self.worm.counts_current().then(gap)
    }

    /// The stage of the recalibrated model plus the mean cycle of its residual in each run: over all cycles for the fit, over the others
    /// for cycles that are held out in blocks, there with a trend over the cycles where that predicts them better. Its energy is what
    /// the recalibrated contacts take along its path.
    pub fn free_form_stage(&self, recalibrated: &Fit) -> Stage {
        let residuals = self.residuals(recalibrated);
        let all = self.free_forms(&residuals, free_form::all);
        let alone = self.free_forms(&residuals, |observed, residuals| {
            free_form::held_out(observed, residuals, false)
        });
        let trend = self.free_forms(&residuals, |observed, residuals| {
            free_form::held_out(observed, residuals, true)
        });
        let rms = |residuals: &[Option<CellResiduals>]| self.rms(residuals, |_, _| true);
        let energy_j = |run: usize| {
            let observed = self.observed(run);
            let residuals = residuals[run].as_ref().filter(|_| observed.sees_positions)?;
            let beyond_m = free_form::mean_displacement_m(observed, residuals);
            Some(energy::carried(&self.worm.scene, run, recalibrated, &beyond_m)?.energy_j(observed))
        };
        Stage {
            stage: StageKind::FreeForm,
            effect: None,
            fit_rms_m: rms(&all),
            held_out_rms_m: f64::min(rms(&alone), rms(&trend)),
            held_out_interval_m: [f64::NAN; 2],
            advance_error_interval_m: [f64::NAN; 2],
            advance_error_m: self.mean_over_seen(|run| Some(advance_m(self.observed(run), all[run].as_ref()?).abs())),
            energy_error_j: self.energy_error_j(energy_j),
            torque: self.of_torque(|| torque::free_form(self.worm, recalibrated)),
        }
    }

    /// The noise floor: the scatter of single cycles, by the residual of the best model, and the expected error of a mean over as many
    /// cycles.
    pub fn floor_stage(&self) -> Stage {
        let squares = scatter(self.worm, &self.residuals);
        let chance = |sigma: f64, run: usize| {
            let cycles = settled_cycles(self.observed(run)).len() as f64;
            MEAN_ABSOLUTE * sigma / cycles.sqrt()
        };
        Stage {
            stage: StageKind::Floor,
            effect: None,
            fit_rms_m: squares.rms(),
            held_out_rms_m: squares.rms(),
            held_out_interval_m: [f64::NAN; 2],
            advance_error_interval_m: [f64::NAN; 2],
            advance_error_m: self.mean_over_seen(|run| Some(chance(self.worm.noise[run].drift_per_cycle_m(), run))),
            energy_error_j: self.mean_over_runs(|run| Some(chance(deviation(self.energy_j[run].as_ref()?), run))),
            torque: self.of_torque(|| {
                let rms_n_m = torque::floor(self.worm, self.best).rms();
                TorqueGap {
                    fit_rms_n_m: rms_n_m,
                    held_out_rms_n_m: rms_n_m,
                    held_out_interval_n_m: [f64::NAN; 2],
                }
            }),
        }
    }

    /// The noise floor of what closures are judged by: m of positions, N m of a torque.
    pub fn floor_of_closure(&self) -> f64 {
        match self.worm.sees_positions() {
            true => scatter(self.worm, &self.residuals).rms(),
            false => torque::floor(self.worm, self.best).rms(),
        }
    }

    /// 90 % interval of the mean over the runs of how far the advance is off, m: by the scatter of the cycles.
    fn advance_interval_m(&self, residuals: &[Option<CellResiduals>]) -> [f64; 2] {
        let of = |run: usize| Some(advance_m(self.observed(run), residuals[run].as_ref()?).abs());
        let mean_m = self.mean_over_seen(of);
        let seen = || (0..self.runs()).filter(|&run| self.observed(run).sees_positions);
        let variance_m2: f64 = seen()
            .map(|run| {
                self.worm.noise[run].drift_per_cycle_m().powi(2) / settled_cycles(self.observed(run)).len() as f64
            })
            .sum();
        let half_m = NINETY * variance_m2.sqrt() / seen().count() as f64;
        [(mean_m - half_m).max(0.0), mean_m + half_m]
    }

    fn runs(&self) -> usize {
        self.worm.scene.observed.len()
    }

    fn observed(&self, run: usize) -> &Observed<'a> {
        &self.worm.scene.observed[run]
    }

    fn residuals(&self, fit: &Fit) -> Vec<Option<CellResiduals>> {
        (0..self.runs())
            .map(|run| CellResiduals::of(self.worm, run, fit))
            .collect()
    }

    fn free_forms(
        &self,
        residuals: &[Option<CellResiduals>],
        without: impl Fn(&Observed<'_>, &CellResiduals) -> CellResiduals,
    ) -> Vec<Option<CellResiduals>> {
        let runs = residuals.iter().enumerate();
        runs.map(|(run, residuals)| Some(without(self.observed(run), residuals.as_ref()?)))
            .collect()
    }

    fn squares(&self, residuals: &[Option<CellResiduals>], counts: impl Fn(usize, usize) -> bool) -> Squares {
        let mut squares = Squares::default();
        for (run, residuals) in residuals.iter().enumerate() {
            squares.add(match residuals {
                Some(residuals) => within_cycles(self.observed(run), residuals, |cycle| counts(run, cycle)),
                None => Squares::IMPOSSIBLE,
            });
        }
        squares
    }

    fn rms(&self, residuals: &[Option<CellResiduals>], counts: impl Fn(usize, usize) -> bool) -> f64 {
        self.squares(residuals, counts).rms()
    }

    /// Mean over all runs; `NaN` where a run has no figure.
    fn mean_over_runs(&self, of: impl Fn(usize) -> Option<f64>) -> f64 {
        let sum: f64 = (0..self.runs()).map(|run| of(run).unwrap_or(f64::NAN)).sum();
        sum / self.runs() as f64
    }

    /// Mean over the runs with positions; `NaN` where there is none, or one has no figure.
    fn mean_over_seen(&self, of: impl Fn(usize) -> Option<f64>) -> f64 {
        let seen = (0..self.runs()).filter(|&run| self.observed(run).sees_positions);
        mean(&seen.map(|run| of(run).unwrap_or(f64::NAN)).collect::<Vec<_>>())
    }

    /// Error of a model's energy per cycle against the reference, J.
    fn energy_error_j(&self, of: impl Fn(usize) -> Option<Vec<f64>>) -> f64 {
        self.mean_over_runs(|run| Some((mean(&of(run)?) - mean(self.energy_j[run].as_ref()?)).abs()))
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Standard deviation of single values; `NaN` of fewer than two.
pub(in crate::explain) fn deviation(values: &[f64]) -> f64 {
    let mean = mean(values);
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (squares / (values.len() as f64 - 1.0)).sqrt()
}

/// Squares of each settled cycle of a run under a fit; none where the fit cannot make the run.
fn of_cycles(worm: &RecordedWorm<'_>, run: usize, fit: &Fit) -> Option<Vec<Squares>> {
    let (observed, residuals) = (&worm.scene.observed[run], CellResiduals::of(worm, run, fit)?);
    let cycles = settled_cycles(observed);
    Some(
        cycles
            .iter()
            .map(|cycle| of_cycle(observed, &residuals, cycle))
            .collect(),
    )
}

/// Squares of every cell's residual within the cycles that count, about its mean in each.
fn within_cycles(observed: &Observed<'_>, residuals: &CellResiduals, counts: impl Fn(usize) -> bool) -> Squares {
    let mut squares = Squares::default();
    for cycle in settled_cycles(observed).iter().filter(|cycle| counts(cycle.index)) {
        squares.add(of_cycle(observed, residuals, cycle));
    }
    squares
}

/// Squares of every cell's residual within a cycle, about its mean in it.
fn of_cycle(observed: &Observed<'_>, residuals: &CellResiduals, cycle: &Cycle) -> Squares {
    let cells = observed.cells();
    let mut squares = Squares::default();
    for cell in 0..cells {
        let own_m = || {
            let samples = cycle.samples.clone();
            let of_cell = samples.map(|sample| residuals.own_m[sample * cells + cell]);
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
    squares
}

/// How much more the worm advances in a cycle than the model has it, m: mean over the cells; `NaN` where no phase is seen twice.
fn advance_m(observed: &Observed<'_>, residuals: &CellResiduals) -> f64 {
    let cycles = settled_cycles(observed);
    let bins = free_form::bins(observed);
    let binned = free_form::binned(observed, &cycles, residuals, bins);
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
