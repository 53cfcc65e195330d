//! A law that nobody derived: a force, or a factor on friction, given at the points of a grid.
//!
//! A table depends on one or two quantities of a cell ([`Axis`]). Between the points of its grid it is linear, and beyond them it stays as
//! it is at the last one, unless it repeats with a period. It either pushes a cell or scales the friction of its tip ([`ActsOn`]).
//!
//! # When it is evaluated
//! A force that depends on the deformation, its rate, the speed or the load is taken at the end of each increment, as every other force
//! is; all else, and what friction depends on, is taken at its start.

use super::MAX_CELLS;
use std::fmt;
use std::sync::Arc;
use thiserror::Error;

/// Most tables of one worm.
pub const MAX_TABLES: usize = 4;
/// Most points along one axis.
pub const MAX_POINTS: usize = 256;
/// Largest force of a table, N, and largest factor.
const MAX_FORCE_N: f64 = 100.0;
const MAX_FACTOR: f64 = 20.0;

/// What a table depends on, for each cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Deformation of the pad, m: positive where the cell is ahead of its tip.
    Deformation,
    /// Rate at which the deformation changes, m/s.
    DeformationRate,
    /// Velocity of the cell along the canal, m/s.
    Speed,
    /// Force that the drive holds the cell with, N: that of its contact, its weight along the canal and constant forces.
    Load,
    /// Place of the tip along the canal, m.
    Place,
    /// Part of a gait cycle since the cell's own step began, 0 to 1.
    Phase,
    /// Slope of the canal, degrees.
    Slope,
    /// Gait cycles since the motion began.
    Time,
}

impl Axis {
    /// Every axis.
    pub const ALL: [Self; 8] = [
        Self::Deformation,
        Self::DeformationRate,
        Self::Speed,
        Self::Load,
        Self::Place,
        Self::Phase,
        Self::Slope,
        Self::Time,
    ];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Deformation => "deformation",
            Self::DeformationRate => "deformation-rate",
            Self::Speed => "speed",
            Self::Load => "load",
            Self::Place => "place",
            Self::Phase => "phase",
            Self::Slope => "slope",
            Self::Time => "time",
        }
    }

    /// Its unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Deformation | Self::Place => "m",
            Self::DeformationRate | Self::Speed => "m/s",
            Self::Load => "N",
            Self::Phase | Self::Time => "cycles",
            Self::Slope => "deg",
        }
    }

    /// The axis of a name.
    ///
    /// # Errors
    /// [`TableError::Axis`].
    pub fn named(name: &str) -> Result<Self, TableError> {
        let found = Self::ALL.into_iter().find(|axis| axis.name() == name);
        found.ok_or_else(|| TableError::Axis {
            name: name.to_owned(),
            names: Self::ALL.map(Self::name).join(", "),
        })
    }

    /// Whether a force over it must be balanced together with the motion: both change within an increment.
    fn changes_with_motion(self) -> bool {
        matches!(
            self,
            Self::Deformation | Self::DeformationRate | Self::Speed | Self::Load
        )
    }

    /// Whether one cycle cannot be like the next where something depends on it.
    fn is_aperiodic(self) -> bool {
        matches!(self, Self::Place | Self::Time)
    }

    /// Whether it changes its sign for a worm that is seen from the other end of the canal.
    fn is_signed(self) -> bool {
        !matches!(self, Self::Phase | Self::Time)
    }
}

/// What a table gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ActsOn {
    /// A force on each cell beside that of its contact, N, positive towards smaller positions.
    ContactForce,
    /// A factor on the friction of each tip.
    FrictionFactor,
}

impl ActsOn {
    /// Both.
    pub const ALL: [Self; 2] = [Self::ContactForce, Self::FrictionFactor];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::ContactForce => "contact-force",
            Self::FrictionFactor => "friction-factor",
        }
    }

    /// Unit of the values; empty for none.
    pub fn unit(self) -> &'static str {
        match self {
            Self::ContactForce => "N",
            Self::FrictionFactor => "",
        }
    }

    /// The value that changes nothing.
    pub fn neutral(self) -> f64 {
        match self {
            Self::ContactForce => 0.0,
            Self::FrictionFactor => 1.0,
        }
    }

    /// Smallest and largest value.
    pub fn range(self) -> [f64; 2] {
        match self {
            Self::ContactForce => [-MAX_FORCE_N, MAX_FORCE_N],
            Self::FrictionFactor => [0.0, MAX_FACTOR],
        }
    }

    /// What a name means.
    ///
    /// # Errors
    /// [`TableError::ActsOn`].
    pub fn named(name: &str) -> Result<Self, TableError> {
        let found = Self::ALL.into_iter().find(|acts_on| acts_on.name() == name);
        found.ok_or_else(|| TableError::ActsOn { name: name.to_owned() })
    }
}

