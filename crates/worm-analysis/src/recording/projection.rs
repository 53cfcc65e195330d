//! From markers in space onto the canal.
//!
//! The canal is straight and the worm moves along it, so the direction in which all markers are displaced is the canal's,
//! wherever on its cell each marker sits: the axis is the principal direction of the markers' displacements, each from its own
//! mean. It points the way the worm got ahead. Markers that stand still or go elsewhere are no cells and are left out; the
//! others are numbered down the canal, for cell 1 leads. Every choice is told in a warning, and one that the motion does not
//! decide is refused: `--axis` then says which way is up.

use super::markers::Markers;
use super::series::Recording;
use super::statistics::moves;
use super::statistics::{quantile, spread};
use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use std::path::Path;
use std::str::FromStr;
use worm_log::ReadError;
use worm_physics::MAX_CELLS;

/// A marker whose way is less than this share of the usual one, or the other way round, does not crawl with the others.
const CRAWLING_FRACTION: f64 = 0.2;
/// A line is clear when nothing spreads more than this share across it.
const CLEAR_FRACTION: f64 = 0.5;
/// The worm got ahead clearly when it did by this share of the range in which its cells moved.
const AHEAD_FRACTION: f64 = 0.2;
/// Motion across the canal, as a share of that along it, that is worth a warning.
const STRAIGHT_FRACTION: f64 = 0.05;
const AXIS_REMEDY: &str = "give the direction up the canal with --axis x, -x, y, -y, z, -z or a vector dx,dy,dz";

/// A direction in the space of the markers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis(Vector3<f64>);

/// A text that names no direction.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0:?} is no direction: give x, -x, y, -y, z, -z, or three numbers dx,dy,dz that are not all 0")]
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

/// Chooses the cells among the markers and lays them onto the canal; `axis` overrules what their motion tells.
///
/// # Errors
/// [`ReadError`] when the motion does not tell which way the canal goes, or fewer than 2 or more than [`MAX_CELLS`] markers
/// crawl.
pub(super) fn project(mut markers: Markers, axis: Option<Axis>, path: &Path) -> Result<Recording, ReadError> {
    let mut warnings = std::mem::take(&mut markers.warnings);
    leave_out_unseen(&mut markers, &mut warnings);
    if markers.names.is_empty() {
        let remedy = "export the trajectories of the markers on the cells";
        return Err(ReadError::whole(path, "no marker is ever seen", remedy));
    }
    leave_out_strangers(&mut markers, &mut warnings);
    let cells = markers.names.len();
    if !(2..=MAX_CELLS).contains(&cells) {
        return Err(ReadError::whole(
            path,
            format!("{cells} of the markers crawl ({})", markers.names.join(", ")),
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
        in_words(&direction)
    ));
    warnings.extend(crooked(&markers, &direction));
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
    })
}

fn in_words(direction: &Vector3<f64>) -> String {
    // Adding 0 turns a negative zero into a plain one.
    let [x, y, z] = [direction.x, direction.y, direction.z].map(|part| (part * 1e3).round() / 1e3 + 0.0);
    format!("{x},{y},{z}")
}

fn keep(markers: &mut Markers, kept: &[bool]) {
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
    keep(markers, &seen);
}

fn component(series: &[[f64; 3]], index: usize) -> impl Iterator<Item = f64> {
    series.iter().map(move |position_m| position_m[index])
}

/// Leaves out what stands still, and what moves far less or far more than is usual among what moves.
fn leave_out_strangers(markers: &mut Markers, warnings: &mut Vec<String>) {
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
    keep(markers, &kept);
}

/// Each marker's positions from its own mean, pooled.
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

/// The principal direction of the displacements, pointing the way the worm got ahead.
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
    let ahead: Vec<f64> = markers
        .position_m
        .iter()
        .map(|series| got_ahead_m(series, &direction))
        .collect();
    let ahead_m = ahead.iter().sum::<f64>() / ahead.len() as f64;
    let ranges = markers.position_m.iter().map(|series| {
        spread(
            series
                .iter()
                .map(|position_m| Vector3::from(*position_m).dot(&direction)),
        )
    });
    let range_m = quantile(ranges, 0.5).unwrap_or(0.0);
    if ahead_m.abs() < AHEAD_FRACTION * range_m {
        return refuse(format!(
            "the worm got ahead by {:.2} mm only, too little to tell which way it crawls",
            ahead_m.abs() * 1e3
        ));
    }
    Ok(Axis(direction * ahead_m.signum()))
}

/// How far a marker got along a direction, from the first tenth of what was seen of it to the last, m.
fn got_ahead_m(series: &[[f64; 3]], direction: &Vector3<f64>) -> f64 {
    let seen: Vec<f64> = series
        .iter()
        .map(|position_m| Vector3::from(*position_m).dot(direction))
        .filter(|position_m| !position_m.is_nan())
        .collect();
    let tenth = seen.len().div_ceil(10);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    mean(&seen[seen.len() - tenth..]) - mean(&seen[..tenth])
}

/// What to say of motion across the canal.
fn crooked(markers: &Markers, direction: &Vector3<f64>) -> Option<String> {
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
