//! Markers that jump alone.
//!
//! A slip shifts all cells at once, because the cam holds them together; a jump of one cell against the others is the marker's. The straight
//! line through a few samples before is compared with that through a few after, less the median over the cells of the same.

use super::usual_noise;
use crate::recording::repair_note::{Repair, RepairKind};
use crate::recording::series::Recording;
use crate::recording::statistics::quantile;
use std::ops::Range;

/// Samples of each line.
const LINE: usize = 5;
/// Variance of what a line says half a sample beyond its end, in variances of the noise: 1/5 + (5/2)²/10.
const BEYOND: f64 = 0.825;
/// A jump exceeds this many standard deviations of the noise of the comparison.
const JUMP: f64 = 8.0;
/// It also exceeds so many times what the fastest step moves from sample to sample: a corner of the cam looks like half as much.
const STEPS: f64 = 5.0;
/// Fraction of the samples in which a cell is slower than in its fastest step.
const SLOWER: f64 = 0.95;
/// Smallest jump, m: what plays and compliant drives do to a single cell is less.
const MIN_JUMP_M: f64 = 5e-4;
/// Longest time after which a marker that comes back has jumped, s; one that stays away longer has moved.
const MAX_AWAY_S: f64 = 1.0;
/// How near a marker comes to where it was, as a fraction of its jump, to have come back.
const BACK: f64 = 0.5;
/// Fewest cells with which it can be told which one jumped.
const MIN_CELLS: usize = 3;

/// A marker away from its place.
#[derive(Debug)]
pub(super) struct Jump {
    pub repair: Repair,
    cell: usize,
    away: Range<usize>,
}

/// Finds the jumps of single markers.
pub(super) fn find(recording: &Recording) -> Vec<Jump> {
    if recording.cells() < MIN_CELLS {
        return Vec::new();
    }
    let noise_m = usual_noise(&recording.position_m);
    let filled_m = recording.filled();
    (0..recording.cells())
        .flat_map(|cell| find_of_cell(recording, &filled_m, cell, noise_m))
        .collect()
}

/// Leaves out the positions of markers that came back.
pub(super) fn leave_out(recording: &mut Recording, jumps: &[Jump]) {
    for jump in jumps.iter().filter(|jump| jump.repair.what == RepairKind::MarkerJump) {
        recording.position_m[jump.cell][jump.away.clone()].fill(f64::NAN);
    }
}

fn find_of_cell(recording: &Recording, filled_m: &[Vec<f64>], cell: usize, noise_m: f64) -> Vec<Jump> {
    let time_s = &recording.time_s;
    let seen: Vec<usize> = (0..recording.samples())
        .filter(|&sample| recording.position_m[cell][sample].is_finite())
        .collect();
    let times_s: Vec<f64> = seen.iter().map(|&sample| time_s[sample]).collect();
    let jump_of = |cell: usize, at: usize| jump_before(&times_s, at, |at| filled_m[cell][seen[at]]);
    let own_m: Vec<f64> = (0..seen.len()).map(|at| jump_of(cell, at)).collect();
    let moved_m = (LINE..seen.len()).map(|at| (filled_m[cell][seen[at]] - filled_m[cell][seen[at - LINE]]).abs());
    let step_m = quantile(moved_m, SLOWER).unwrap_or(0.0) / LINE as f64;
    let sigma_m = noise_m * (2.0 * BEYOND).sqrt();
    let limit_m = (JUMP * sigma_m).max(STEPS * step_m).max(MIN_JUMP_M);
    let steps_s = time_s.windows(2).map(|pair| pair[1] - pair[0]);
    let period_s = quantile(steps_s, 0.5).unwrap_or(0.0);
    let against_others_m = |(at, own_m): (usize, &f64)| {
        if own_m.abs() <= limit_m {
            return 0.0;
        }
        let all_m = (0..filled_m.len()).map(|cell| jump_of(cell, at));
        let jump_m = own_m - quantile(all_m, 0.5).unwrap_or(0.0);
        // Where samples are missing the lines are continued so much further, and err so much more.
        let missing = (times_s[at + LINE - 1] - times_s[at - LINE]) / period_s - (2 * LINE - 1) as f64;
        let further = 1.0 + missing.max(0.0) / LINE as f64;
        if jump_m.abs() > limit_m * further { jump_m } else { 0.0 }
    };
    let jump_m: Vec<f64> = own_m.iter().enumerate().map(against_others_m).collect();
    let peaks = peaks(&jump_m, limit_m);
    let mut jumps = Vec::new();
    let mut number = 0;
    while let Some(&at) = peaks.get(number) {
        number += 1;
        let back = peaks[number..]
            .iter()
            .take_while(|&&later| times_s[later] - times_s[at] <= MAX_AWAY_S)
            .position(|&later| (jump_m[at] + jump_m[later]).abs() < BACK * jump_m[at].abs());
        if let Some(back) = back {
            let later = peaks[number + back];
            number += back + 1;
            let (first, last) = (seen[at], seen[later - 1]);
            jumps.push(Jump {
                repair: Repair::new(
                    RepairKind::MarkerJump,
                    Some(cell),
                    (time_s[first], time_s[last]),
                    later - at,
                ),
                cell,
                away: first..last + 1,
            });
        } else {
            let (first, samples) = (seen[at], recording.samples());
            let when_s = (time_s[first], time_s[samples - 1]);
            let repair = Repair::new(RepairKind::MarkerMoved, Some(cell), when_s, seen.len() - at);
            jumps.push(Jump {
                repair: repair.with_shift(jump_m[at], sigma_m),
                cell,
                away: first..samples,
            });
        }
    }
    jumps
}

/// How far the line through the samples from `at` on lies above that through the samples before, midway between them, m; 0 where there
/// are too few.
fn jump_before(times_s: &[f64], at: usize, value_m: impl Fn(usize) -> f64) -> f64 {
    if at < LINE || at + LINE > times_s.len() {
        return 0.0;
    }
    let middle_s = 0.5 * (times_s[at - 1] + times_s[at]);
    let line_m = |samples: Range<usize>| {
        let count = LINE as f64;
        let mean_s = times_s[samples.clone()].iter().sum::<f64>() / count;
        let mean_m = samples.clone().map(&value_m).sum::<f64>() / count;
        let (mut covariance, mut variance) = (0.0, 0.0);
        for sample in samples {
            covariance += (times_s[sample] - mean_s) * (value_m(sample) - mean_m);
            variance += (times_s[sample] - mean_s).powi(2);
        }
        mean_m + covariance / variance * (middle_s - mean_s)
    };
    let jump_m = line_m(at..at + LINE) - line_m(at - LINE..at);
    if jump_m.is_finite() { jump_m } else { 0.0 }
}

/// Where the size is beyond the limit and largest among its neighbours. A jump looks like a third of one the other way round a few samples
/// beside it.
fn peaks(jump_m: &[f64], limit_m: f64) -> Vec<usize> {
    let is_largest = |at: &usize| {
        let size_m = jump_m[*at].abs();
        (at.saturating_sub(LINE)..(at + LINE + 1).min(jump_m.len())).all(|other| {
            let other_m = jump_m[other] * jump_m[*at].signum();
            (other == *at || other_m < size_m) && other_m > -2.0 * size_m
        })
    };
    (0..jump_m.len())
        .filter(|&at| jump_m[at].abs() > limit_m)
        .filter(is_largest)
        .collect()
}

#[cfg(test)]
mod tests;
