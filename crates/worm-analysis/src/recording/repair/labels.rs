//! Labels that trackers exchange.
//!
//! Cells cannot pass one another: sorted along the canal, the markers are the cells in their order. A sample that shows every cell is
//! labelled by sorting; where markers are missing, those seen are aligned with the places where the cells were last, keeping the order, at
//! the least total distance. A cell moves by a small part of a millimetre in a sample and cells are centimetres apart, so the alignment
//! is not in doubt; where that is not so (cells with origins of their own, samples too far apart), no label is touched.

use super::usual_noise;
use crate::recording::repair_note::{Repair, RepairKind};
use crate::recording::series::Recording;
use crate::recording::statistics::{quantile, quantiles};
use worm_log::ReadError;

/// Fewest samples with every cell in sight from which distances between cells are taken.
const MIN_WHOLE: usize = 10;
/// In the narrow twentieth of the samples a distance between neighbours is at least this fraction of its median.
const MIN_NARROW: f64 = 0.4;
/// Smallest distance between neighbours, in standard deviations of the noise.
const MIN_NOISES: f64 = 20.0;
/// Largest motion from sample to sample, as a fraction of the smallest distance between neighbours.
const MAX_MOTION: f64 = 0.1;
/// How far from its last place a marker may be found, as a fraction of the smallest distance between neighbours.
const REACH: f64 = 0.4;
/// How far a distance between neighbours may be from its median in a sample that is labelled by sorting alone, as a fraction of it.
const USUAL: f64 = 0.5;
/// Largest fraction of the samples in which a position may belong to no cell.
const MAX_STRAY: f64 = 0.01;

/// Gives each position to the cell that it is of.
///
/// # Errors
/// [`ReadError`] where it cannot be told which markers are which.
pub(super) fn undo_swaps(recording: &mut Recording) -> Result<Vec<Repair>, ReadError> {
    let Some(order) = Order::of(&recording.position_m) else {
        return Ok(Vec::new());
    };
    let Some(owners) = order.follow(&recording.position_m) else {
        return Ok(Vec::new());
    };
    if owners
        .iter()
        .enumerate()
        .all(|(cell, owners)| owners.iter().all(|owner| *owner == Owner::Cell(cell)))
    {
        return Ok(Vec::new());
    }
    let mut repairs = stray(recording, &owners)?;
    repairs.extend(relabel(recording, &owners));
    Ok(repairs)
}

/// Whose a labelled position is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Owner {
    Cell(usize),
    Nobody,
}

/// The cells along the canal.
#[derive(Debug)]
struct Order {
    /// The cell in each place, from the highest down.
    cell_at: Vec<usize>,
    /// Usual distance from each place to the next, m.
    apart_m: Vec<f64>,
    reach_m: f64,
    /// A sample that shows every cell in its usual place.
    start: usize,
}

impl Order {
    /// None where labels cannot be checked.
    fn of(position_m: &[Vec<f64>]) -> Option<Self> {
        let cells = position_m.len();
        let samples = position_m[0].len();
        let mut whole: Vec<(usize, Vec<usize>)> = Vec::new(); // sample, and the cells as labelled from the highest down
        for sample in 0..samples {
            if position_m.iter().all(|series| series[sample].is_finite()) {
                let mut sorted: Vec<usize> = (0..cells).collect();
                sorted.sort_by(|&a, &b| position_m[b][sample].total_cmp(&position_m[a][sample]));
                whole.push((sample, sorted));
            }
        }
        if whole.len() < MIN_WHOLE {
            return None;
        }
        let apart = |place: usize, (sample, sorted): &(usize, Vec<usize>)| {
            position_m[sorted[place]][*sample] - position_m[sorted[place + 1]][*sample]
        };
        let mut apart_m = Vec::with_capacity(cells - 1);
        for place in 0..cells - 1 {
            let [narrow_m, usual_m] = quantiles(whole.iter().map(|sample| apart(place, sample)), [0.05, 0.5])?;
            if narrow_m < MIN_NARROW * usual_m {
                return None;
            }
            apart_m.push(usual_m);
        }
        let closest_m = apart_m.iter().copied().fold(f64::INFINITY, f64::min);
        let motion_m = position_m
            .iter()
            .filter_map(|series| quantile(series.windows(2).map(|pair| (pair[1] - pair[0]).abs()), 0.98))
            .fold(0.0, f64::max);
        if closest_m <= MIN_NOISES * usual_noise(position_m) || motion_m >= MAX_MOTION * closest_m {
            return None;
        }
        let mut order = Self {
            cell_at: order_of_labels(&whole, cells),
            apart_m,
            reach_m: REACH * closest_m,
            start: 0,
        };
        let is_usual =
            |sample: &&(usize, Vec<usize>)| (0..cells - 1).all(|place| order.is_usual(place, apart(place, sample)));
        order.start = whole.iter().find(is_usual)?.0;
        Some(order)
    }

