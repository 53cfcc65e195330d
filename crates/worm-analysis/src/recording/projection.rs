//! From markers in space onto the canal.
//!
//! The canal is straight and the worm moves along it, so the direction in which all markers are displaced is the canal's,
//! wherever on its cell each marker sits: the axis is the first principal component of the markers' displacements, each from
//! its own mean. It points in the direction of the worm's net displacement. Markers that stand still, or move far less or far
//! more than the others, are not cells and are left out; the others are numbered down the canal, because cell 1 leads. Every
//! choice is reported in a warning. Where the motion does not determine the axis, the file is refused, and `--axis` must give
//! it.

use super::markers::Markers;
use super::series::Recording;
use super::statistics::moves;
use super::statistics::{quantile, spread};
use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use std::path::Path;
use std::str::FromStr;
use worm_estimator::abridged::first_of;
use worm_log::ReadError;
use worm_physics::MAX_CELLS;

/// A position beyond this is none, m: sums of its square would lose all others.
pub(super) const MAX_POSITION_M: f64 = 1e6;
/// A marker that moves over less than this fraction of the median range, or whose own range exceeds the median as much, does
/// not crawl with the others.
const CRAWLING_FRACTION: f64 = 0.2;
/// The markers move along a line when the second principal component is at most this fraction of the first.
const CLEAR_FRACTION: f64 = 0.5;
/// The direction of travel is clear when the net displacement is at least this fraction of the range of the cells' motion.
const MIN_NET_FRACTION: f64 = 0.2;
/// Motion across the canal, as a fraction of that along it, above which a warning is given.
const STRAIGHT_FRACTION: f64 = 0.05;
/// Most markers that are named because they were left out.
const MAX_LEFT_OUT_NAMED: usize = 20;
/// Longest name of a marker that is quoted in a list, bytes.
const MAX_QUOTED_NAME: usize = 100;
const AXIS_REMEDY: &str = "give the direction up the canal with --axis x, -x, y, -y, z, -z or a vector dx,dy,dz";

/// A direction in the space of the markers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis(Vector3<f64>);

/// A text that is not a direction.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0:?} is not a direction: give x, -x, y, -y, z, -z, or three numbers dx,dy,dz that are not all 0")]
pub struct AxisError(String);

impl Axis {
    /// The direction of a vector of any length; `None` for one without a direction.
    pub fn new(vector: [f64; 3]) -> Option<Self> {
        let vector = Vector3::from(vector);
        let largest = vector.amax();
        // Scaled first, so that squares neither vanish nor overflow.
        (largest > 0.0 && vector.iter().all(|part| part.is_finite())).then(|| Self((vector / largest).normalize()))
    }
}

impl FromStr for Axis {
    type Err = AxisError;

    fn from_str(text: &str) -> Result<Self, AxisError> {
        let named = match text.trim() {
            "x" => Some([1.0, 0.0, 0.0]),
            "-x" => Some([-1.0, 0.0, 0.0]),
            "y" => Some([0.0, 1.0, 0.0]),
            "-y" => Some([0.0, -1.0, 0.0]),
            "z" => Some([0.0, 0.0, 1.0]),
            "-z" => Some([0.0, 0.0, -1.0]),
            list => {
                let parts: Result<Vec<f64>, _> = list.split(',').map(|part| part.trim().parse()).collect();
                parts.ok().and_then(|parts| parts.try_into().ok())
            }
        };
        named.and_then(Self::new).ok_or_else(|| AxisError(text.to_owned()))
    }
}

