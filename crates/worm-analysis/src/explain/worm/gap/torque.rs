//! The gap of the torque on the cam, where the motor's current counts: all that there is of a worm that nobody sees.
//!
//! It is the residual in the bins of the settled whole cycles, but for those beside the jump from one step to the next. Other than a
//! position's, a torque's mean over a cycle counts: it is a pull on the body.

use crate::explain::answer::TorqueGap;
use crate::explain::search::fit::Fit;
use crate::explain::search::squares::{Clusters, Squares};
use crate::explain::worm::recorded_worm::RecordedWorm;
use crate::explain::worm::settled_cycles::settled_cycles;
use crate::explain::worm::torque_residual;

/// Consecutive cycles that are held out together.
const BLOCK: usize = 2;

/// The torque's residual in a run, N m: `[settled cycle][place in the cycle]`; `NaN` where not seen.
type Table = Vec<Vec<f64>>;

/// A stage's gap, by its residuals of all runs and by what it leaves of cycles held out.
pub(super) fn gap(fit: Squares, held_out: &Clusters) -> TorqueGap {
    TorqueGap {
        fit_rms_n_m: fit.rms(),
        held_out_rms_n_m: held_out.total().rms(),
        held_out_interval_n_m: held_out.interval_m(),
    }
}

/// Squares of each settled cycle of a run under a fit, N² m²; nothing counts in a run without a current. None where the fit cannot make the
/// run.
pub(super) fn of_cycles(worm: &RecordedWorm<'_>, run: usize, fit: &Fit) -> Option<Vec<Squares>> {
    Some(table(worm, run, fit)?.iter().map(|cycle| squares(cycle)).collect())
}

/// Squares of the scatter of single cycles about their mean, by a fit: no model of what repeats falls below it.
pub(super) fn floor(worm: &RecordedWorm<'_>, fit: &Fit) -> Squares {
    over_runs(worm, fit, |table| {
        let left = squares_of(&without_mean(&table, |_, _| true));
        // Each place gave one degree of freedom for its mean.
        let places = table.first().map_or(0, Vec::len);
        let means = (0..places).filter(|&place| table.iter().any(|cycle| cycle[place].is_finite()));
        Squares {
            count: left.count - means.count() as f64,
            ..left
        }
    })
}

/// The gap where the mean cycle of a fit's residual is added to it: over all cycles, and for each block of cycles over all others.
pub(super) fn free_form(worm: &RecordedWorm<'_>, fit: &Fit) -> TorqueGap {
    let all = over_runs(worm, fit, |table| squares_of(&without_mean(&table, |_, _| true)));
    let is_other_block = |of: usize, other: usize| of / BLOCK != other / BLOCK;
    let held_out = over_runs(worm, fit, |table| squares_of(&without_mean(&table, is_other_block)));
    TorqueGap {
        fit_rms_n_m: all.rms(),
        held_out_rms_n_m: held_out.rms(),
        held_out_interval_n_m: [f64::NAN; 2],
    }
}

fn over_runs(worm: &RecordedWorm<'_>, fit: &Fit, of: impl Fn(Table) -> Squares) -> Squares {
    let mut all = Squares::default();
    for run in 0..worm.scene.observed.len() {
        all.add(table(worm, run, fit).map_or(Squares::IMPOSSIBLE, &of));
    }
    all
}

fn table(worm: &RecordedWorm<'_>, run: usize, fit: &Fit) -> Option<Table> {
    let (observed, bins) = (&worm.scene.observed[run], &worm.bins[run]);
    let predicted = worm.scene.predict(run, &fit.hypothesis, &fit.at)?;
    let residual_n_m = torque_residual::residual_n_m(observed, bins, &predicted);
    let cycles = settled_cycles(observed);
    let mut table = vec![vec![f64::NAN; bins.per_cycle() as usize]; cycles.len()];
    for (bin, residual_n_m) in residual_n_m.iter().enumerate() {
        let cycle = cycles.iter().position(|cycle| cycle.index == bins.bins[bin].cycle);
        if let Some(cycle) = cycle.filter(|_| worm.torque_noise[run].counts(bin)) {
            table[cycle][bins.place(bin)] = *residual_n_m;
        }
    }
    Some(table)
}

/// Each cycle less the mean of those that count for it, by their numbers.
fn without_mean(table: &Table, counts: impl Fn(usize, usize) -> bool) -> Table {
    let less_mean = |(of, cycle): (usize, &Vec<f64>)| {
        let at = |(place, value): (usize, &f64)| {
            let others = table.iter().enumerate().filter(|(other, _)| counts(of, *other));
            let seen = others.map(|(_, other)| other[place]).filter(|value| value.is_finite());
            let (sum, count) = seen.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
            value - sum / count // NaN where no other cycle shows it
        };
        cycle.iter().enumerate().map(at).collect()
    };
    table.iter().enumerate().map(less_mean).collect()
}

fn squares(cycle: &[f64]) -> Squares {
    let seen = cycle.iter().filter(|value| value.is_finite());
    seen.fold(Squares::default(), |all, value| Squares {
        sum: all.sum + value * value,
        count: all.count + 1.0,
    })
}

fn squares_of(table: &Table) -> Squares {
    let mut all = Squares::default();
    table.iter().for_each(|cycle| all.add(squares(cycle)));
    all
}
