//! Drift between the clocks of gait phase and positions.
//!
//! Where the phase was recorded by another device than the positions, the stepping cell shows how late the positions are: its extension
//! should be the stroke times the part of the step that has passed. A lag that stays is one of the worm or its sensor; one that grows evenly
//! over the whole recording is that of two clocks.

use super::gait::IdentifiedGait;
use crate::recording::{Repair, RepairKind};

/// Part of a step that counts: cams have rounded corners.
const MIDDLE: std::ops::Range<f64> = 0.25..0.75;
/// Parts of the recording in time, and the fewest steps in each.
const PARTS: usize = 6;
const MIN_STEPS: usize = 4;
/// The lag changes over the recording by more than so many standard errors, and by more than this, s.
const DIFFERENT: f64 = 8.0;
const MIN_LAG_S: f64 = 0.01;
/// How far the lag of a part may be from the straight line through all, as a fraction of the whole change, besides so many standard
/// errors.
const EVENLY: (f64, f64) = (0.1, 3.0);

/// The drift of the clocks, where the recorded phase shows one.
pub(super) fn drift(time_s: &[f64], position_m: &[Vec<f64>], gait: &IdentifiedGait) -> Option<Repair> {
    let lags = lags(time_s, position_m, gait);
    let (begin_s, end_s) = (lags.first()?.0, lags.last()?.0);
    let part_s = (end_s - begin_s) / PARTS as f64;
    let mut parts = Vec::with_capacity(PARTS);
    for part in 0..PARTS {
        let from_s = begin_s + part as f64 * part_s;
        let within = lags
            .iter()
            .filter(|(at_s, _)| (from_s..=from_s + part_s).contains(at_s));
        let (lag_s, sigma_s) = mean_and_error(within.map(|(_, lag_s)| *lag_s).collect())?;
        parts.push((part as f64 - 0.5 * (PARTS - 1) as f64, lag_s, sigma_s));
    }
    let mean_s = parts.iter().map(|part| part.1).sum::<f64>() / PARTS as f64;
    let spread = parts.iter().map(|part| part.0 * part.0).sum::<f64>();
    let per_part_s = parts.iter().map(|part| part.0 * part.1).sum::<f64>() / spread;
    let change_s = PARTS as f64 * per_part_s;
    let sigma_s = PARTS as f64 * parts.iter().map(|part| (part.0 * part.2).powi(2)).sum::<f64>().sqrt() / spread;
    let is_even = parts.iter().all(|(place, lag_s, sigma_s)| {
        (lag_s - mean_s - per_part_s * place).abs() <= EVENLY.0 * change_s.abs() + EVENLY.1 * sigma_s
    });
    if change_s.abs() < MIN_LAG_S || change_s.abs() < DIFFERENT * sigma_s || !is_even {
        return None;
    }
    Some(Repair {
        rate: Some(per_part_s / part_s),
        ..Repair::new(RepairKind::ClockDrift, None, (begin_s, end_s), 0)
    })
}

/// Middle of each step, s, and how late the positions are in it, s.
fn lags(time_s: &[f64], position_m: &[Vec<f64>], gait: &IdentifiedGait) -> Vec<(f64, f64)> {
    let cells = gait.step_order.len();
    let step_of = |sample: usize| (gait.phase[sample] * cells as f64).floor();
    let mut lags = Vec::new();
    let mut from = 0;
    while from < time_s.len() {
        let to = from + gait.phase[from..].partition_point(|&phase| (phase * cells as f64).floor() <= step_of(from));
        let slot = step_of(from);
        let stepping = gait.step_order[slot.rem_euclid(cells as f64) as usize];
        let cycle = (slot / cells as f64).floor();
        let made = |cell: usize| {
            let place = gait.step_order.iter().position(|&other| other == cell).unwrap_or(0) as f64;
            cycle + f64::from(u8::from(place < slot - cycle * cells as f64))
        };
        let in_body_m =
            |cell: usize, sample: usize| position_m[cell][sample] - gait.place_m[cell] - gait.stroke_m * made(cell);
        let (mut late, mut count) = (0.0, 0.0);
        for sample in from..to {
            let part = gait.phase[sample] * cells as f64 - slot;
            let others = (0..cells).filter(|&cell| cell != stepping);
            let body_m = others.map(|cell| in_body_m(cell, sample)).sum::<f64>() / (cells - 1) as f64;
            let extension = (in_body_m(stepping, sample) - body_m) / gait.stroke_m;
            if MIDDLE.contains(&part) && extension.is_finite() {
                late += part - extension;
                count += 1.0;
            }
        }
        let step_s = time_s[to - 1] - time_s[from];
        let is_whole = from > 0 && to < time_s.len();
        if is_whole && count > 0.0 {
            lags.push((0.5 * (time_s[from] + time_s[to - 1]), late / count * step_s));
        }
        from = to;
    }
    lags
}

/// Mean and its standard error; none for too few values.
fn mean_and_error(values: Vec<f64>) -> Option<(f64, f64)> {
    let count = values.len() as f64;
    if values.len() < MIN_STEPS {
        return None;
    }
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
    Some((mean, (variance / count).sqrt()))
}

#[cfg(test)]
mod tests;