/// Chooses the cells among the markers and projects them onto the canal; without `axis` it is found from their motion.
///
/// # Errors
/// [`ReadError`] when the motion does not determine the direction of the canal, or fewer than 2 or more than [`MAX_CELLS`]
/// markers crawl.
pub(super) fn project(mut markers: Markers, axis: Option<Axis>, path: &Path) -> Result<Recording, ReadError> {
    let mut warnings = std::mem::take(&mut markers.warnings);
    let is_beyond = |position_m: &[f64; 3]| position_m.iter().any(|part| part.abs() > MAX_POSITION_M);
    let beyond = markers
        .position_m
        .iter()
        .position(|series| series.iter().any(is_beyond));
    if let Some(name) = beyond.and_then(|marker| markers.names.get(marker)) {
        return Err(ReadError::whole(
            path,
            format!("marker {name} is more than {MAX_POSITION_M} m away"),
            "leave the field empty where it was not seen, or export the file again",
        ));
    }
    leave_out_unseen(&mut markers, &mut warnings);
    if markers.names.is_empty() {
        let remedy = "export the trajectories of the markers on the cells";
        return Err(ReadError::whole(path, "no marker is ever seen", remedy));
    }
    leave_out_still_or_stray(&mut markers, &mut warnings);
    let cells = markers.names.len();
    if !(2..=MAX_CELLS).contains(&cells) {
        return Err(ReadError::whole(
            path,
            format!(
                "{cells} of the markers crawl ({})",
                first_of(&markers.names, MAX_LEFT_OUT_NAMED, MAX_QUOTED_NAME)
            ),
            format!("export one marker for each cell, 2 to {MAX_CELLS}, on a worm that crawls"),
        ));
    }
    let found;
    let Axis(direction) = match axis {
        Some(axis) => axis,
        None => {
            found = find_axis(&markers, path)?;
            found
        }
    };
    let along = |position_m: &[f64; 3]| Vector3::from(*position_m).dot(&direction);
    let mut order: Vec<(usize, f64)> = Vec::with_capacity(cells);
    for (marker, series) in markers.position_m.iter().enumerate() {
        let middle_m = quantile(series.iter().map(along), 0.5).unwrap_or(f64::NEG_INFINITY);
        order.push((marker, middle_m));
    }
    order.sort_by(|(_, left_m), (_, right_m)| right_m.total_cmp(left_m));
    let cell_names: Vec<String> = order.iter().map(|&(marker, _)| markers.names[marker].clone()).collect();
    let numbered: Vec<String> = (1..)
        .zip(&cell_names)
        .map(|(cell, name)| format!("{cell} {name}"))
        .collect();
    warnings.push(format!(
        "cells by marker: {}; up the canal is {}",
        numbered.join(", "),
        as_text(&direction)
    ));
    warnings.extend(off_axis_warning(&markers, &direction));
    Ok(Recording {
        source: path.to_path_buf(),
        cell_names,
        position_m: order
            .iter()
            .map(|&(marker, _)| markers.position_m[marker].iter().map(along).collect())
            .collect(),
        time_s: markers.time_s,
        gait_phase: None,
        motor: None,
        warnings,
        repairs: Vec::new(),
    })
}

/// Keeps the first warnings and says how many more markers were left out.
fn summarise(warnings: &mut Vec<String>, max_warnings: usize) {
    let more = warnings.len().saturating_sub(max_warnings);
    if more > 0 {
        warnings.truncate(max_warnings);
        warnings.push(format!("{more} more markers were left out"));
    }
}

fn as_text(direction: &Vector3<f64>) -> String {
    // Adding 0 turns a negative zero into a plain one.
    let [x, y, z] = [direction.x, direction.y, direction.z].map(|part| (part * 1e3).round() / 1e3 + 0.0);
    format!("{x},{y},{z}")
}

fn retain(markers: &mut Markers, kept: &[bool]) {
    let mut of_names = kept.iter();
    markers.names.retain(|_| of_names.next().is_some_and(|kept| *kept));
    let mut of_positions = kept.iter();
    markers
        .position_m
        .retain(|_| of_positions.next().is_some_and(|kept| *kept));
}

fn leave_out_unseen(markers: &mut Markers, warnings: &mut Vec<String>) {
    let seen: Vec<bool> = markers
        .position_m
        .iter()
        .map(|series| series.iter().any(|position_m| !position_m[0].is_nan()))
        .collect();
    for (name, _) in markers.names.iter().zip(&seen).filter(|(_, seen)| !**seen) {
        warnings.push(format!("marker {name} is never seen and was left out"));
    }
    summarise(warnings, MAX_LEFT_OUT_NAMED);
    retain(markers, &seen);
}

fn component(series: &[[f64; 3]], index: usize) -> impl Iterator<Item = f64> {
    series.iter().map(move |position_m| position_m[index])
}

