//! A law that nobody derived: a force, a factor on friction, a displacement in the body, or a torque in the motor, given at the points of a
//! grid.
//!
//! A table depends on one or two quantities of a cell, or of the motor ([`Axis`]). Between the points of its grid it is linear, and beyond
//! them it stays as it is at the last one, unless it repeats with a period. It pushes a cell, scales the friction of its tip, moves where
//! the drive holds it, or turns and brakes the motor ([`ActsOn`]); those of the motor stand in [`crate::servo::ServoLaws`].
//!
//! # When it is evaluated
//! A force that depends on the deformation, now or recently, its rate, the speed or the load is taken at the end of each increment, as every
//! other force is; all else, and what friction depends on, is taken at its start. A displacement by one of these five goes half of its way in
//! each increment, so that a drive which yields under load as much as its pad does is still stable.
//!
//! # Memory
//! Two axes depend on what was before, with weights exp(−age/`memory_s`): the deformation beyond its own mean, and how far the tip has slid. A
//! force in proportion to the first is that of a spring with a dashpot in series (Maxwell), as pads have that creep; friction that falls with the
//! second is held again after a rest, as breakaway friction is.

mod axis;
mod error;
mod grid;
mod set;

pub use axis::{ActsOn, Axis};
pub use error::TableError;
use grid::Grid;
pub use set::Tables;
pub(super) use set::{Slopes, Whereabouts};
use std::fmt;

/// Most tables of one worm.
pub const MAX_TABLES: usize = 4;
/// Most points along one axis.
pub const MAX_POINTS: usize = 256;

/// How far a table remembers where nothing else is said, s; and the shortest and the longest time that may be said.
const MEMORY_S: f64 = 1.0;
const MEMORIES_S: [f64; 2] = [1e-3, 1e4];

/// A law at the points of a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    acts_on: ActsOn,
    grids: Vec<Grid>, // 1 or 2
    value: Vec<f64>,  // `[of the first axis][of the second]`, flat
    memory_s: f64,    // of an axis that has one
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
        if let Some((axis, _)) = axes.iter().find(|(axis, _)| !acts_on.may_depend_on(*axis)) {
            let may = Axis::ALL.into_iter().filter(|axis| acts_on.may_depend_on(*axis));
            return Err(TableError::Dependence {
                acts_on: acts_on.name(),
                axis: axis.name(),
                names: may.map(Axis::name).collect::<Vec<_>>().join(", "),
            });
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
                unit: acts_on.unit(),
            });
        }
        Ok(Self {
            acts_on,
            grids,
            value,
            memory_s: MEMORY_S,
        })
    }

    /// The same with another time that it remembers, s, than one second: that in which what was is forgotten down to 1/e.
    ///
    /// # Errors
    /// [`TableError::Memory`].
    pub fn with_memory(self, memory_s: f64) -> Result<Self, TableError> {
        let refuse = |problem| Err(TableError::Memory { memory_s, problem });
        let [min_s, max_s] = MEMORIES_S;
        if !self.axes().any(Axis::has_memory) {
            let axes = [Axis::RecentDeformation, Axis::RecentSlide]
                .map(Axis::name)
                .join(" or ");
            return refuse(format!("only a table over {axes} remembers: leave it out"));
        }
        if !(min_s..=max_s).contains(&memory_s) {
            return refuse(format!("must be from {min_s} to {max_s} s"));
        }
        Ok(Self { memory_s, ..self })
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

    /// How far it remembers, s; none where it has no axis that does.
    pub fn memory_s(&self) -> Option<f64> {
        self.axes().any(Axis::has_memory).then_some(self.memory_s)
    }

    /// The values, for each point of the first axis those of the second.
    pub fn value(&self) -> &[f64] {
        &self.value
    }

    /// The value at a place on each axis, and its derivatives.
    pub(crate) fn at(&self, place: impl Fn(Axis) -> f64) -> (f64, [f64; 2]) {
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

    /// The same law for a worm of some cells seen from the other end of the canal.
    fn mirrored(&self, cells: usize) -> Self {
        let mut table = self.clone();
        // For each axis the points in their new order, by the old number.
        let orders = table.grids.iter_mut().map(|grid| {
            let there = |at: &f64| grid.axis.mirrored(*at, cells);
            let mirrored: Vec<f64> = grid.at.iter().map(there).collect();
            let mut order: Vec<usize> = (0..mirrored.len()).collect();
            order.sort_by(|&a, &b| mirrored[a].total_cmp(&mirrored[b]));
            grid.at = order.iter().map(|&point| mirrored[point]).collect();
            order
        });
        let orders: Vec<Vec<usize>> = orders.collect();
        let across = orders.get(1).map_or(&[0][..], Vec::as_slice);
        let sign = match self.acts_on {
            ActsOn::ContactForce | ActsOn::DriveDisplacement => -1.0,
            ActsOn::FrictionFactor | ActsOn::MotorFriction | ActsOn::MotorTorque => 1.0,
        };
        let points = orders[0]
            .iter()
            .flat_map(|row| across.iter().map(move |column| (row, column)));
        table.value = points
            .map(|(row, column)| sign * self.value[row * across.len() + column])
            .collect();
        table
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axes: Vec<&str> = self.axes().map(Axis::name).collect();
        write!(f, "{} over {}", self.acts_on.name(), axes.join(" and "))
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
        let there = one.mirrored(4);
        let at = |table: &Table, sign: f64| table.at(|axis| sign * if axis == Axis::Place { 0.7 } else { 4.0 }).0;
        assert!((at(&one, 1.0) + at(&there, -1.0)).abs() < 1e-12);
        assert_eq!(there.mirrored(4), one);
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
            (
                vec![(Axis::GearLoad, vec![0.0])],
                vec![0.0],
                None,
                "acts_on = \"contact-force\" cannot depend on gear-load: give deformation, deformation-rate, recent-deformation, speed, \
                 load, place, recent-slide, phase, slope, time",
            ),
        ] {
            let error = table(&axes, &value, period).expect_err(expected).to_string();
            assert_eq!(error, expected);
        }
    }
}
