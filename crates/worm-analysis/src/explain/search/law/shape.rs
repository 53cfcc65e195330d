//! The form of a law of which some coefficients are open.

use super::super::parameter::Onset;
use super::grid::parts;
use std::fmt;
use worm_physics::effect::Setting;
use worm_physics::{ActsOn, Axis, MAX_CELLS, Table};

/// Least factor on friction: a tip without any cannot be solved for.
const MIN_FACTOR: f64 = 0.05;

/// When a law acts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::explain) enum Acts {
    Throughout,
    /// Before and after, the plant moves as without it.
    Within(Onset),
    Never,
}

/// A law at the points of a grid: its values are a centre and a sum of columns, each with a coefficient.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::explain) struct LawShape {
    pub acts_on: ActsOn,
    /// One axis or two, each with the points of its grid.
    pub axes: Vec<(Axis, Vec<f64>)>,
    /// Of the first axis.
    pub period: Option<f64>,
    /// How far it remembers, s, where an axis does.
    pub memory_s: Option<f64>,
    /// The cell that it is about, from 0; all for none.
    pub cell: Option<usize>,
    /// Values with all coefficients 0.
    pub centre: Vec<f64>,
    /// `[coefficient][point]`.
    pub columns: Vec<Vec<f64>>,
}

impl LawShape {
    /// A law that changes nothing, with a coefficient for the value at each point.
    pub fn of_points(acts_on: ActsOn, axes: Vec<(Axis, Vec<f64>)>, cell: Option<usize>) -> Self {
        let points: usize = axes.iter().map(|(_, grid)| grid.len()).product();
        Self {
            acts_on,
            axes,
            period: None,
            memory_s: None,
            cell,
            centre: vec![acts_on.neutral(); points],
            columns: Vec::new(),
        }
        .with_each_point()
    }

    /// The same about some values beyond neutral, without coefficients.
    pub fn about(mut self, beyond: &[f64]) -> Self {
        let neutral = self.acts_on.neutral();
        self.centre = beyond.iter().map(|beyond| neutral + beyond).collect();
        self.columns = Vec::new();
        self
    }

    /// The same with a coefficient for the value at each point.
    pub fn with_each_point(mut self) -> Self {
        let points = self.centre.len();
        let hat = |point: usize| (0..points).map(|other| f64::from(u8::from(other == point))).collect();
        self.columns = (0..points).map(hat).collect();
        self
    }

    /// Values at all points, within what the physics allow.
    pub fn value(&self, coefficients: &[f64]) -> Vec<f64> {
        let [min, max] = self.acts_on.range();
        let min = if self.acts_on == ActsOn::FrictionFactor {
            MIN_FACTOR
        } else {
            min
        };
        let mut value = self.centre.clone();
        for (column, coefficient) in self.columns.iter().zip(coefficients) {
            for (value, by) in value.iter_mut().zip(column) {
                *value += coefficient * by;
            }
        }
        value.iter_mut().for_each(|value| *value = value.clamp(min, max));
        value
    }

    /// When the law acts with some coefficients: one over time alone, where its values are others than none.
    pub fn acts(&self, coefficients: &[f64]) -> Acts {
        let [(Axis::Time, grid)] = &self.axes[..] else {
            return Acts::Throughout;
        };
        let value = self.value(coefficients);
        let is_some = |value: &f64| *value != self.acts_on.neutral();
        let (Some(first), Some(last)) = (value.iter().position(is_some), value.iter().rposition(is_some)) else {
            return Acts::Never;
        };
        let onset = Onset {
            begins: first.checked_sub(1).map(|before| grid[before]),
            ends: grid.get(last + 1).copied(),
            run: None,
        };
        match onset.begins.or(onset.ends) {
            Some(_) if self.period.is_none() => Acts::Within(onset),
            _ => Acts::Throughout,
        }
    }

    /// The law with some coefficients; none where that is no table.
    pub fn table(&self, coefficients: &[f64]) -> Option<Table> {
        let table = Table::new(self.acts_on, &self.axes, self.value(coefficients), self.period).ok()?;
        match self.memory_s {
            Some(memory_s) => table.with_memory(memory_s).ok(),
            None => Some(table),
        }
    }

    /// The same law for a crawl that counts its cycles from so many after the start of the run.
    pub fn counted_from(mut self, cycles: f64) -> Self {
        let over_time = self.axes.iter_mut().filter(|(axis, _)| *axis == Axis::Time);
        over_time.for_each(|(_, grid)| grid.iter_mut().for_each(|at| *at -= cycles));
        self
    }

    /// Whether it is another form of one law: over the same axes, but remembered for another time.
    pub fn is_over_the_same(&self, other: &Self) -> bool {
        let axes = |shape: &Self| -> Vec<Axis> { shape.axes.iter().map(|(axis, _)| *axis).collect() };
        (self.acts_on, self.cell) == (other.acts_on, other.cell) && axes(self) == axes(other)
    }

    /// Values at the points of the grid, read at those of another over the same axes: linear between points, flat beyond them.
    pub fn onto(&self, values: &[f64], other: &Self) -> Vec<f64> {
        let second = other.axes.get(1).map_or(1, |(_, grid)| grid.len());
        let value = |point: usize| {
            let along = |axis: usize| other.axes[axis].1[if axis == 0 { point / second } else { point % second }];
            let all = parts(&self.axes, along).into_iter();
            all.map(|(place, part)| part * values[place]).sum()
        };
        (0..other.centre.len()).map(value).collect()
    }

    /// The law as a setting of the physics.
    pub fn setting(&self, coefficients: &[f64]) -> Option<Setting> {
        let table = self.table(coefficients)?;
        let setting = if self.acts_on.is_of_motor() {
            Setting::of_servo_table(table)
        } else {
            Setting::of_table(table, self.cell, MAX_CELLS)
        };
        setting.ok()
    }
}

/// What it acts on, over what.
impl fmt::Display for LawShape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axes: Vec<&str> = self.axes.iter().map(|(axis, _)| axis.name()).collect();
        write!(f, "{} over {}", self.acts_on.name(), axes.join(" and "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_between_points_and_flat_beyond_them() {
        let over = |axes: &[(Axis, &[f64])]| {
            let axes = axes.iter().map(|(axis, grid)| (*axis, grid.to_vec()));
            LawShape::of_points(ActsOn::ContactForce, axes.collect(), None)
        };
        let one = over(&[(Axis::Deformation, &[-1.0, 0.0, 2.0])]);
        let wider = over(&[(Axis::Deformation, &[-3.0, -1.0, -0.25, 1.5, 4.0])]);
        assert_eq!(one.onto(&[4.0, 0.0, 8.0], &wider), [4.0, 4.0, 1.0, 6.0, 8.0]);
        let two = over(&[(Axis::GearLoad, &[0.0, 1.0]), (Axis::MotorSpeed, &[0.0, 2.0, 4.0])]);
        let between = over(&[(Axis::GearLoad, &[0.5, 1.0]), (Axis::MotorSpeed, &[1.0, 9.0])]);
        let values = [0.0, 2.0, 4.0, 10.0, 12.0, 14.0];
        assert_eq!(two.onto(&values, &between), [6.0, 9.0, 11.0, 14.0]);
    }
}