/// Why a table cannot be used.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum TableError {
    /// No such axis.
    #[error("axis \"{name}\": give one of {names}, or two of them as a list")]
    Axis {
        /// The one given.
        name: String,
        /// All that there are.
        names: String,
    },
    /// Nothing that a table can act on.
    #[error("acts_on = \"{name}\": give \"contact-force\" (values in N) or \"friction-factor\"")]
    ActsOn {
        /// What was given.
        name: String,
    },
    /// None or more than two axes, or one of them twice.
    #[error("{0} axes: give one, or two different ones")]
    Axes(usize),
    /// The grid is no grid.
    #[error("grid of {axis}: {problem}")]
    Grid {
        /// Its axis.
        axis: &'static str,
        /// What is wrong and what to do.
        problem: String,
    },
    /// Values that do not fit the grid.
    #[error("value: {given} values for {expected} points of the grid: give one for each{}", if *two_axes { ", a list for each point of the first axis" } else { "" })]
    Count {
        /// How many were given.
        given: usize,
        /// How many points there are.
        expected: usize,
        /// Whether there are two axes.
        two_axes: bool,
    },
    /// A value out of range.
    #[error("value {value} of {acts_on}: must be from {min} to {max}{unit}")]
    Value {
        /// The one given.
        value: f64,
        /// What it acts on.
        acts_on: &'static str,
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
        /// Its unit, with a space before it; empty for none.
        unit: &'static str,
    },
    /// A period that cannot be one.
    #[error("period = {period}: {problem}")]
    Period {
        /// The one given.
        period: f64,
        /// What is wrong and what to do.
        problem: String,
    },
}

/// The points of an axis.
#[derive(Debug, Clone, PartialEq)]
struct Grid {
    axis: Axis,
    at: Vec<f64>,        // ascending
    period: Option<f64>, // above the width of the points
}

/// A law at the points of a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    acts_on: ActsOn,
    grids: Vec<Grid>, // 1 or 2
    value: Vec<f64>,  // `[of the first axis][of the second]`, flat
}

impl Grid {
    fn check(&self) -> Result<(), TableError> {
        let problem = |problem: String| TableError::Grid {
            axis: self.axis.name(),
            problem,
        };
        if self.at.is_empty() || self.at.len() > MAX_POINTS {
            return Err(problem(format!("{} points: give 1 to {MAX_POINTS}", self.at.len())));
        }
        if let Some(at) = self.at.iter().find(|at| !at.is_finite()) {
            return Err(problem(format!("{at} is no place on it: give finite numbers")));
        }
        if let Some(pair) = self.at.windows(2).find(|pair| pair[1] <= pair[0]) {
            return Err(problem(format!(
                "{} comes after {}: give the points in ascending order, each once",
                pair[1], pair[0]
            )));
        }
        let Some(period) = self.period else {
            return Ok(());
        };
        let width = self.at[self.at.len() - 1] - self.at[0];
        let problem = |problem: String| TableError::Period { period, problem };
        if !(period.is_finite() && period > 0.0) {
            return Err(problem("give a length above 0, or leave it out".to_owned()));
        }
        if width >= period {
            return Err(problem(format!(
                "the grid is {width} wide: it must be narrower than a period, for its end is followed by its beginning"
            )));
        }
        Ok(())
    }

    /// The two points about a coordinate, the part of the way from the first to the second, and what a unit of the coordinate is of that
    /// way: 0 where the table is flat.
    fn about(&self, at: f64) -> (usize, usize, f64, f64) {
        let (points, last) = (&self.at, self.at.len() - 1);
        if last == 0 {
            return (0, 0, 0.0, 0.0);
        }
        let at = match self.period {
            Some(period) => points[0] + (at - points[0]).rem_euclid(period),
            None => at,
        };
        let after = points.partition_point(|point| *point <= at);
        match (after, self.period) {
            (0, _) => (0, 0, 0.0, 0.0),
            (after, None) if after > last => (last, last, 0.0, 0.0),
            (after, Some(period)) if after > last => {
                let way = period - (points[last] - points[0]);
                (last, 0, (at - points[last]) / way, way.recip())
            }
            (after, _) => {
                let way = points[after] - points[after - 1];
                (after - 1, after, (at - points[after - 1]) / way, way.recip())
            }
        }
    }
}

