//! Where model and data disagree: the residual by cell and phase, with its significance.
//!
//! # The map
//! A step is divided into bins. Within a cycle, the residual displacement of a cell in a bin is the difference of its mean residual there
//! and in the bin before. So neither an offset nor an earlier error of the body counts, and what starts in a bin shows there. The map
//! holds the mean over the settled cycles, in metres and in standard errors. Where the phase was not recorded, the motion of the
//! stepping cell relative to the others went into the phase; the map shows the body's displacement for it.
//!
//! # Beyond chance
//! A bootstrap draws cycles in blocks, all cells and bins of a cycle together, which keeps their correlation. It gives the standard error
//! of each mean, and how large the largest on the whole map becomes by chance. A variance estimated from few cycles is itself
//! uncertain; so the variance of each bin is shrunk towards that of the whole map, and the limit is that of Student's distribution.

use super::answer::{Place, ResidualMap};
use crate::explain::search::fit::Fit;
use crate::explain::worm::observed::Observed;
use crate::explain::worm::recorded_worm::RecordedWorm;
use crate::explain::worm::residual::Residual;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Bins of a step.
const BINS_PER_STEP: usize = 6;
/// Fewest cycles that must show a bin.
const MIN_CYCLES: usize = 3;
/// Consecutive cycles that are drawn together.
const BLOCK: usize = 2;
/// Bootstrap resamples.
const RESAMPLES: usize = 400;
/// Seed of the draws.
const SEED: u64 = 0x6d61_7073;
/// Fraction of campaigns without disagreement that may show one.
const FALSE_ALARMS: f64 = 0.05;
/// Degrees of freedom for which the variance of the whole map counts beside a bin's own.
const SHARED_FREEDOM: f64 = 6.0;
/// Fraction of the limit from which the median of the cells is a residual of the body.
const OF_BODY: f64 = 0.5;
/// Phase, in bins, by which a recording may begin after the first bin or end before the last.
const SLACK: f64 = 0.1;

/// The map of one run under a fit; `NaN` all over where the fit cannot make the run, or nobody saw the cells.
pub(super) fn map(worm: &RecordedWorm<'_>, run: usize, fit: &Fit) -> ResidualMap {
    let observed = &worm.scene.observed[run];
    let cells = observed.cells();
    let bins = cells * BINS_PER_STEP;
    let mut map = ResidualMap {
        slope_deg: observed.run.slope_deg,
        stepping_cell: (0..bins)
            .map(|bin| observed.step_order[bin / BINS_PER_STEP] + 1)
            .collect(),
        phase: (0..bins).map(|bin| (bin as f64 + 0.5) / bins as f64).collect(),
        residual_m: vec![vec![f64::NAN; bins]; cells],
        significance: vec![vec![f64::NAN; bins]; cells],
        limit: f64::INFINITY,
    };
    let predicted = worm.scene.predict(run, &fit.hypothesis, &fit.at);
    let Some(predicted) = predicted.filter(|_| observed.sees_positions) else {
        return map;
    };
    let displacements = BinDisplacements::new(observed, &Residual::new(observed, &predicted));
    let mean_m = displacements.mean_m(&vec![1; displacements.cycles.len()]);
    let counts = displacements.cycle_counts();
    let draws = displacements.draws(&mean_m, SEED.wrapping_add(run as u64));
    let sigma_m = standard_errors(&draws, &counts);
    for (entry, (&mean_m, &sigma_m)) in mean_m.iter().zip(&sigma_m).enumerate() {
        let (cell, bin) = (entry / bins, entry % bins);
        map.residual_m[cell][bin] = mean_m;
        map.significance[cell][bin] = mean_m / sigma_m;
    }
    let freedom = own_freedom(displacements.cycles.len() as f64) + SHARED_FREEDOM;
    map.limit = limit(&draws, &sigma_m, freedom, worm.scene.observed.len());
    map
}

/// Residual displacement of every cell in every bin, cycle by cycle.
struct BinDisplacements {
    /// `[cycle][cell × bins + bin]`, m; `NaN` where not seen.
    cycles: Vec<Vec<f64>>,
}

