//! The paper's exhaustive search for the largest tip deformations (section 3.2.3), faithfully: every combination of seven
//! candidates for each cell, 0.1 mm apart around the first estimate, on the samples as they are.
//!
//! For each candidate the contact points follow by (1) to (3) and the deformation by (4), cell by cell. The total force
//! F = Σ kᵢ δᵢ + m g sin λ must have the time mean 0 (5 to 7) and the smallest variance; the paper does not say how it weighs the two.
//! Here the mean square of F is minimised, which is the square of its mean plus its variance.
//!
//! # Cost
//! A cell's deformation depends on its own candidate alone, so 7 n series are computed, not 7ⁿ, and the mean square of a sum of
//! series follows from their means and products: a combination costs a few additions.

use super::gait::IdentifiedGait;

/// Candidates on either side of the first estimate, and how far they are apart, m.
const SPREAD: (usize, f64) = (3, 1e-4);
/// Candidates for each cell.
const CANDIDATES: usize = 2 * SPREAD.0 + 1;
/// Most cells for which all combinations are tried: 7⁷ are 823,543.
pub const MAX_CELLS: usize = 7;
/// Smallest candidate, m.
const SMALLEST_M: f64 = 5e-5;

/// The best combination.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Largest tip deformations, m.
    pub max_deformation_m: Vec<f64>,
    /// How many combinations were tried.
    pub candidates: usize,
    /// Time mean of the total force, N: the violation of (7).
    pub mean_force_n: f64,
    /// Standard deviation of the total force, N.
    pub force_std_n: f64,
}

/// Searches around `first_m`. `position_m` has no gaps inside; `stiffness_n_per_m` is one for each cell, `pull_n` is m g sin λ.
/// None for more cells than [`MAX_CELLS`], or when no whole cycle is left after the first.
pub fn search(
    position_m: &[Vec<f64>],
    gait: &IdentifiedGait,
    first_m: &[f64],
    stiffness_n_per_m: &[f64],
    pull_n: f64,
) -> Option<Found> {
    let cells = position_m.len();
    let range = balance_range(position_m, &gait.phase)?;
    if cells > MAX_CELLS {
        return None;
    }
    let ends = step_ends(gait);
    let candidates_m: Vec<Vec<f64>> = first_m.iter().map(|&first| candidates(first)).collect();
    let mut force_n = Vec::with_capacity(cells * CANDIDATES);
    for cell in 0..cells {
        for &bound_m in &candidates_m[cell] {
            let mut series_n = deformations(&position_m[cell], &ends[cell], bound_m);
            series_n.drain(range.end..);
            series_n.drain(..range.start);
            for value in &mut series_n {
                *value *= stiffness_n_per_m[cell];
            }
            force_n.push(series_n);
        }
    }
    let samples = range.len() as f64;
    let mean_n: Vec<f64> = force_n
        .iter()
        .map(|series| series.iter().sum::<f64>() / samples)
        .collect();
    let product = |a: usize, b: usize| dot(&force_n[a], &force_n[b]) / samples;
    let mut products = vec![0.0; force_n.len() * force_n.len()];
    for a in 0..force_n.len() {
        for b in a..force_n.len() {
            // Two candidates of one cell never stand in one combination, but a candidate with itself does.
            if a == b || a / CANDIDATES != b / CANDIDATES {
                products[a * force_n.len() + b] = product(a, b);
            }
        }
    }
    let table = Table {
        cells,
        mean_n,
        products,
        pull_n,
    };
    let mut best = (f64::INFINITY, 0.0, vec![0; cells]);
    let mut choice = vec![0; cells];
    table.try_all(0, pull_n, pull_n * pull_n, &mut choice, &mut best);
    let (square, mean, choice) = best;
    Some(Found {
        max_deformation_m: choice.iter().zip(&candidates_m).map(|(&at, list)| list[at]).collect(),
        candidates: CANDIDATES.pow(cells as u32),
        mean_force_n: mean,
        force_std_n: (square - mean * mean).max(0.0).sqrt(),
    })
}