    fn is_usual(&self, place: usize, apart_m: f64) -> bool {
        (apart_m - self.apart_m[place]).abs() <= USUAL * self.apart_m[place]
    }

    /// Follows the cells from a usual sample to both ends: `[label][sample]`. A label that is not seen keeps its own cell.
    fn follow(&self, position_m: &[Vec<f64>]) -> Option<Vec<Vec<Owner>>> {
        let cells = position_m.len();
        let samples = position_m[0].len();
        let mut owners: Vec<Vec<Owner>> = (0..cells).map(|cell| vec![Owner::Cell(cell); samples]).collect();
        let mut first_m = vec![f64::NAN; cells];
        let at_start = self.by_sorting(&self.seen(position_m, self.start))?;
        for (label, cell) in at_start {
            owners[label][self.start] = Owner::Cell(cell);
            first_m[cell] = position_m[label][self.start];
        }
        let mut last_m = first_m.clone();
        for sample in self.start + 1..samples {
            self.assign(position_m, sample, &mut last_m, &mut owners);
        }
        let mut last_m = first_m;
        for sample in (0..self.start).rev() {
            self.assign(position_m, sample, &mut last_m, &mut owners);
        }
        Some(owners)
    }

    /// Labels and positions seen in a sample, from the highest down.
    fn seen(&self, position_m: &[Vec<f64>], sample: usize) -> Vec<(usize, f64)> {
        let mut seen: Vec<(usize, f64)> = position_m
            .iter()
            .enumerate()
            .map(|(label, series)| (label, series[sample]))
            .filter(|(_, at_m)| at_m.is_finite())
            .collect();
        seen.sort_by(|a, b| b.1.total_cmp(&a.1));
        seen
    }

    /// Label and cell of each position, where every cell is seen at its usual distance from the next.
    fn by_sorting(&self, seen: &[(usize, f64)]) -> Option<Vec<(usize, usize)>> {
        let is_whole = seen.len() == self.cell_at.len()
            && seen
                .windows(2)
                .enumerate()
                .all(|(place, pair)| self.is_usual(place, pair[0].1 - pair[1].1));
        is_whole.then(|| {
            seen.iter()
                .zip(&self.cell_at)
                .map(|(&(label, _), &cell)| (label, cell))
                .collect()
        })
    }

    /// Decides whose the positions of a sample are, and moves the last known places on.
    fn assign(&self, position_m: &[Vec<f64>], sample: usize, last_m: &mut [f64], owners: &mut [Vec<Owner>]) {
        let is_near = |cell: usize, at_m: f64| (at_m - last_m[cell]).abs() < self.reach_m;
        let seen = self.seen(position_m, sample);
        let mut found: Vec<(usize, usize)> = if seen.iter().all(|&(label, at_m)| is_near(label, at_m)) {
            seen.iter().map(|&(label, _)| (label, label)).collect()
        } else {
            self.by_sorting(&seen).unwrap_or_else(|| self.align(&seen, last_m))
        };
        // What is far from all places keeps its label where no other position claims the cell: the marker jumped.
        for &(label, _) in &seen {
            if found.iter().all(|&(other, _)| other != label) {
                if found.iter().all(|&(_, cell)| cell != label) {
                    found.push((label, label));
                } else {
                    owners[label][sample] = Owner::Nobody;
                }
            }
        }
        let mut moved_m = Vec::with_capacity(found.len());
        for &(label, cell) in &found {
            owners[label][sample] = Owner::Cell(cell);
            moved_m.push(position_m[label][sample] - last_m[cell]);
        }
        // Cells that are not seen move with the others.
        let body_m = quantile(moved_m.iter().copied(), 0.5).unwrap_or(0.0);
        for last_m in last_m.iter_mut() {
            *last_m += body_m;
        }
        for &(label, cell) in &found {
            if (position_m[label][sample] - last_m[cell]).abs() < self.reach_m {
                last_m[cell] = position_m[label][sample];
            }
        }
    }

    /// Aligns positions with the last places of the cells, both from the highest down, keeping the order: least total distance, where a
    /// position left over costs the reach, and a cell that is not seen nothing.
    fn align(&self, seen: &[(usize, f64)], last_m: &[f64]) -> Vec<(usize, usize)> {
        let cells = self.cell_at.len();
        let distance_m = |row: usize, place: usize| (seen[row].1 - last_m[self.cell_at[place]]).abs();
        // best[row][place]: cost of the first `row` positions on the first `place` places.
        let mut best = vec![vec![0.0; cells + 1]; seen.len() + 1];
        for row in 1..=seen.len() {
            best[row][0] = best[row - 1][0] + self.reach_m;
            for place in 1..=cells {
                let aligned_m = distance_m(row - 1, place - 1);
                let aligned_m = if aligned_m < self.reach_m {
                    aligned_m
                } else {
                    f64::INFINITY
                };
                best[row][place] = (best[row - 1][place] + self.reach_m)
                    .min(best[row][place - 1])
                    .min(best[row - 1][place - 1] + aligned_m);
            }
        }
        let mut found = Vec::with_capacity(seen.len());
        let (mut row, mut place) = (seen.len(), cells);
        while row > 0 && place > 0 {
            if best[row][place] == best[row][place - 1] {
                place -= 1;
            } else if best[row][place] == best[row - 1][place] + self.reach_m {
                row -= 1;
            } else {
                (row, place) = (row - 1, place - 1);
                found.push((seen[row].0, self.cell_at[place]));
            }
        }
        found
    }
}