impl BinDisplacements {
    fn new(observed: &Observed<'_>, residual: &Residual) -> Self {
        let cells = observed.cells();
        let per_cycle = cells * BINS_PER_STEP;
        let bin_at = |sample: usize| observed.phase[sample] * per_cycle as f64;
        let last = observed.samples() - 1;
        let from = observed.settled_from().min(last);
        let first_bin = (bin_at(from) - SLACK).ceil() as i64;
        let bins = ((bin_at(last) + SLACK).floor() as i64 - first_bin).max(0) as usize;
        let mut sum_m = vec![vec![0.0; cells]; bins];
        let mut seen = vec![vec![0.0; cells]; bins];
        for sample in from..=last {
            let bin = bin_at(sample).floor() as i64 - first_bin;
            let Some(bin) = usize::try_from(bin).ok().filter(|&bin| bin < bins) else {
                continue;
            };
            for cell in 0..cells {
                let own_m = residual.body_m[sample] + residual.relative_m[sample * cells + cell];
                if own_m.is_finite() {
                    sum_m[bin][cell] += own_m;
                    seen[bin][cell] += 1.0;
                }
            }
        }
        let cycle_count = bins.div_ceil(per_cycle);
        let mut cycles = vec![vec![f64::NAN; cells * per_cycle]; cycle_count];
        let stepping = |bin: usize| {
            let place = (first_bin + bin as i64).rem_euclid(per_cycle as i64) as usize;
            (place, observed.step_order[place / BINS_PER_STEP])
        };
        for bin in 1..bins {
            let at_m = |bin: usize, cell: usize| sum_m[bin][cell] / seen[bin][cell]; // NaN where not seen
            let displacement_m: Vec<f64> = (0..cells).map(|cell| at_m(bin, cell) - at_m(bin - 1, cell)).collect();
            let known: Vec<f64> = displacement_m
                .iter()
                .copied()
                .filter(|displacement_m| displacement_m.is_finite())
                .collect();
            let body_m = known.iter().sum::<f64>() / known.len() as f64;
            let ((place, steps), (_, stepped)) = (stepping(bin), stepping(bin - 1));
            for (cell, displacement_m) in displacement_m.into_iter().enumerate() {
                let is_known = observed.phase_recorded || (cell != steps && cell != stepped);
                cycles[bin / per_cycle][cell * per_cycle + place] = if is_known { displacement_m } else { body_m };
            }
        }
        Self { cycles }
    }

    /// Mean over the cycles, each counted `times` times, m; `NaN` where none of them shows the entry.
    fn mean_m(&self, times: &[usize]) -> Vec<f64> {
        let entries = self.cycles.first().map_or(0, Vec::len);
        let (mut sum_m, mut count) = (vec![0.0; entries], vec![0.0; entries]);
        for (cycle, &times) in self.cycles.iter().zip(times).filter(|(_, times)| **times > 0) {
            let times = times as f64;
            for ((displacement_m, sum_m), count) in cycle.iter().zip(&mut sum_m).zip(&mut count) {
                if displacement_m.is_finite() {
                    *sum_m += times * displacement_m;
                    *count += times;
                }
            }
        }
        sum_m.iter().zip(&count).map(|(sum_m, count)| sum_m / count).collect()
    }

    /// How many cycles show each entry.
    fn cycle_counts(&self) -> Vec<usize> {
        let entries = self.cycles.first().map_or(0, Vec::len);
        let is_known = |entry: usize| self.cycles.iter().filter(move |cycle| cycle[entry].is_finite());
        (0..entries).map(|entry| is_known(entry).count()).collect()
    }

    /// Deviations of the means from `mean_m` when the cycles are resampled in blocks, the last followed by the first, m:
    /// `[draw][entry]`.
    fn draws(&self, mean_m: &[f64], seed: u64) -> Vec<Vec<f64>> {
        let cycles = self.cycles.len();
        if cycles < MIN_CYCLES {
            return Vec::new();
        }
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut draw = || {
            let mut times = vec![0; cycles];
            for drawn in 0..cycles {
                if drawn % BLOCK == 0 {
                    let from = rng.random_range(0..cycles);
                    for cycle in 0..BLOCK.min(cycles - drawn) {
                        times[(from + cycle) % cycles] += 1;
                    }
                }
            }
            let drawn_m = self.mean_m(&times);
            drawn_m.iter().zip(mean_m).map(|(drawn_m, m)| drawn_m - m).collect()
        };
        (0..RESAMPLES).map(|_| draw()).collect()
    }
}

/// Degrees of freedom of a variance from blocks of cycles: two thirds of what single cycles would give.
fn own_freedom(cycles: f64) -> f64 {
    2.0 / 3.0 * (cycles - BLOCK as f64)
}

/// Standard error of each entry, m; `NaN` where too few cycles show it.
fn standard_errors(draws: &[Vec<f64>], counts: &[usize]) -> Vec<f64> {
    let own_m2: Vec<f64> = counts
        .iter()
        .enumerate()
        .map(|(entry, &counts)| {
            if counts < MIN_CYCLES {
                return f64::NAN;
            }
            let off_m = draws.iter().map(|draw| draw[entry]).filter(|off_m| off_m.is_finite());
            let (squares, count) = off_m.fold((0.0, 0.0), |(squares, count), off_m| {
                (squares + off_m * off_m, count + 1.0)
            });
            // Resampled blocks scatter about the mean of the sample and not about the true one.
            squares / count * counts as f64 / (counts - BLOCK) as f64
        })
        .collect();
    let mut sorted: Vec<f64> = own_m2.iter().copied().filter(|m2| m2.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let shared_m2 = sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN);
    own_m2
        .iter()
        .zip(counts)
        .map(|(own_m2, &counts)| {
            let freedom = own_freedom(counts as f64);
            ((freedom * own_m2 + SHARED_FREEDOM * shared_m2) / (freedom + SHARED_FREEDOM)).sqrt()
        })
        .collect()
}