impl Table {
    /// A law over one or two axes, each with the points of its grid; the values of two axes are those of the second one for each point of
    /// the first. The first axis may have a period; that of a phase is 1.
    ///
    /// # Errors
    /// [`TableError`].
    pub fn new(
        acts_on: ActsOn,
        axes: &[(Axis, Vec<f64>)],
        value: Vec<f64>,
        period: Option<f64>,
    ) -> Result<Self, TableError> {
        let is_twice = axes.len() == 2 && axes[0].0 == axes[1].0;
        if !(1..=2).contains(&axes.len()) || is_twice {
            return Err(TableError::Axes(axes.len()));
        }
        let mut grids = Vec::with_capacity(axes.len());
        for (number, (axis, at)) in axes.iter().enumerate() {
            let given = period.filter(|_| number == 0);
            let period = match (axis, given) {
                (Axis::Phase, Some(period)) if period != 1.0 => {
                    return Err(TableError::Period {
                        period,
                        problem: "a phase has the period 1: leave it out".to_owned(),
                    });
                }
                (Axis::Phase, _) => Some(1.0),
                (Axis::Slope, Some(period)) => {
                    return Err(TableError::Period {
                        period,
                        problem: "a slope does not repeat: leave it out".to_owned(),
                    });
                }
                (_, given) => given,
            };
            let grid = Grid {
                axis: *axis,
                at: at.clone(),
                period,
            };
            grid.check()?;
            grids.push(grid);
        }
        let expected = grids.iter().map(|grid| grid.at.len()).product();
        if value.len() != expected {
            return Err(TableError::Count {
                given: value.len(),
                expected,
                two_axes: grids.len() == 2,
            });
        }
        let [min, max] = acts_on.range();
        if let Some(&value) = value.iter().find(|value| !(min..=max).contains(*value)) {
            return Err(TableError::Value {
                value,
                acts_on: acts_on.name(),
                min,
                max,
                unit: if acts_on.unit().is_empty() { "" } else { " N" },
            });
        }
        Ok(Self { acts_on, grids, value })
    }

    /// What it gives.
    pub fn acts_on(&self) -> ActsOn {
        self.acts_on
    }

    /// What it depends on: one quantity or two.
    pub fn axes(&self) -> impl Iterator<Item = Axis> + '_ {
        self.grids.iter().map(|grid| grid.axis)
    }

    /// The points of an axis, 0 or 1.
    pub fn grid(&self, axis: usize) -> &[f64] {
        &self.grids[axis].at
    }

    /// The period of the first axis, where it has one.
    pub fn period(&self) -> Option<f64> {
        self.grids[0].period
    }

    /// The values, for each point of the first axis those of the second.
    pub fn value(&self) -> &[f64] {
        &self.value
    }

    /// The value at a place on each axis, and its derivatives.
    pub(super) fn at(&self, place: impl Fn(Axis) -> f64) -> (f64, [f64; 2]) {
        let (low, high, part, per_unit) = self.grids[0].about(place(self.grids[0].axis));
        let Some(second) = self.grids.get(1) else {
            let (from, to) = (self.value[low], self.value[high]);
            return (from + part * (to - from), [(to - from) * per_unit, 0.0]);
        };
        let width = second.at.len();
        let (left, right, across, per_across) = second.about(place(second.axis));
        let row = |row: usize| {
            let (from, to) = (self.value[row * width + left], self.value[row * width + right]);
            (from + across * (to - from), (to - from) * per_across)
        };
        let ((from, from_slope), (to, to_slope)) = (row(low), row(high));
        (
            from + part * (to - from),
            [(to - from) * per_unit, from_slope + part * (to_slope - from_slope)],
        )
    }

    /// The same law for the worm seen from the other end of the canal.
    fn mirrored(&self) -> Self {
        let mut table = self.clone();
        let width = self.grids.get(1).map_or(1, |grid| grid.at.len());
        let mut rows: Vec<Vec<f64>> = table.value.chunks(width).map(<[f64]>::to_vec).collect();
        for (number, grid) in table.grids.iter_mut().enumerate() {
            if grid.axis.is_signed() {
                grid.at.reverse();
                grid.at.iter_mut().for_each(|at| *at = -*at);
                match number {
                    0 => rows.reverse(),
                    _ => rows.iter_mut().for_each(|row| row.reverse()),
                }
            }
        }
        table.value = rows.concat();
        if self.acts_on == ActsOn::ContactForce {
            table.value.iter_mut().for_each(|value| *value = -*value);
        }
        table
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axes: Vec<&str> = self.axes().map(Axis::name).collect();
        write!(f, "{} over {}", self.acts_on.name(), axes.join(" and "))
    }
}