/// Which cell is in which place. Labels that never change their order are right, whatever it is; else cell 1 is in front, or behind where
/// most labels say so.
fn order_of_labels(whole: &[(usize, Vec<usize>)], cells: usize) -> Vec<usize> {
    let (_, first) = &whole[0];
    if whole.iter().all(|(_, sorted)| sorted == first) {
        return first.clone();
    }
    let descending: Vec<usize> = (0..cells).collect();
    let ascending: Vec<usize> = (0..cells).rev().collect();
    let places = |order: &[usize]| -> usize {
        whole
            .iter()
            .map(|(_, sorted)| sorted.iter().zip(order).filter(|(a, b)| a == b).count())
            .sum()
    };
    if places(&ascending) > places(&descending) {
        ascending
    } else {
        descending
    }
}

/// Leaves out positions that belong to no cell.
fn stray(recording: &mut Recording, owners: &[Vec<Owner>]) -> Result<Vec<Repair>, ReadError> {
    let mut repairs = Vec::new();
    for (label, owners) in owners.iter().enumerate() {
        let stray: Vec<usize> = (0..owners.len())
            .filter(|&sample| owners[sample] == Owner::Nobody)
            .collect();
        let (Some(&first), Some(&last)) = (stray.first(), stray.last()) else {
            continue;
        };
        let (from_s, to_s) = (recording.time_s[first], recording.time_s[last]);
        if stray.len() as f64 > MAX_STRAY * owners.len() as f64 {
            return Err(ReadError::whole(
                &recording.source,
                format!(
                    "it cannot be told which cell the positions labelled as {} are of, in {} samples between {from_s:.3} s and {to_s:.3} s",
                    recording.name_of(label),
                    stray.len()
                ),
                "label the markers again in the tracker's software, or leave that part out with --from or --to",
            ));
        }
        repairs.push(Repair::new(
            RepairKind::StrayPosition,
            Some(label),
            (from_s, to_s),
            stray.len(),
        ));
    }
    Ok(repairs)
}

/// Moves positions to their cells, and leaves out the first and the last of each swap, at which a tracker may mix two markers.
fn relabel(recording: &mut Recording, owners: &[Vec<Owner>]) -> Vec<Repair> {
    let labelled_m = recording.position_m.clone();
    let (cells, samples) = (labelled_m.len(), recording.samples());
    // The label under which each cell was seen, `[cell][sample]`.
    let mut label_of = vec![vec![None; samples]; cells];
    for (label, owners) in owners.iter().enumerate() {
        for (sample, owner) in owners.iter().enumerate() {
            if let Owner::Cell(cell) = *owner
                && labelled_m[label][sample].is_finite()
            {
                label_of[cell][sample] = Some(label);
            }
        }
    }
    let mut repairs = Vec::new();
    for (cell, labels) in label_of.iter().enumerate() {
        let series = &mut recording.position_m[cell];
        for (sample, label) in labels.iter().enumerate() {
            series[sample] = label.map_or(f64::NAN, |label: usize| labelled_m[label][sample]);
        }
    }
    for (cell, labels) in label_of.iter().enumerate() {
        let seen: Vec<usize> = (0..samples).filter(|&sample| labels[sample].is_some()).collect();
        let swapped = |at: &usize| labels[*at] != Some(cell);
        for run in seen
            .chunk_by(|a, b| swapped(a) == swapped(b))
            .filter(|run| swapped(&run[0]))
        {
            let (first, last) = (run[0], run[run.len() - 1]);
            let is_first = Some(&first) == seen.first();
            let is_last = Some(&last) == seen.last();
            if !is_first {
                recording.position_m[cell][first] = f64::NAN;
            }
            if !is_last {
                recording.position_m[cell][last] = f64::NAN;
            }
            let from_s = recording.time_s[if is_first { 0 } else { first }];
            let to_s = recording.time_s[if is_last { samples - 1 } else { last }];
            repairs.push(Repair::new(
                RepairKind::SwappedLabel,
                Some(cell),
                (from_s, to_s),
                run.len(),
            ));
        }
    }
    repairs
}

#[cfg(test)]
mod tests;