/// The significance that the largest on `maps` together stays below by chance.
fn limit(draws: &[Vec<f64>], sigma_m: &[f64], freedom: f64, maps: usize) -> f64 {
    let largest = |draw: &Vec<f64>| {
        let off = draw.iter().zip(sigma_m).map(|(off_m, sigma_m)| (off_m / sigma_m).abs());
        off.filter(|off| off.is_finite()).fold(0.0, f64::max)
    };
    let mut largest: Vec<f64> = draws.iter().map(largest).collect();
    largest.sort_by(f64::total_cmp);
    let within = 1.0 - FALSE_ALARMS / maps as f64;
    let at = (within * largest.len() as f64).ceil() as usize;
    let Some(normal) = largest.get(at.saturating_sub(1)) else {
        return f64::INFINITY;
    };
    // The value of Student's distribution beyond which as much lies as beyond this one of the normal (Wallace 1959).
    let stretched = normal * (8.0 * freedom + 3.0) / (8.0 * freedom + 1.0);
    (freedom * ((stretched * stretched / freedom).exp() - 1.0)).sqrt()
}

/// The places beyond chance on all maps, most significant first, at most `max`.
///
/// Listed is what exceeds its map's limit: the significance that the largest on all maps together exceeds in one campaign of twenty
/// without disagreement. Where the cells agree, the body is off: it is listed once, for the cell that steps, with the values of the
/// most significant cell; cells that are off relative to the body are listed beside it. Neighbouring bins of one cell and one
/// stepping cell with the same sign are one place, with the values of the most significant bin.
pub(super) fn places(maps: &[ResidualMap], max: usize) -> Vec<Place> {
    let mut places: Vec<Place> = maps.iter().flat_map(places_of).collect();
    places.sort_by(|a, b| b.significance.abs().total_cmp(&a.significance.abs()));
    places.truncate(max);
    places
}

fn places_of(map: &ResidualMap) -> Vec<Place> {
    let cells = map.residual_m.len();
    let mut places: Vec<Place> = Vec::new();
    // Index of the place that each cell had in the bin before.
    let mut before: Vec<Option<usize>> = vec![None; cells];
    for (bin, (&stepping_cell, &phase)) in map.stepping_cell.iter().zip(&map.phase).enumerate() {
        let mut here: Vec<Option<usize>> = vec![None; cells];
        for (cell, residual_m, significance) in beyond_chance(map, bin, stepping_cell - 1) {
            let place = Place {
                cell: cell + 1,
                stepping_cell,
                phase,
                slope_deg: map.slope_deg,
                residual_m,
                significance,
            };
            let neighbour = before[cell].or(here[cell]).filter(|&number| {
                let other = &places[number];
                other.stepping_cell == stepping_cell && other.residual_m.signum() == residual_m.signum()
            });
            let number = neighbour.unwrap_or(places.len());
            match places.get_mut(number) {
                None => places.push(place),
                Some(known) if known.significance.abs() < significance.abs() => *known = place,
                Some(_) => {}
            }
            here[cell] = Some(number);
        }
        before = here;
    }
    places
}

/// Cell from 0, residual and significance of all that is beyond chance in a bin.
fn beyond_chance(map: &ResidualMap, bin: usize, stepping: usize) -> Vec<(usize, f64, f64)> {
    let cells = 0..map.residual_m.len();
    let entry = |cell: usize| (cell, map.residual_m[cell][bin], map.significance[cell][bin]);
    let known: Vec<(usize, f64, f64)> = cells
        .map(entry)
        .filter(|(_, residual_m, significance)| residual_m.is_finite() && significance.is_finite())
        .collect();
    let is_beyond = |entry: &(usize, f64, f64)| entry.2.abs() > map.limit;
    if !known.iter().any(is_beyond) {
        return Vec::new();
    }
    let body_m = median(known.iter().map(|entry| entry.1));
    let is_of_body = median(known.iter().map(|entry| entry.2)).abs() > OF_BODY * map.limit;
    let (alone, together): (Vec<_>, Vec<_>) =
        known
            .into_iter()
            .filter(is_beyond)
            .partition(|(_, residual_m, significance)| {
                let sigma_m = residual_m / significance;
                !is_of_body || (residual_m - body_m).abs() > map.limit * sigma_m
            });
    let best = together.into_iter().max_by(|a, b| a.2.abs().total_cmp(&b.2.abs()));
    let of_body = best.map(|(_, residual_m, significance)| (stepping, residual_m, significance));
    of_body.into_iter().chain(alone).collect()
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    // The same for both signs.
    0.5 * (sorted[sorted.len() / 2] + sorted[(sorted.len() - 1) / 2])
}

#[cfg(test)]
mod tests;