/// The tables of a worm, each on one cell or on all. Without heap of its own: a clone shares the tables.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tables {
    each: [Option<(Arc<Table>, Option<usize>)>; MAX_TABLES], // the first ones are there
}

/// Where a cell is on every axis.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Whereabouts {
    pub deformation_m: f64,
    pub deformation_rate_m_s: f64,
    pub speed_m_s: f64,
    pub load_n: f64,
    pub place_m: f64,
    pub phase: f64,
    pub slope_deg: f64,
    pub cycles: f64,
}

impl Whereabouts {
    fn on(&self, axis: Axis) -> f64 {
        match axis {
            Axis::Deformation => self.deformation_m,
            Axis::DeformationRate => self.deformation_rate_m_s,
            Axis::Speed => self.speed_m_s,
            Axis::Load => self.load_n,
            Axis::Place => self.place_m,
            Axis::Phase => self.phase,
            Axis::Slope => self.slope_deg,
            Axis::Time => self.cycles,
        }
    }
}

/// How a cell's place on the axes changes with its displacement.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slopes {
    /// Of the deformation.
    pub deformation: f64,
    /// Of the load, N/m.
    pub load_n_per_m: f64,
    /// Inverse of the increment, 1/s.
    pub per_s: f64,
}

impl Slopes {
    fn of(&self, axis: Axis) -> f64 {
        match axis {
            Axis::Deformation => self.deformation,
            Axis::DeformationRate => self.deformation * self.per_s,
            Axis::Speed => self.per_s,
            Axis::Load => self.load_n_per_m,
            Axis::Place | Axis::Phase | Axis::Slope | Axis::Time => 0.0,
        }
    }
}

