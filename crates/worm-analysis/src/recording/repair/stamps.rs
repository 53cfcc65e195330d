//! Times of the samples: those that do not grow, and those that are missing.

use crate::recording::repair_note::{Repair, RepairKind};
use crate::recording::statistics::quantile;

/// Largest fraction of the samples whose time may be wrong.
const MAX_WRONG: f64 = 0.01;
/// Most wrong times in a row: more are a clock that was set back.
const MAX_WRONG_IN_A_ROW: usize = 2;
/// A rate is even where this fraction of the steps is within this fraction of the median.
const EVEN: (f64, f64) = (0.9, 0.1);
/// A step longer than this many median steps is one in which samples are missing.
const MISSING_STEPS: f64 = 1.5;

/// Which samples to keep so that time grows: as many as possible. None where so many times are wrong, or so many in a row, that
/// leaving their samples out would hide a clock that was set back.
pub(in crate::recording) fn increasing(time_s: &[f64]) -> Option<Vec<bool>> {
    let kept = longest_increasing(time_s);
    let wrong = kept.iter().filter(|kept| !**kept).count();
    let in_a_row = kept.split(|kept| *kept).map(<[bool]>::len).max().unwrap_or(0);
    (wrong as f64 <= MAX_WRONG * time_s.len() as f64 && in_a_row <= MAX_WRONG_IN_A_ROW).then_some(kept)
}

/// Marks a longest strictly increasing subsequence.
fn longest_increasing(values: &[f64]) -> Vec<bool> {
    let mut ends: Vec<usize> = Vec::new(); // of the best subsequence of each length, the sample it ends at
    let mut before: Vec<Option<usize>> = Vec::with_capacity(values.len());
    for (at, value) in values.iter().enumerate() {
        let length = ends.partition_point(|&end| values[end] < *value);
        before.push(length.checked_sub(1).map(|shorter| ends[shorter]));
        match ends.get_mut(length) {
            Some(end) => *end = at,
            None => ends.push(at),
        }
    }
    let mut kept = vec![false; values.len()];
    let mut at = ends.last().copied();
    while let Some(sample) = at {
        kept[sample] = true;
        at = before[sample];
    }
    kept
}

/// What to note of the samples that were left out.
pub(in crate::recording) fn note(time_s: &[f64], kept: &[bool]) -> Repair {
    let mut wrong_s = time_s
        .iter()
        .zip(kept)
        .filter(|(_, kept)| !**kept)
        .map(|(at_s, _)| *at_s);
    let first_s = wrong_s.next().unwrap_or(0.0);
    let (from_s, to_s, samples) = wrong_s.fold((first_s, first_s, 1), |(from_s, to_s, samples), at_s| {
        (at_s.min(from_s), at_s.max(to_s), samples + 1)
    });
    Repair::new(RepairKind::TimeNotIncreasing, None, (from_s, to_s), samples)
}

/// Samples that are missing from an even rate.
pub(super) fn missing(time_s: &[f64]) -> Option<Repair> {
    let steps = || time_s.windows(2).map(|pair| pair[1] - pair[0]);
    let period_s = quantile(steps(), 0.5).filter(|period_s| *period_s > 0.0)?;
    let even = steps()
        .filter(|step_s| (step_s - period_s).abs() <= EVEN.1 * period_s)
        .count();
    if (even as f64) < EVEN.0 * (time_s.len() - 1) as f64 {
        return None;
    }
    let holes: Vec<&[f64]> = time_s
        .windows(2)
        .filter(|pair| pair[1] - pair[0] > MISSING_STEPS * period_s)
        .collect();
    let samples: f64 = holes
        .iter()
        .map(|pair| ((pair[1] - pair[0]) / period_s).round() - 1.0)
        .sum();
    let (first, last) = (holes.first()?, holes.last()?);
    Some(Repair::new(
        RepairKind::MissingSamples,
        None,
        (first[0], last[1]),
        samples as usize,
    ))
}

#[cfg(test)]
mod tests;
