//! The tables of a worm, evaluated where its cells are.

use super::{ActsOn, Axis, Table};
use crate::{MAX_CELLS, MAX_TABLES};
use std::sync::Arc;

/// The tables of a worm, each on one cell or on all. Without heap of its own: a clone shares the tables.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tables {
    each: [Option<(Arc<Table>, Option<usize>)>; MAX_TABLES], // the first ones are there
}

/// Where a cell is on every axis.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Whereabouts {
    pub deformation_m: f64,
    pub deformation_rate_m_s: f64,
    pub speed_m_s: f64,
    pub load_n: f64,
    /// These two for each table, by the time that it remembers.
    pub recent_deformation_m: [f64; MAX_TABLES],
    pub recent_slide_m: [f64; MAX_TABLES],
    pub place_m: f64,
    pub phase: f64,
    pub slope_deg: f64,
    pub cycles: f64,
}

impl Whereabouts {
    fn on(&self, axis: Axis, table: usize) -> f64 {
        match axis {
            Axis::Deformation => self.deformation_m,
            Axis::DeformationRate => self.deformation_rate_m_s,
            Axis::RecentDeformation => self.recent_deformation_m[table],
            Axis::Speed => self.speed_m_s,
            Axis::Load => self.load_n,
            Axis::Place => self.place_m,
            Axis::RecentSlide => self.recent_slide_m[table],
            Axis::Phase => self.phase,
            Axis::Slope => self.slope_deg,
            Axis::Time => self.cycles,
            // A table of a worm depends on none of these.
            Axis::MotorSpeed | Axis::GearLoad | Axis::OutputLoad | Axis::MotorAngle => 0.0,
        }
    }
}

/// How a cell's place on the axes changes with its displacement.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slopes {
    /// Of the deformation.
    pub deformation: f64,
    /// Of the load, N/m.
    pub load_n_per_m: f64,
    /// Inverse of the increment, 1/s.
    pub per_s: f64,
    /// What each table still remembers after the increment, a fraction.
    pub remembered: [f64; MAX_TABLES],
}

impl Slopes {
    fn of(&self, axis: Axis, table: usize) -> f64 {
        match axis {
            Axis::Deformation => self.deformation,
            Axis::RecentDeformation => self.deformation * self.remembered[table],
            Axis::DeformationRate => self.deformation * self.per_s,
            Axis::Speed => self.per_s,
            Axis::Load => self.load_n_per_m,
            Axis::Place
            | Axis::RecentSlide
            | Axis::Phase
            | Axis::Slope
            | Axis::Time
            | Axis::MotorSpeed
            | Axis::GearLoad
            | Axis::OutputLoad
            | Axis::MotorAngle => 0.0,
        }
    }
}

