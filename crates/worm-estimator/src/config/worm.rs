//! The robot's body, its canal and its gait.

use super::check::Checker;
use serde::Deserialize;
use worm_physics::MAX_CELLS;

/// One value for all cells, or one for each.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum PerCell {
    /// The same for every cell.
    Same(f64),
    /// Cell 1 first.
    Each(Vec<f64>),
}

impl PerCell {
    /// The value of cell `index`, from 0. For a checked configuration every cell has one.
    pub fn of(&self, index: usize) -> f64 {
        match self {
            Self::Same(value) => *value,
            Self::Each(values) => values[index],
        }
    }

    /// The values of `cells` cells.
    pub fn to_vec(&self, cells: usize) -> Vec<f64> {
        (0..cells).map(|index| self.of(index)).collect()
    }

    pub(super) fn check(
        &self,
        key: &str,
        cells: usize,
        range: std::ops::RangeInclusive<f64>,
        unit: &str,
        checker: &mut Checker,
    ) {
        match self {
            Self::Same(value) => checker.range(key, *value, range, unit),
            Self::Each(values) if values.len() != cells => checker.require(
                false,
                key,
                format!("a list of {}", values.len()),
                format!("give one value, or one for each of the {cells} cells"),
            ),
            Self::Each(values) => {
                for (index, value) in values.iter().enumerate() {
                    checker.range(&format!("{key}[{}]", index + 1), *value, range.clone(), unit);
                }
            }
        }
    }
}

/// Where the estimator takes the largest tip deformations from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DeformationSource {
    /// `worm.max_deformation_m` was measured; it is used as it is.
    Measured,
    /// `worm.max_deformation_m` is a first guess; the estimator finds the values on the first cycles.
    Identified,
}

/// The robot's body.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Worm {
    /// Name of this worm; its topics are `worm/<name>/…`.
    pub name: String,
    /// Number of cells.
    pub cells: usize,
    /// Mass of the whole worm, kg.
    pub mass_kg: f64,
    /// Effective stroke of one cell in one step, m.
    pub stroke_m: f64,
    /// Distance between neighbouring cells at rest, m.
    pub cell_spacing_m: f64,
    /// Tangential stiffness of a cell's contact, N/m.
    pub stiffness_n_per_m: PerCell,
    /// Largest tip deformation μN/k, m.
    pub max_deformation_m: PerCell,
    /// Whether `max_deformation_m` was measured or is to be identified.
    pub max_deformation: DeformationSource,
    /// Order in which the cells step, cell numbers from 1.
    pub step_order: Vec<usize>,
}

impl Default for Worm {
    fn default() -> Self {
        Self {
            name: "worm1".to_owned(),
            cells: 4,
            mass_kg: 0.333,
            stroke_m: 0.0115,
            cell_spacing_m: 0.040,
            stiffness_n_per_m: PerCell::Same(980.0),
            max_deformation_m: PerCell::Same(0.00175),
            max_deformation: DeformationSource::Measured,
            step_order: vec![1, 2, 3, 4],
        }
    }
}

impl Worm {
    /// The step order with cells counted from 0.
    pub fn step_order_from_zero(&self) -> Vec<usize> {
        self.step_order.iter().map(|cell| cell - 1).collect()
    }

    pub(super) fn check(&self, checker: &mut Checker) {
        checker.require(
            name_is_usable(&self.name),
            "worm.name",
            format!("\"{}\"", self.name),
            "must be 1 to 16 of a-z, 0-9 and '-', beginning with a letter",
        );
        checker.range("worm.cells", self.cells, 2..=MAX_CELLS, "cells");
        checker.range("worm.mass_kg", self.mass_kg, 0.001..=100.0, "kg");
        checker.range("worm.stroke_m", self.stroke_m, 1e-4..=1.0, "m");
        checker.range("worm.cell_spacing_m", self.cell_spacing_m, 1e-3..=1.0, "m");
        self.stiffness_n_per_m
            .check("worm.stiffness_n_per_m", self.cells, 1.0..=1e7, "N/m", checker);
        self.max_deformation_m
            .check("worm.max_deformation_m", self.cells, 1e-6..=0.1, "m", checker);
        let mut sorted = self.step_order.clone();
        sorted.sort_unstable();
        checker.require(
            sorted.iter().copied().eq(1..=self.cells),
            "worm.step_order",
            format!("{:?}", self.step_order),
            format!("must name each cell from 1 to {} once", self.cells),
        );
    }
}

/// A name that is safe in service names, file names and lock files.
fn name_is_usable(name: &str) -> bool {
    (1..=16).contains(&name.len())
        && name.starts_with(|c: char| c.is_ascii_lowercase())
        && name
            .chars()
            .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-')
}

/// The canal.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Canal {
    /// Slope against the horizontal, degrees, positive uphill.
    pub slope_deg: f64,
}

impl Default for Canal {
    fn default() -> Self {
        Self { slope_deg: 0.0 }
    }
}

impl Canal {
    pub(super) fn check(&self, checker: &mut Checker) {
        checker.range("canal.slope_deg", self.slope_deg, -90.0..=90.0, "degrees");
    }
}

/// Which way the worm crawls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Direction {
    /// Cell 1 leads.
    Forward,
    /// The cam turns the other way.
    Backward,
}

impl Direction {
    /// +1 forward, −1 backward.
    pub fn sign(self) -> f64 {
        match self {
            Self::Forward => 1.0,
            Self::Backward => -1.0,
        }
    }
}

/// How the worm crawls.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Gait {
    /// Time of one gait cycle, one turn of the cam, s.
    pub cycle_s: f64,
    /// Which way.
    pub direction: Direction,
    /// Time from rest to full speed and back, s.
    pub ramp_s: f64,
}

impl Default for Gait {
    fn default() -> Self {
        Self {
            cycle_s: 2.5,
            direction: Direction::Forward,
            ramp_s: 0.25,
        }
    }
}

impl Gait {
    pub(super) fn check(&self, checker: &mut Checker) {
        checker.range("gait.cycle_s", self.cycle_s, 0.5..=120.0, "s");
        checker.range("gait.ramp_s", self.ramp_s, 0.01..=10.0, "s");
    }
}
