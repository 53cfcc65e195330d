//! Markers that freeze: a tracker that has lost a marker may repeat its last place.
//!
//! A measured position never stands still, its noise moves it. Values that are equal several times in a row, or that vary by far less than
//! the noise, are no measurements. A file may be written in steps as coarse as the noise, so that equal values are chance; how many in a
//! row are too many follows from how often two are equal.

use super::usual_noise;
use crate::recording::repair_note::{Repair, RepairKind};
use crate::recording::series::Recording;
use std::ops::Range;

/// Fewest equal values in a row that are a fault.
const MIN_EQUAL: usize = 5;
/// Probability with which chance may make such a run anywhere in a recording.
const CHANCE: f64 = 1e-8;
/// Fraction of equal neighbours from which the steps of the file are too coarse to tell: 0.14 where they are half the noise.
const TOO_COARSE: f64 = 0.14;
/// How much more often neighbours are equal while a cell stands still than on average.
const STILL: f64 = 3.0;
/// Values whose standard deviation is below this fraction of the noise do not vary, in windows of so many values: by chance one window in
/// 10⁹.
const NO_NOISE: f64 = 0.1;
const WINDOW: usize = 12;

/// Leaves out the positions of frozen markers.
pub(super) fn leave_out(recording: &mut Recording) -> Vec<Repair> {
    let noise_m = usual_noise(&recording.position_m);
    let Some(too_many) = equal_values_too_many(&recording.position_m).filter(|_| noise_m > 0.0) else {
        return Vec::new();
    };
    let mut repairs = Vec::new();
    for (cell, series) in recording.position_m.iter_mut().enumerate() {
        let seen: Vec<usize> = (0..series.len()).filter(|&sample| series[sample].is_finite()).collect();
        let values: Vec<f64> = seen.iter().map(|&sample| series[sample]).collect();
        let mut frozen = vec![false; seen.len()];
        for run in equal_runs(&values).filter(|run| run.len() >= too_many) {
            frozen[run].fill(true);
        }
        for at in 0..values.len().saturating_sub(WINDOW - 1) {
            let window = at..at + WINDOW;
            if deviation(&values[window.clone()]) < NO_NOISE * noise_m {
                frozen[window].fill(true);
            }
        }
        for run in marked_runs(&frozen) {
            let when_s = (recording.time_s[seen[run.start]], recording.time_s[seen[run.end - 1]]);
            repairs.push(Repair::new(RepairKind::FrozenMarker, Some(cell), when_s, run.len()));
            for &sample in &seen[run] {
                series[sample] = f64::NAN;
            }
        }
    }
    repairs
}

/// Length of a run of equal values that chance does not make; none where the file's steps are too coarse.
fn equal_values_too_many(position_m: &[Vec<f64>]) -> Option<usize> {
    let (mut equal, mut pairs) = (0, 0);
    for series in position_m {
        pairs += series
            .windows(2)
            .filter(|pair| pair[0].is_finite() && pair[1].is_finite())
            .count();
        // A frozen marker must not count as a coarse file.
        let by_chance = equal_runs(series)
            .map(|run| run.len() - 1)
            .filter(|more| *more < MIN_EQUAL - 1);
        equal += by_chance.sum::<usize>();
    }
    let fraction = equal as f64 / pairs.max(1) as f64;
    if fraction > TOO_COARSE {
        return None;
    }
    let in_a_row = (CHANCE / pairs.max(1) as f64).ln() / (STILL * fraction).ln();
    Some(MIN_EQUAL.max(if fraction > 0.0 {
        1 + in_a_row.ceil() as usize
    } else {
        0
    }))
}

/// Runs of at least two equal values.
fn equal_runs(series: &[f64]) -> impl Iterator<Item = Range<usize>> {
    let mut end = 0;
    series.chunk_by(|a, b| a == b).filter_map(move |run| {
        let begin = end;
        end += run.len();
        (run.len() > 1).then_some(begin..end)
    })
}

/// Runs of marked values.
fn marked_runs(marked: &[bool]) -> Vec<Range<usize>> {
    let mut end = 0;
    let runs = marked.chunk_by(|a, b| a == b).filter_map(|run| {
        let begin = end;
        end += run.len();
        run[0].then_some(begin..end)
    });
    runs.collect()
}

/// Standard deviation of some values, m.
fn deviation(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt()
}

#[cfg(test)]
mod tests;