impl Tables {
    /// Adds a table for one cell (from 0) or all; one more than [`MAX_TABLES`] is left out.
    pub(crate) fn push(&mut self, table: &Arc<Table>, cell: Option<usize>) {
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

    /// The tables of a cell that give something, each with its number among all.
    fn of_cell(&self, cell: usize, acts_on: ActsOn) -> impl Iterator<Item = (usize, &Table)> {
        let mine = self
            .iter()
            .enumerate()
            .filter(move |(_, (table, of))| table.acts_on == acts_on && of.is_none_or(|of| of == cell));
        mine.map(|(number, (table, _))| (number, table))
    }

    /// What each table still remembers after a time, a fraction of what it did.
    pub(crate) fn remembered_after(&self, step_s: f64) -> [f64; MAX_TABLES] {
        let mut remembered = [0.0; MAX_TABLES];
        for (left, (table, _)) in remembered.iter_mut().zip(self.iter()) {
            *left = (-step_s / table.memory_s).exp();
        }
        remembered
    }

    /// Whether one cycle can be like the next: nothing depends on the place or the time.
    pub(crate) fn are_periodic(&self) -> bool {
        self.iter().all(|(table, _)| !table.axes().any(Axis::is_aperiodic))
    }

    /// The period with which the canal repeats, m, where that is all that keeps one cycle from being like the next: every table that
    /// depends on the place has it, and none depends on the time.
    pub(crate) fn period_along_canal_m(&self) -> Option<f64> {
        let aperiodic = self
            .iter()
            .map(|(table, _)| table)
            .filter(|table| table.axes().any(Axis::is_aperiodic));
        let mut periods = aperiodic.map(|table| {
            let repeats = table.axes().next() == Some(Axis::Place) && !table.axes().skip(1).any(Axis::is_aperiodic);
            table.period().filter(|_| repeats)
        });
        let first = periods.next()??;
        periods.all(|period| period == Some(first)).then_some(first)
    }

    /// Whether some table is a force.
    #[inline]
    pub(crate) fn have_force(&self) -> bool {
        self.iter().any(|(table, _)| table.acts_on == ActsOn::ContactForce)
    }

    /// The factor on the friction of a cell's tip.
    pub(crate) fn friction(&self, cell: usize, here: &Whereabouts) -> f64 {
        let factors = self.of_cell(cell, ActsOn::FrictionFactor);
        factors
            .map(|(number, table)| table.at(|axis| here.on(axis, number)).0)
            .product()
    }

    /// The force on a cell, N, that does not change within an increment.
    pub(crate) fn standing_n(&self, cell: usize, here: &Whereabouts) -> f64 {
        let forces = self.of_cell(cell, ActsOn::ContactForce);
        let standing = forces.filter(|(_, table)| !table.axes().any(Axis::changes_with_motion));
        standing
            .map(|(number, table)| table.at(|axis| here.on(axis, number)).0)
            .sum()
    }

    /// The force on a cell that changes with its motion, N, and its derivative by the cell's displacement, N/m.
    pub(crate) fn moving_n(&self, cell: usize, here: &Whereabouts, slopes: &Slopes) -> (f64, f64) {
        let forces = self.of_cell(cell, ActsOn::ContactForce);
        let moving = forces.filter(|(_, table)| table.axes().any(Axis::changes_with_motion));
        moving.fold((0.0, 0.0), |(force_n, slope), (number, table)| {
            let (value, by_axis) = table.at(|axis| here.on(axis, number));
            let by_axis = table.axes().zip(by_axis);
            let by_shift: f64 = by_axis.map(|(axis, by)| by * slopes.of(axis, number)).sum();
            (force_n + value, slope + by_shift)
        })
    }

    /// How far ahead of its cam the drive holds a cell, m: by what does not change with the motion, and by what does.
    pub(crate) fn displacement_m(&self, cell: usize, here: &Whereabouts) -> [f64; 2] {
        let mine = self.of_cell(cell, ActsOn::DriveDisplacement);
        mine.fold([0.0; 2], |[standing_m, moving_m], (number, table)| {
            let by_m = table.at(|axis| here.on(axis, number)).0;
            if table.axes().any(Axis::changes_with_motion) {
                [standing_m, moving_m + by_m]
            } else {
                [standing_m + by_m, moving_m]
            }
        })
    }

    /// The largest force that the tables of all cells may have together, N.
    pub(crate) fn full_force_n(&self, cells: usize) -> f64 {
        debug_assert!(cells <= MAX_CELLS, "no worm has more");
        let forces = self.iter().filter(|(table, _)| table.acts_on == ActsOn::ContactForce);
        forces
            .map(|(table, cell)| {
                let largest_n = table.value.iter().fold(0.0, |max: f64, value| max.max(value.abs()));
                largest_n * if cell.is_some() { 1.0 } else { cells as f64 }
            })
            .sum()
    }

    /// The same for the worm, of some cells, seen from the other end of the canal.
    pub(crate) fn mirrored(&self, cells: usize) -> Self {
        let mut mirrored = Self::default();
        for (table, cell) in self.iter() {
            mirrored.push(&Arc::new(table.mirrored(cells)), cell);
        }
        mirrored
    }
}
