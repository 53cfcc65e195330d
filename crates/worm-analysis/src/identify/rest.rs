//! Drift of the camera, by what the body does while the gait stands still.
//!
//! A camera that drifts evenly cannot be told from a worm that advances evenly, except where the worm rests. Pads that creep move the body at
//! rest as well, but slower and slower. So a drift is reported where the body moves at one and the same speed in two rests with crawling
//! between them.

use super::gait::IdentifiedGait;
use crate::recording::{Repair, RepairKind};
use std::ops::Range;

/// Change of phase up to which the gait stands still, cycles.
const STILL: f64 = 0.004;
/// Shortest rest that is used, and the time at its begin in which the body settles, s.
const MIN_REST_S: f64 = 1.5;
const SETTLING_S: f64 = 0.5;
/// Parts of a rest whose means give its speed: the noise of a camera is correlated within them.
const PARTS: usize = 6;
/// A speed differs from 0 by more, and from another by less, than so many standard errors.
const MOVES: f64 = 6.0;
const ALIKE: f64 = 3.0;
/// How far the speeds in both halves of a rest may differ, as a fraction of the whole, besides so many standard errors.
const EVEN: f64 = 0.25;
/// Smallest drift that is reported, m per gait cycle.
const MIN_PER_CYCLE_M: f64 = 2e-5;

/// Motion at rest.
#[derive(Debug, Clone, Copy)]
struct Speed {
    m_per_s: f64,
    sigma_m_per_s: f64,
}

/// The drift of the camera, where two rests agree on it.
pub(super) fn drift(time_s: &[f64], gait: &IdentifiedGait) -> Option<Repair> {
    let last = time_s.len() - 1;
    let cycles = gait.phase[last] - gait.phase[0];
    let rests = rests(time_s, &gait.phase);
    let (first, second) = (rests.first()?, rests.get(1..)?.last()?);
    let speeds = [speed(time_s, gait, first)?, speed(time_s, gait, second)?];
    let [before, after] = speeds;
    let is_moving = speeds
        .iter()
        .all(|speed| speed.m_per_s.abs() > MOVES * speed.sigma_m_per_s);
    let apart = (before.m_per_s - after.m_per_s).abs();
    if !is_moving || apart > ALIKE * before.sigma_m_per_s.hypot(after.sigma_m_per_s) {
        return None;
    }
    let rate = 0.5 * (before.m_per_s + after.m_per_s);
    if rate.abs() * (time_s[last] - time_s[0]) < MIN_PER_CYCLE_M * cycles {
        return None;
    }
    let when_s = (time_s[first.start], time_s[second.end - 1]);
    Some(Repair {
        rate: Some(rate),
        ..Repair::new(RepairKind::CameraDrift, None, when_s, 0)
    })
}

/// Stretches in which the gait stands still, long enough.
fn rests(time_s: &[f64], phase: &[f64]) -> Vec<Range<usize>> {
    let mut rests = Vec::new();
    let mut from = 0;
    while from < phase.len() {
        let to = from + phase[from..].partition_point(|&here| here <= phase[from] + STILL);
        if time_s[to - 1] - time_s[from] >= MIN_REST_S + SETTLING_S {
            rests.push(time_s.partition_point(|&at_s| at_s < time_s[from] + SETTLING_S)..to);
            from = to;
        } else {
            from += 1;
        }
    }
    rests
}

/// Speed of the body in a rest, by a straight line through the means of its parts; none where it changes.
fn speed(time_s: &[f64], gait: &IdentifiedGait, rest: &Range<usize>) -> Option<Speed> {
    let count = rest.len() / PARTS;
    let means: Vec<(f64, f64)> = (0..PARTS)
        .map(|part| {
            let samples = rest.start + part * count..rest.start + (part + 1) * count;
            let seen = samples.filter(|&sample| gait.body_m[sample].is_finite());
            let (at_s, at_m, seen) = seen.fold((0.0, 0.0, 0.0), |(at_s, at_m, seen), sample| {
                (at_s + time_s[sample], at_m + gait.body_m[sample], seen + 1.0)
            });
            (at_s / seen, at_m / seen)
        })
        .collect();
    let parts = PARTS as f64;
    let mean_s = means.iter().map(|mean| mean.0).sum::<f64>() / parts;
    let mean_m = means.iter().map(|mean| mean.1).sum::<f64>() / parts;
    let spread = means.iter().map(|mean| (mean.0 - mean_s).powi(2)).sum::<f64>();
    let m_per_s = means
        .iter()
        .map(|mean| (mean.0 - mean_s) * (mean.1 - mean_m))
        .sum::<f64>()
        / spread;
    let residuals = means.iter().map(|mean| mean.1 - mean_m - m_per_s * (mean.0 - mean_s));
    let scatter = residuals.map(|residual| residual * residual).sum::<f64>() / (parts - 2.0);
    // The noise of the samples is the least error, should the few means lie on a line by chance.
    let least = gait.noise_m.powi(2) / (gait.step_order.len() as f64 * count as f64);
    let sigma_m_per_s = (scatter.max(least) / spread).sqrt();
    let half = PARTS / 2;
    let over = |from: usize, to: usize| (means[to].1 - means[from].1) / (means[to].0 - means[from].0);
    let change = over(0, half - 1) - over(half, PARTS - 1);
    let change_sigma = 2.0 * least.sqrt() / (means[half - 1].0 - means[0].0);
    let is_even = change.abs() <= EVEN * m_per_s.abs() + ALIKE * change_sigma;
    (is_even && m_per_s.is_finite() && sigma_m_per_s.is_finite()).then_some(Speed { m_per_s, sigma_m_per_s })
}

#[cfg(test)]
mod tests;