impl Tables {
    /// Adds a table for one cell (from 0) or all; one more than [`MAX_TABLES`] is left out.
    pub(super) fn push(&mut self, table: &Arc<Table>, cell: Option<usize>) {
        if let Some(free) = self.each.iter_mut().find(|one| one.is_none()) {
            *free = Some((Arc::clone(table), cell));
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.each[0].is_none()
    }

    fn iter(&self) -> impl Iterator<Item = (&Table, Option<usize>)> {
        self.each
            .iter()
            .map_while(Option::as_ref)
            .map(|(table, cell)| (&**table, *cell))
    }

    fn of_cell(&self, cell: usize) -> impl Iterator<Item = &Table> {
        let mine = self.iter().filter(move |(_, of)| of.is_none_or(|of| of == cell));
        mine.map(|(table, _)| table)
    }

    /// Whether one cycle can be like the next: nothing depends on the place or the time.
    pub(super) fn are_periodic(&self) -> bool {
        self.iter().all(|(table, _)| !table.axes().any(Axis::is_aperiodic))
    }

    /// Whether some table is a force.
    #[inline]
    pub(super) fn have_force(&self) -> bool {
        self.iter().any(|(table, _)| table.acts_on == ActsOn::ContactForce)
    }

    /// The factor on the friction of a cell's tip.
    pub(super) fn friction(&self, cell: usize, here: &Whereabouts) -> f64 {
        let factors = self
            .of_cell(cell)
            .filter(|table| table.acts_on == ActsOn::FrictionFactor);
        factors.map(|table| table.at(|axis| here.on(axis)).0).product()
    }

    /// The force on a cell, N, that does not change within an increment.
    pub(super) fn standing_n(&self, cell: usize, here: &Whereabouts) -> f64 {
        let forces = self.of_cell(cell).filter(|table| table.acts_on == ActsOn::ContactForce);
        let standing = forces.filter(|table| !table.axes().any(Axis::changes_with_motion));
        standing.map(|table| table.at(|axis| here.on(axis)).0).sum()
    }

    /// The force on a cell that changes with its motion, N, and its derivative by the cell's displacement, N/m.
    pub(super) fn moving_n(&self, cell: usize, here: &Whereabouts, slopes: &Slopes) -> (f64, f64) {
        let forces = self.of_cell(cell).filter(|table| table.acts_on == ActsOn::ContactForce);
        let moving = forces.filter(|table| table.axes().any(Axis::changes_with_motion));
        moving.fold((0.0, 0.0), |(force_n, slope), table| {
            let (value, by_axis) = table.at(|axis| here.on(axis));
            let by_shift: f64 = table.axes().zip(by_axis).map(|(axis, by)| by * slopes.of(axis)).sum();
            (force_n + value, slope + by_shift)
        })
    }

    /// The largest force that the tables of all cells may have together, N.
    pub(super) fn full_force_n(&self, cells: usize) -> f64 {
        debug_assert!(cells <= MAX_CELLS, "no worm has more");
        let forces = self.iter().filter(|(table, _)| table.acts_on == ActsOn::ContactForce);
        forces
            .map(|(table, cell)| {
                let largest_n = table.value.iter().fold(0.0, |max: f64, value| max.max(value.abs()));
                largest_n * if cell.is_some() { 1.0 } else { cells as f64 }
            })
            .sum()
    }

    /// The same for the worm seen from the other end of the canal.
    pub(super) fn mirrored(&self) -> Self {
        let mut mirrored = Self::default();
        for (table, cell) in self.iter() {
            mirrored.push(&Arc::new(table.mirrored()), cell);
        }
        mirrored
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(axes: &[(Axis, Vec<f64>)], value: &[f64], period: Option<f64>) -> Result<Table, TableError> {
        Table::new(ActsOn::ContactForce, axes, value.to_vec(), period)
    }

    #[test]
    fn it_is_linear_between_points_and_flat_beyond_them() {
        let one = table(&[(Axis::Speed, vec![-1.0, 0.0, 2.0])], &[0.5, 0.0, 1.0], None).expect("a table");
        for (at, value, slope) in [(-3.0, 0.5, 0.0), (-0.5, 0.25, -0.5), (1.0, 0.5, 0.5), (9.0, 1.0, 0.0)] {
            let found = one.at(|_| at);
            assert_eq!((found.0, found.1[0]), (value, slope), "at {at}");
        }
    }

    #[test]
    fn with_a_period_its_end_is_followed_by_its_beginning() {
        let one = table(&[(Axis::Place, vec![0.0, 0.01])], &[0.0, 1.0], Some(0.04)).expect("a table");
        for (at, value) in [(0.005, 0.5), (0.025, 0.5), (-0.015, 0.5), (0.41, 1.0)] {
            assert!((one.at(|_| at).0 - value).abs() < 1e-9, "at {at}: {}", one.at(|_| at).0);
        }
    }

    #[test]
    fn two_axes_are_bilinear() {
        let axes = [(Axis::Place, vec![0.0, 1.0]), (Axis::Slope, vec![0.0, 10.0])];
        let one = table(&axes, &[0.0, 1.0, 2.0, 5.0], None).expect("a table");
        let (value, [along, across]) = one.at(|axis| if axis == Axis::Place { 0.5 } else { 5.0 });
        assert_eq!((value, along), (2.0, 3.0));
        assert!((across - 0.2).abs() < 1e-12);
    }

    #[test]
    fn seen_from_the_other_end_twice_it_is_itself() {
        let axes = [(Axis::Place, vec![0.0, 1.0, 3.0]), (Axis::Speed, vec![-1.0, 10.0])];
        let one = table(&axes, &[0.0, 1.0, 2.0, 5.0, -3.0, 7.0], None).expect("a table");
        let there = one.mirrored();
        let at = |table: &Table, sign: f64| table.at(|axis| sign * if axis == Axis::Place { 0.7 } else { 4.0 }).0;
        assert!((at(&one, 1.0) + at(&there, -1.0)).abs() < 1e-12);
        assert_eq!(there.mirrored(), one);
    }

    #[test]
    fn bad_tables_are_refused_by_what_is_wrong() {
        let place = |at: &[f64]| vec![(Axis::Place, at.to_vec())];
        for (axes, value, period, expected) in [
            (vec![], vec![], None, "0 axes: give one, or two different ones"),
            (place(&[]), vec![], None, "grid of place: 0 points: give 1 to 256"),
            (
                place(&[0.0, 0.0]),
                vec![1.0, 2.0],
                None,
                "grid of place: 0 comes after 0: give the points in ascending order, each once",
            ),
            (
                place(&[0.0, f64::NAN]),
                vec![1.0, 2.0],
                None,
                "grid of place: NaN is no place on it: give finite numbers",
            ),
            (
                place(&[0.0, 1.0]),
                vec![1.0],
                None,
                "value: 1 values for 2 points of the grid: give one for each",
            ),
            (
                place(&[0.0]),
                vec![1e9],
                None,
                "value 1000000000 of contact-force: must be from -100 to 100 N",
            ),
            (
                place(&[0.0, 0.05]),
                vec![0.0, 1.0],
                Some(0.04),
                "period = 0.04: the grid is 0.05 wide: it must be narrower than a period, for its end is followed by its beginning",
            ),
            (
                vec![(Axis::Phase, vec![0.0])],
                vec![0.0],
                Some(0.5),
                "period = 0.5: a phase has the period 1: leave it out",
            ),
        ] {
            let error = table(&axes, &value, period).expect_err(expected).to_string();
            assert_eq!(error, expected);
        }
    }
}
