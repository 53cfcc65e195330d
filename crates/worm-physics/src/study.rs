//! The design study: Tables 1 and 2 of the paper for any worm, number of cells and slope.
//!
//! # What varies and what stays
//! A study asks "what if this worm had more or fewer cells, on that slope?". Each design therefore keeps the mass per
//! cell, the contact, the stroke, gravity and the resisting force of the base worm.
//! - With the base worm's own number of cells it *is* the base worm: its unequal contacts, masses, strokes and step order
//!   count as they are. So `study` on the robot's configuration answers for the robot.
//! - With another number of cells the properties of added cells are unknown: all cells get the mean contact and the mean mass of the
//!   base worm and its full stroke. If the base cells are unequal, its own row therefore differs a little from the trend of the
//!   others, as it should.
//!
//! Effects act on every design. One that names a cell means the cell of that number; a design without it is refused.

use super::cycle::{Outcome, steady_cycle_of};
use super::effect::{Setting, SettingError};
use super::physics::Physics;
use super::worm::{Contact, Worm, WormError};
use serde::Serialize;
use std::fmt;
use thiserror::Error;

/// Why a design makes no progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failure {
    /// It ends each cycle further back, or cannot hold at all.
    SlidesDown,
    /// Its stroke is used up by the compliance of the contacts.
    StandsStill,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::SlidesDown => "slides down",
            Self::StandsStill => "stands still",
        })
    }
}

/// One design on one slope. Figures are absent (null in JSON) where it fails to progress.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Number of cells.
    pub cells: usize,
    /// Slope, degrees, positive uphill.
    pub slope_deg: f64,
    /// Whether the worm advances.
    pub progresses: bool,
    /// Advance per gait cycle, m.
    pub advance_m: Option<f64>,
    /// Positive actuator work per cycle, J.
    pub energy_positive_j: Option<f64>,
    /// Net actuator work per cycle (13), equal to the losses (11), J.
    pub energy_net_j: Option<f64>,
    /// Cost of transport, positive work over m g L.
    pub cot: Option<f64>,
    /// Positive work over the advance, J/m.
    pub energy_per_distance_j_per_m: Option<f64>,
    /// Why it does not progress, for the tables.
    #[serde(skip)]
    pub failure: Option<Failure>,
}

impl Row {
    /// Computes the steady cycle of a worm, in gait cycles of `cycle_s`, and takes its figures.
    pub fn of(physics: &Physics, slope_deg: f64, cycle_s: f64) -> Self {
        let worm = &physics.worm;
        let outcome = steady_cycle_of(physics, cycle_s);
        let progress = outcome.cycle().filter(|cycle| cycle.progresses);
        let failure = match &outcome {
            Outcome::SlidesDown(_) => Some(Failure::SlidesDown),
            Outcome::Steady(cycle) if cycle.progresses => None,
            Outcome::Steady(cycle) if cycle.slips_back(worm) => Some(Failure::SlidesDown),
            Outcome::Steady(_) => Some(Failure::StandsStill),
        };
        Self {
            cells: worm.cells(),
            slope_deg,
            progresses: progress.is_some(),
            advance_m: progress.map(|cycle| cycle.advance_m),
            energy_positive_j: progress.map(|cycle| cycle.energy_actuator_positive_j),
            energy_net_j: progress.map(|cycle| cycle.energy_actuator_net_j),
            cot: progress.and_then(|cycle| cycle.cot),
            energy_per_distance_j_per_m: progress.and_then(|cycle| cycle.energy_per_distance_j_per_m),
            failure,
        }
    }
}

/// The worm of a design with `cells` cells in a canal of `slope_deg` degrees; the module's documentation says what it
/// has in common with the base worm.
///
/// # Errors
/// [`WormError`] when the number of cells or the slope is out of its range.
pub fn design(base: &Worm, cells: usize, slope_deg: f64) -> Result<Worm, WormError> {
    let slope_rad = slope_deg.to_radians();
    if cells == base.cells() {
        return base.clone().with_slope_rad(slope_rad);
    }
    let count = base.cells() as f64;
    let mean = |quantity: fn(&Contact) -> f64| base.contacts().iter().map(quantity).sum::<f64>() / count;
    let contact = Contact {
        stiffness_n_per_m: mean(|contact| contact.stiffness_n_per_m),
        forward_bound_m: mean(|contact| contact.forward_bound_m),
        backward_bound_m: mean(|contact| contact.backward_bound_m),
    };
    let mass_kg = base.mass_kg() / count * cells as f64;
    Worm::uniform(cells, contact, mass_kg, base.stroke_m())?
        .with_gravity_m_per_s2(base.gravity_m_per_s2())?
        .with_resisting_force_n(base.resisting_force_n())?
        .with_slope_rad(slope_rad)
}

/// The designs to compare, and the conditions.
#[derive(Debug, Clone, Copy)]
pub struct Study<'a> {
    /// The worm that the designs are made from, without effects.
    pub base: &'a Worm,
    /// Effects on every design.
    pub effects: &'a [Setting],
    /// Numbers of cells.
    pub cells: &'a [usize],
    /// Slopes, degrees, positive uphill.
    pub slopes_deg: &'a [f64],
    /// Time of a gait cycle, s, for effects that depend on time.
    pub cycle_s: f64,
}

/// Why a study is refused.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum StudyError {
    /// A design is not valid.
    #[error(transparent)]
    Worm(#[from] WormError),
    /// An effect names a cell that a design does not have.
    #[error("a design of {cells} cells: {source}: leave the effect out, or that number of cells")]
    Effect {
        /// Cells of the design.
        cells: usize,
        /// What is wrong with the effect.
        source: SettingError,
    },
}

