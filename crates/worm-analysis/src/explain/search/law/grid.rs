//! Points of an axis at which a law has its values, and the scale on which it is smooth.
//!
//! Speeds and slides crowd about rest, so there a law may change within a fraction of the largest.

use worm_physics::Axis;

/// Speeds about which there are points, as a fraction of the largest, and that within which a law over a speed may turn.
const NEAR_REST: [f64; 3] = [0.02, 0.07, 0.2];
const TURN: f64 = 0.05;
/// The same of a slide: what a tip holds at rest may be lost at once.
const SLIDES: [f64; 7] = [0.0, 0.004, 0.012, 0.04, 0.12, 0.35, 1.0];
const TURN_OF_SLIDE: f64 = 0.01;
/// Most points along an axis.
const MOST_POINTS: usize = 56;
/// Most coordinates that are kept of where the data are.
const SEEN: usize = 600;

/// The ends of what was gone through; none where that is a single place.
pub(in crate::explain) fn ends(seen: &[f64]) -> Option<(f64, f64)> {
    let (min, max) = seen.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), &at| {
        (f64::min(min, at), f64::max(max, at))
    });
    (max > min).then_some((min, max))
}

/// Points from end to end.
pub(in crate::explain) fn evenly(from: f64, to: f64, points: usize) -> Vec<f64> {
    (0..points)
        .map(|point| from + (to - from) * point as f64 / (points - 1) as f64)
        .collect()
}

/// Points with a spacing, or a larger one where there would be too many.
pub(in crate::explain) fn with_spacing(from: f64, to: f64, spacing: f64) -> Vec<f64> {
    let points = ((to - from) / spacing).ceil() as usize + 1;
    evenly(from, to, points.clamp(2, MOST_POINTS))
}

/// Points that lie close about rest.
pub(in crate::explain) fn about_rest(from: f64, to: f64) -> Vec<f64> {
    let largest = from.abs().max(to.abs());
    let near = NEAR_REST.iter().flat_map(|part| [-part * largest, part * largest]);
    let mut points: Vec<f64> = near.chain([0.0, from, to, 0.45 * to, 0.75 * to]).collect();
    points.retain(|at| (from..=to).contains(at));
    points.sort_by(f64::total_cmp);
    points.dedup_by(|a, b| (*a - *b).abs() < 5e-3 * largest);
    points
}

/// Points of a slide that crowd where it begins.
pub(in crate::explain) fn from_rest(longest: f64) -> Vec<f64> {
    SLIDES.map(|part| part * longest).to_vec()
}

/// The scale on which a law is smooth.
pub(in crate::explain) fn scaled(axis: Axis, grid: &[f64]) -> Vec<f64> {
    let (first, last) = (grid[0], grid[grid.len() - 1]);
    let width = if grid.len() > 1 { last - first } else { 1.0 };
    match axis {
        Axis::Phase => grid.to_vec(),
        Axis::DeformationRate | Axis::Speed | Axis::RecentSlide | Axis::MotorSpeed => {
            let part = if axis == Axis::RecentSlide { TURN_OF_SLIDE } else { TURN };
            let turn = part * first.abs().max(last.abs());
            let bent = |at: f64| (at / turn).asinh();
            let width = bent(last) - bent(first);
            grid.iter().map(|at| (bent(*at) - bent(first)) / width).collect()
        }
        _ => grid.iter().map(|at| (at - first) / width).collect(),
    }
}

/// The points of a grid over one axis or two about a place, with the part that each has in a value there that is linear between points and
/// flat beyond them; `at` is where the place is along an axis.
pub(in crate::explain) fn parts(axes: &[(Axis, Vec<f64>)], at: impl Fn(usize) -> f64) -> Vec<(usize, f64)> {
    let along = |axis: usize| axes.get(axis).map(|(_, grid)| parts_along(grid, at(axis)));
    let Some(rows) = along(0) else {
        return Vec::new();
    };
    let (columns, count) = match along(1) {
        Some(columns) => (columns.to_vec(), axes[1].1.len()),
        None => (vec![(0, 1.0)], 1),
    };
    let of_row = |(row, part): (usize, f64)| {
        columns
            .iter()
            .map(move |(column, by)| (row * count + column, part * by))
    };
    rows.into_iter().flat_map(of_row).collect()
}

/// The same along one axis.
fn parts_along(grid: &[f64], at: f64) -> [(usize, f64); 2] {
    let above = grid.partition_point(|point| *point <= at).clamp(1, grid.len() - 1);
    let (from, to) = (grid[above - 1], grid[above]);
    let part = ((at - from) / (to - from)).clamp(0.0, 1.0);
    [(above - 1, 1.0 - part), (above, part)]
}

/// At most so many, evenly.
pub(in crate::explain) fn thinned(seen: &[f64]) -> Vec<f64> {
    seen.iter().copied().step_by(seen.len().div_ceil(SEEN).max(1)).collect()
}
