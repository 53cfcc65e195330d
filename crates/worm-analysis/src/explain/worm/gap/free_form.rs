//! The mean cycle of the residual: what a model of any form could add.

use super::{CellResiduals, advance_m, within_cycles};
use crate::explain::search::squares::Squares;
use crate::explain::worm::observed::Observed;
use crate::explain::worm::settled_cycles::{Cycle, settled_cycles};

/// Most bins of a step.
const BINS_PER_STEP: usize = 12;
/// Fewest samples in a bin, on average.
const SAMPLES_PER_BIN: f64 = 3.0;
/// Cycles from which the mean cycle has a trend.
const TREND_CYCLES: usize = 5;
/// Consecutive cycles that are held out together.
const BLOCK: usize = 2;

/// Bins of a cycle.
pub(super) fn bins(observed: &Observed<'_>) -> usize {
    let cycles = observed.phase[observed.samples() - 1] - observed.phase[0];
    let max = observed.samples() as f64 / cycles / SAMPLES_PER_BIN;
    (BINS_PER_STEP * observed.cells()).min(max as usize).max(1)
}

/// Mean residual of each cell in each bin, m: `[cycle][cell × bins + bin]`; `NaN` where not seen.
pub(super) fn binned(
    observed: &Observed<'_>,
    cycles: &[Cycle],
    residuals: &CellResiduals,
    bins: usize,
) -> Vec<Vec<f64>> {
    let cells = observed.cells();
    let of_cycle = |cycle: &Cycle| {
        let (mut sum_m, mut seen) = (vec![0.0; cells * bins], vec![0.0; cells * bins]);
        for sample in cycle.samples.clone() {
            let bin = place(observed, cycle, sample, bins).clamp(0.0, bins as f64 - 1.0) as usize;
            for cell in 0..cells {
                let own_m = residuals.own_m[sample * cells + cell];
                if own_m.is_finite() {
                    sum_m[cell * bins + bin] += own_m;
                    seen[cell * bins + bin] += 1.0;
                }
            }
        }
        sum_m.iter().zip(&seen).map(|(sum_m, seen)| sum_m / seen).collect()
    };
    cycles.iter().map(of_cycle).collect()
}

/// Position of a sample in its cycle, in bins.
fn place(observed: &Observed<'_>, cycle: &Cycle, sample: usize, bins: usize) -> f64 {
    (observed.phase[sample] - observed.phase[0] - cycle.index as f64) * bins as f64
}

/// The residual without its mean cycle, and without the trend of it where there are enough cycles.
pub(super) fn all(observed: &Observed<'_>, residuals: &CellResiduals) -> CellResiduals {
    let has_trend = settled_cycles(observed).len() >= TREND_CYCLES;
    without(observed, residuals, has_trend, |_, _| true)
}

/// Squares within cycles of what [`all`] leaves, corrected for its degrees of freedom: it removed a fraction, its terms over the number
/// of cycles, of the scatter that varies from bin to bin, and nothing of what varies within bins.
pub(super) fn floor(observed: &Observed<'_>, scatter: &CellResiduals) -> Squares {
    let cycles = settled_cycles(observed);
    let bins = bins(observed);
    let terms = if cycles.len() >= TREND_CYCLES { 2.0 } else { 1.0 };
    let (mut square_sum, mut count) = (0.0, 0.0);
    for mut shape in binned(observed, &cycles, scatter, bins) {
        about_mean(&mut shape, bins);
        for own_m in shape.into_iter().filter(|own_m| own_m.is_finite()) {
            square_sum += own_m * own_m;
            count += 1.0;
        }
    }
    let taken_m2 = square_sum / count * terms / (cycles.len() as f64 - terms);
    let residuals = within_cycles(observed, scatter, |_| true);
    Squares {
        sum: residuals.sum + residuals.count * taken_m2,
        ..residuals
    }
}

/// The residual of each block of cycles without the mean cycle of all others, and without their trend where `with_trend` and there are
/// enough of them.
pub(super) fn held_out(observed: &Observed<'_>, residuals: &CellResiduals, with_trend: bool) -> CellResiduals {
    let has_trend = with_trend && settled_cycles(observed).len() >= TREND_CYCLES + BLOCK;
    without(observed, residuals, has_trend, |of, other| of / BLOCK != other / BLOCK)
}