/// Means and mean products of all candidates' force series.
struct Table {
    cells: usize,
    mean_n: Vec<f64>,
    products: Vec<f64>,
    pull_n: f64,
}

impl Table {
    /// Tries all candidates of the cells from `cell` on; `mean` and `square` are of the force chosen so far.
    fn try_all(&self, cell: usize, mean: f64, square: f64, choice: &mut Vec<usize>, best: &mut (f64, f64, Vec<usize>)) {
        if cell == self.cells {
            if square < best.0 {
                *best = (square, mean, choice.clone());
            }
            return;
        }
        let width = self.cells * CANDIDATES;
        for at in 0..CANDIDATES {
            let new = cell * CANDIDATES + at;
            let mut cross = self.pull_n * self.mean_n[new];
            for (other, &chosen) in choice[..cell].iter().enumerate() {
                cross += self.products[(other * CANDIDATES + chosen) * width + new];
            }
            choice[cell] = at;
            self.try_all(
                cell + 1,
                mean + self.mean_n[new],
                square + 2.0 * cross + self.products[new * width + new],
                choice,
                best,
            );
        }
    }
}

/// Sum of products, in eight strands so that it does not wait for one addition after the other.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut strands = [0.0; 8];
    let (whole_a, whole_b) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = whole_a
        .remainder()
        .iter()
        .zip(whole_b.remainder())
        .map(|(a, b)| a * b)
        .sum();
    for (a, b) in whole_a.zip(whole_b) {
        for (strand, (a, b)) in strands.iter_mut().zip(a.iter().zip(b)) {
            *strand += a * b;
        }
    }
    strands.iter().sum::<f64>() + rest
}

fn candidates(first_m: f64) -> Vec<f64> {
    (0..CANDIDATES)
        .map(|at| (first_m + (at as f64 - SPREAD.0 as f64) * SPREAD.1).max(SMALLEST_M))
        .collect()
}

/// The samples of the whole cycles after the first, in which every tip has been found by (1).
fn balance_range(position_m: &[Vec<f64>], phase: &[f64]) -> Option<std::ops::Range<usize>> {
    let whole = |sample: usize| position_m.iter().all(|series| series[sample].is_finite());
    let first = (0..phase.len()).find(|&sample| whole(sample))?;
    let last = (0..phase.len()).rev().find(|&sample| whole(sample))?;
    let begin = phase[first] + 1.0;
    let cycles = (phase[last] - begin).floor();
    if cycles < 1.0 {
        return None;
    }
    let at = |target: f64| phase.partition_point(|&phase| phase < target);
    Some(at(begin)..at(begin + cycles))
}

/// For each cell the samples at which its steps end.
fn step_ends(gait: &IdentifiedGait) -> Vec<Vec<usize>> {
    let cells = gait.step_order.len();
    let mut ends = vec![Vec::new(); cells];
    for sample in 1..gait.phase.len() {
        let (before, after) = (gait.phase[sample - 1] * cells as f64, gait.phase[sample] * cells as f64);
        let slot = before.floor();
        if after.floor() > slot {
            ends[gait.step_order[slot.rem_euclid(cells as f64) as usize]].push(sample);
        }
    }
    ends
}

/// Deformation of one tip by (1) to (4) for an assumed bound, m; 0 until the end of its first step.
fn deformations(position_m: &[f64], ends: &[usize], bound_m: f64) -> Vec<f64> {
    let mut contact_m = f64::NAN;
    let mut next_end = ends.iter().peekable();
    let mut series = Vec::with_capacity(position_m.len());
    for (sample, &at_m) in position_m.iter().enumerate() {
        if next_end.next_if(|&&end| end == sample).is_some() {
            contact_m = at_m - bound_m; // (1)
        }
        let deformation_m = at_m - contact_m;
        series.push(if deformation_m.is_nan() {
            0.0
        } else if deformation_m > bound_m {
            contact_m = at_m - bound_m; // (3), forward
            bound_m
        } else if deformation_m < -bound_m {
            contact_m = at_m + bound_m; // (3), backward
            -bound_m
        } else {
            deformation_m // (2)
        });
    }
    series
}

#[cfg(test)]
mod tests;