/// The rows for every number of cells on every slope, cells outermost, in the order given.
///
/// # Errors
/// [`StudyError`] when a number of cells or a slope is out of its range, or an effect does not fit a design.
pub fn study(study: &Study<'_>) -> Result<Vec<Row>, StudyError> {
    let mut rows = Vec::with_capacity(study.cells.len() * study.slopes_deg.len());
    for &cells in study.cells {
        for &slope_deg in study.slopes_deg {
            let worm = design(study.base, cells, slope_deg)?;
            for effect in study.effects {
                effect
                    .check_cells(cells)
                    .map_err(|source| StudyError::Effect { cells, source })?;
            }
            let physics = Physics::of(worm).with(study.effects);
            rows.push(Row::of(&physics, slope_deg, study.cycle_s));
        }
    }
    Ok(rows)
}

/// Why a battery is refused.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum BatteryError {
    /// The energy is out of range.
    #[error("battery energy {0} J: give a finite number above 0")]
    Energy(f64),
    /// The efficiency is out of range.
    #[error("drive efficiency {0}: give a number above 0 and at most 1")]
    Efficiency(f64),
}

/// A battery and the drive between it and the cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Battery {
    energy_j: f64,         // above 0
    drive_efficiency: f64, // in 0..=1, above 0
}

/// Range of a design on a battery.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Distance, m.
    pub distance_m: f64,
    /// Gait cycles.
    pub cycles: f64,
}

impl Battery {
    /// A battery of so much energy, J, of which the drive turns a fraction (above 0, at most 1) into positive actuator work.
    ///
    /// # Errors
    /// [`BatteryError`].
    pub fn new(energy_j: f64, drive_efficiency: f64) -> Result<Self, BatteryError> {
        if !(energy_j > 0.0 && energy_j.is_finite()) {
            return Err(BatteryError::Energy(energy_j));
        }
        if !(drive_efficiency > 0.0 && drive_efficiency <= 1.0) {
            return Err(BatteryError::Efficiency(drive_efficiency));
        }
        Ok(Self {
            energy_j,
            drive_efficiency,
        })
    }

    /// Its energy, J.
    pub fn energy_j(&self) -> f64 {
        self.energy_j
    }

    /// Range of a design; none if the design does not progress or needs no energy (sliding downhill).
    pub fn range(&self, row: &Row) -> Option<Range> {
        let (advance_m, cycle_j) = row
            .advance_m
            .zip(row.energy_positive_j.filter(|&energy_j| energy_j > 0.0))?;
        let cycles = self.energy_j * self.drive_efficiency / cycle_j;
        Some(Range {
            distance_m: cycles * advance_m,
            cycles,
        })
    }
}

/// Tables 1 and 2 as text, in mm, mJ, COT and J/m; with a battery, a third table of ranges.
#[derive(Debug, Clone, Copy)]
pub struct Tables<'a> {
    /// The rows of a study.
    pub rows: &'a [Row],
    /// The battery to give ranges for.
    pub battery: Option<Battery>,
}

impl fmt::Display for Tables<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "Table 1. Distance (mm) and energy (mJ) per cycle")?;
        self.table(f, &["mm", "mJ"], |row| {
            Some([
                format!("{:.2}", 1e3 * row.advance_m?),
                format!("{:.1}", 1e3 * row.energy_positive_j?),
            ])
        })?;
        writeln!(f, "\nTable 2. Cost of transport and energy per distance (J/m)")?;
        self.table(f, &["COT", "J/m"], |row| {
            let cot = row.cot.map_or_else(|| "-".to_owned(), |cot| format!("{cot:.1}"));
            Some([cot, format!("{:.1}", row.energy_per_distance_j_per_m?)])
        })?;
        if let Some(battery) = self.battery {
            let percent = 100.0 * battery.drive_efficiency;
            writeln!(
                f,
                "\nTable 3. Range on {} J at {percent:.0} % drive efficiency",
                battery.energy_j
            )?;
            self.table(f, &["m", "cycles"], |row| {
                let range = battery.range(row)?;
                Some([format!("{:.1}", range.distance_m), format!("{:.0}", range.cycles)])
            })?;
        }
        Ok(())
    }
}

/// Width of one figure's column.
const COLUMN: usize = 8;

impl Tables<'_> {
    /// One table: a line for each number of cells, two figures for each slope, in the order of the rows.
    fn table(
        &self,
        f: &mut fmt::Formatter<'_>,
        heads: &[&str; 2],
        figures: impl Fn(&Row) -> Option<[String; 2]>,
    ) -> fmt::Result {
        let wide = 2 * COLUMN;
        let first_cells = self.rows.first().map(|row| row.cells);
        let first_line = self.rows.iter().take_while(|row| Some(row.cells) == first_cells);
        write!(f, "{:8}", "")?;
        for row in first_line.clone() {
            write!(f, " | {:>wide$}", format!("{}°", row.slope_deg))?;
        }
        write!(f, "\n{:8}", "")?;
        for _ in first_line {
            write!(f, " | {:>COLUMN$}{:>COLUMN$}", heads[0], heads[1])?;
        }
        let mut line_cells = None;
        for row in self.rows {
            if line_cells != Some(row.cells) {
                line_cells = Some(row.cells);
                write!(f, "\n{:8}", format!("{} cells", row.cells))?;
            }
            match (figures(row), row.failure) {
                (Some([first, second]), _) => write!(f, " | {first:>COLUMN$}{second:>COLUMN$}")?,
                (None, Some(failure)) => write!(f, " | {failure:>wide$}")?,
                (None, None) => write!(f, " | {:>wide$}", "no energy")?,
            }
        }
        writeln!(f)
    }
}
