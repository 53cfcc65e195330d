//! The points of one axis of a table, and where a place lies among them.

use super::{Axis, MAX_POINTS, TableError};

/// The points of an axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Grid {
    pub axis: Axis,
    pub at: Vec<f64>,        // ascending
    pub period: Option<f64>, // above the width of the points
}

impl Grid {
    pub fn check(&self) -> Result<(), TableError> {
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
    pub fn about(&self, at: f64) -> (usize, usize, f64, f64) {
        let (points, last) = (&self.at, self.at.len() - 1);
        if last == 0 {
            return (0, 0, 0.0, 0.0);
        }
        let at = match self.period {
            Some(period) => points[0] + (at - points[0]).rem_euclid(period),
            None => at,
        };
        let after = self.points_up_to(at);
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

    /// How many points are at a coordinate or before it. Most grids are even, so that is tried first.
    fn points_up_to(&self, at: f64) -> usize {
        let (points, last) = (&self.at, self.at.len() - 1);
        let evenly = (at - points[0]) / (points[last] - points[0]) * last as f64;
        let before = (evenly as usize).min(last - 1);
        if points[before] <= at && at < points[before + 1] {
            before + 1
        } else {
            points.partition_point(|point| *point <= at)
        }
    }
}
