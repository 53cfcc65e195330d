//! The first estimate of the largest tip deformations, by inspection of the positions (section 3.2.1).
//!
//! While the stepping tip sticks, the other cells are pushed back; once it slides, they stand. So the displacement of the
//! stepping cell at which the others stop moving back took its tip from one bound to the other: twice δmax, if it began its step at
//! −δmax as the paper assumes. In the place of the eye, a broken line, falling and then level, is fitted to all steps of a cell.

use super::gait::IdentifiedGait;

/// Parts of a step.
const PARTS: usize = 60;
/// Parts at either end of a step that are left out: the cam's corners, and the phase's uncertainty.
const MARGIN: usize = 1;
/// First part at which the break may lie.
const EARLIEST: usize = 3;

/// What inspection of one cell's steps shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Onset {
    /// Fraction of the step at which the others stop moving back, that is, forward sliding begins.
    pub fraction: f64,
    /// How far the others have been pushed back by then, m.
    pub retraction_m: f64,
    /// The first estimate of the largest tip deformation, m: half the displacement of the cell by then.
    pub max_deformation_m: f64,
}

/// The onset of sliding of each cell, cell 0 first.
pub fn find(gait: &IdentifiedGait) -> Vec<Onset> {
    let cells = gait.step_order.len();
    let mut sums = vec![[(0.0, 0.0); PARTS]; cells]; // mean way since the step's begin, by part: sum and count
    let mut begin: Option<(i64, Vec<(usize, f64)>)> = None;
    for (sample, &phase) in gait.phase.iter().enumerate() {
        if gait.body_m[sample].is_nan() {
            continue;
        }
        let steps = phase * cells as f64;
        let slot = steps.floor();
        let part = (((steps - slot) * PARTS as f64) as usize).min(PARTS - 1);
        match &mut begin {
            Some((open, displacements)) if *open == slot as i64 => displacements.push((part, gait.body_m[sample])),
            _ => {
                if let Some((open, displacements)) = begin.take() {
                    add(
                        &mut sums[gait.step_order[open.rem_euclid(cells as i64) as usize]],
                        &displacements,
                    );
                }
                begin = Some((slot as i64, vec![(part, gait.body_m[sample])]));
            }
        }
    }
    (0..cells).map(|cell| break_of(&sums[cell], gait.stroke_m)).collect()
}

/// Adds one step, its displacements counted from its mean, so that earlier ones do not matter.
fn add(sums: &mut [(f64, f64); PARTS], displacements: &[(usize, f64)]) {
    let whole = displacements.first().is_some_and(|first| first.0 < PARTS / 6)
        && displacements.last().is_some_and(|last| last.0 >= PARTS - PARTS / 6);
    if !whole {
        return;
    }
    let late: Vec<f64> = displacements
        .iter()
        .filter(|displacement| displacement.0 >= PARTS / 2)
        .map(|displacement| displacement.1)
        .collect();
    let base_m = late.iter().sum::<f64>() / late.len().max(1) as f64;
    for &(part, displacement_m) in displacements {
        sums[part].0 += displacement_m - base_m;
        sums[part].1 += 1.0;
    }
}

/// The broken line that fits best: falling to the break, level after it.
fn break_of(sums: &[(f64, f64); PARTS], stroke_m: f64) -> Onset {
    let points: Vec<(f64, f64, f64)> = (MARGIN..PARTS - MARGIN)
        .filter(|&part| sums[part].1 > 0.0)
        .map(|part| {
            (
                (part as f64 + 0.5) / PARTS as f64,
                sums[part].0 / sums[part].1,
                sums[part].1,
            )
        })
        .collect();
    let mut best = (f64::INFINITY, 1.0, 0.0); // chi-squared, break, slope before it
    for at in EARLIEST..4 * PARTS {
        let at = at as f64 / (4 * PARTS) as f64;
        // way = level + slope · min(share − break, 0): linear least squares in level and slope
        let (mut n, mut x, mut y, mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for &(fraction, displacement_m, weight) in &points {
            let before = (fraction - at).min(0.0);
            n += weight;
            x += weight * before;
            y += weight * displacement_m;
            xx += weight * before * before;
            xy += weight * before * displacement_m;
            yy += weight * displacement_m * displacement_m;
        }
        let spread = xx - x * x / n;
        if spread <= 0.0 || spread.is_nan() {
            continue;
        }
        let slope = (xy - x * y / n) / spread;
        let chi_squared = yy - y * y / n - slope * (xy - x * y / n);
        if chi_squared < best.0 {
            best = (chi_squared, at, slope);
        }
    }
    let (_, fraction, slope_m) = best;
    let retraction_m = (-slope_m * fraction).max(0.0);
    Onset {
        fraction,
        retraction_m,
        max_deformation_m: (0.5 * (fraction * stroke_m - retraction_m)).max(1e-3 * stroke_m),
    }
}

#[cfg(test)]
mod tests;