/// Subtracts from each cycle the mean cycle of those that count for it, by their indices among the settled ones.
fn without(
    observed: &Observed<'_>,
    residuals: &CellResiduals,
    has_trend: bool,
    counts: impl Fn(usize, usize) -> bool,
) -> CellResiduals {
    let cells = observed.cells();
    let cycles = settled_cycles(observed);
    let bins = bins(observed);
    let mut shapes = binned(observed, &cycles, residuals, bins);
    shapes.iter_mut().for_each(|shape| about_mean(shape, bins));
    let advance_m = advance_m(observed, residuals);
    let mut free = residuals.clone();
    for (number, cycle) in cycles.iter().enumerate() {
        let others: Vec<usize> = (0..cycles.len()).filter(|&other| counts(number, other)).collect();
        let shape = predicted_shape(&shapes, &others, number, has_trend);
        for sample in cycle.samples.clone() {
            let place = place(observed, cycle, sample, bins);
            for cell in 0..cells {
                free.own_m[sample * cells + cell] -=
                    between(&shape[cell * bins..(cell + 1) * bins], place) + advance_m * cycle.index as f64;
            }
        }
    }
    free
}

/// Subtracts each cell's mean over a cycle.
fn about_mean(shape: &mut [f64], bins: usize) {
    for cell in shape.chunks_exact_mut(bins) {
        let seen = cell.iter().filter(|own_m| own_m.is_finite());
        let (sum_m, count) = seen.fold((0.0, 0.0), |(sum, count), own_m| (sum + own_m, count + 1.0));
        cell.iter_mut().for_each(|own_m| *own_m -= sum_m / count);
    }
}

/// A cycle's shape predicted from those of others, m; `NaN` where none of them has a value.
fn predicted_shape(shapes: &[Vec<f64>], others: &[usize], number: usize, has_trend: bool) -> Vec<f64> {
    let entries = shapes.first().map_or(0, Vec::len);
    (0..entries)
        .map(|entry| {
            let seen: Vec<(f64, f64)> = others
                .iter()
                .map(|&other| (other as f64, shapes[other][entry]))
                .filter(|(_, own_m)| own_m.is_finite())
                .collect();
            let count = seen.len() as f64;
            let middle = seen.iter().map(|(other, _)| other).sum::<f64>() / count;
            let level_m = seen.iter().map(|(_, own_m)| own_m).sum::<f64>() / count;
            if !has_trend || seen.len() < TREND_CYCLES {
                return level_m;
            }
            let along: f64 = seen.iter().map(|(other, own_m)| (other - middle) * own_m).sum();
            let across: f64 = seen.iter().map(|(other, _)| (other - middle).powi(2)).sum();
            level_m + (number as f64 - middle) * along / across
        })
        .collect()
}

/// A shape, linear between the centres of its bins and extrapolated at the ends; `NaN` where it is not known.
fn between(shape: &[f64], place: f64) -> f64 {
    if shape.len() < 2 {
        return shape.first().copied().unwrap_or(f64::NAN);
    }
    let low = (place - 0.5).floor().clamp(0.0, shape.len() as f64 - 2.0) as usize;
    let fraction = place - 0.5 - low as f64;
    shape[low] + fraction * (shape[low + 1] - shape[low])
}

/// Displacement of the body that the mean residual cycle adds to a model's, at every sample, m: the gain per cycle, and the periodic
/// part.
pub(super) fn mean_displacement_m(observed: &Observed<'_>, residuals: &CellResiduals) -> Vec<f64> {
    let cells = observed.cells();
    let cycles = settled_cycles(observed);
    let bins = bins(observed);
    let mut shapes = binned(observed, &cycles, residuals, bins);
    shapes.iter_mut().for_each(|shape| about_mean(shape, bins));
    let all_cycles: Vec<usize> = (0..cycles.len()).collect();
    let shape = predicted_shape(&shapes, &all_cycles, 0, false);
    let advance_m = advance_m(observed, residuals);
    let repeats_m: Vec<f64> = (0..bins)
        .map(|bin| {
            let of_cells = (0..cells)
                .map(|cell| shape[cell * bins + bin])
                .filter(|m| m.is_finite());
            let (sum_m, count) = of_cells.fold((0.0, 0.0), |(sum, count), m| (sum + m, count + 1.0));
            sum_m / count - advance_m * (bin as f64 + 0.5) / bins as f64
        })
        .collect();
    let since_first = observed.phase.iter().map(|phase| phase - observed.phase[0]);
    since_first
        .map(|cycles| {
            let repeated_m = between(&repeats_m, cycles.rem_euclid(1.0) * bins as f64);
            advance_m * cycles + if repeated_m.is_finite() { repeated_m } else { 0.0 }
        })
        .collect()
}