/// Leaves out markers that stand still, and those that move far less or far more than the median of the moving ones.
fn leave_out_still_or_stray(markers: &mut Markers, warnings: &mut Vec<String>) {
    let spread_m: Vec<Vector3<f64>> = markers
        .position_m
        .iter()
        .map(|series| Vector3::from_fn(|index, _| spread(component(series, index))))
        .collect();
    let is_moving: Vec<bool> = markers
        .position_m
        .iter()
        .map(|series| (0..3).any(|index| moves(&component(series, index).collect::<Vec<_>>())))
        .collect();
    let moving = spread_m.iter().zip(&is_moving).filter(|(_, moving)| **moving);
    let usual_m = quantile(moving.map(|(spread_m, _)| spread_m.norm()), 0.5).unwrap_or(0.0);
    let kept: Vec<bool> = spread_m
        .iter()
        .zip(&is_moving)
        .map(|(spread_m, moving)| {
            let length_m = spread_m.norm();
            *moving && length_m >= CRAWLING_FRACTION * usual_m && CRAWLING_FRACTION * length_m <= usual_m
        })
        .collect();
    for ((name, _), spread_m) in markers
        .names
        .iter()
        .zip(&kept)
        .zip(&spread_m)
        .filter(|((_, kept), _)| !**kept)
    {
        warnings.push(format!(
            "marker {name} does not crawl with the others (it moves by {:.2} mm) and was left out",
            spread_m.norm() * 1e3
        ));
    }
    summarise(warnings, 2 * MAX_LEFT_OUT_NAMED);
    retain(markers, &kept);
}

/// Displacements of all markers, each from its own mean, pooled.
fn displacements(markers: &Markers) -> impl Iterator<Item = Vector3<f64>> {
    markers.position_m.iter().flat_map(|series| {
        let seen = || {
            series
                .iter()
                .filter(|position_m| !position_m[0].is_nan())
                .map(|position_m| Vector3::from(*position_m))
        };
        let mean_m = seen().sum::<Vector3<f64>>() / seen().count().max(1) as f64;
        seen().map(move |position_m| position_m - mean_m)
    })
}

/// The first principal component of the displacements, in the direction of the net displacement.
fn find_axis(markers: &Markers, path: &Path) -> Result<Axis, ReadError> {
    let refuse = |problem: String| Err(ReadError::whole(path, problem, AXIS_REMEDY));
    let scatter: Matrix3<f64> = displacements(markers)
        .map(|displacement_m| displacement_m * displacement_m.transpose())
        .sum();
    let eigen = SymmetricEigen::new(scatter);
    let mut order = [0, 1, 2];
    order.sort_by(|&left, &right| eigen.eigenvalues[right].total_cmp(&eigen.eigenvalues[left]));
    let [along, across] = [order[0], order[1]].map(|index| eigen.eigenvalues[index].max(0.0).sqrt());
    if across > CLEAR_FRACTION * along {
        return refuse("the markers do not move along one line, so the canal cannot be found from them".to_owned());
    }
    let direction: Vector3<f64> = eigen.eigenvectors.column(order[0]).into_owned();
    let net: Vec<f64> = markers
        .position_m
        .iter()
        .map(|series| net_displacement_m(series, &direction))
        .collect();
    let net_m = net.iter().sum::<f64>() / net.len() as f64;
    let ranges = markers.position_m.iter().map(|series| {
        spread(
            series
                .iter()
                .map(|position_m| Vector3::from(*position_m).dot(&direction)),
        )
    });
    let range_m = quantile(ranges, 0.5).unwrap_or(0.0);
    if net_m.abs() < MIN_NET_FRACTION * range_m {
        return refuse(format!(
            "the worm advanced by {:.2} mm only, too little to determine its direction",
            net_m.abs() * 1e3
        ));
    }
    Ok(Axis(direction * net_m.signum()))
}

/// Displacement of a marker along a direction from the mean of its first seen tenth to the mean of its last, m.
fn net_displacement_m(series: &[[f64; 3]], direction: &Vector3<f64>) -> f64 {
    let seen: Vec<f64> = series
        .iter()
        .map(|position_m| Vector3::from(*position_m).dot(direction))
        .filter(|position_m| !position_m.is_nan())
        .collect();
    let tenth = seen.len().div_ceil(10);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    mean(&seen[seen.len() - tenth..]) - mean(&seen[..tenth])
}

/// A warning where the markers move across the canal more than they should.
fn off_axis_warning(markers: &Markers, direction: &Vector3<f64>) -> Option<String> {
    let (mut along_m2, mut across_m2, mut count) = (0.0, 0.0, 0.0f64);
    for displacement_m in displacements(markers) {
        let along_m = displacement_m.dot(direction);
        along_m2 += along_m * along_m;
        across_m2 += displacement_m.norm_squared() - along_m * along_m;
        count += 1.0;
    }
    (across_m2 > STRAIGHT_FRACTION * STRAIGHT_FRACTION * along_m2).then(|| {
        format!(
            "the markers leave the canal's line by {:.2} mm rms while they move {:.2} mm rms along it: is the canal straight, and \
             the axis right?",
            (across_m2 / count.max(1.0)).max(0.0).sqrt() * 1e3,
            (along_m2 / count.max(1.0)).sqrt() * 1e3
        )
    })
}

#[cfg(test)]
mod tests;
