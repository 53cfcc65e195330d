//! The recording itself: series over a common time.

use super::repair_note::Repair;
use std::path::PathBuf;
use worm_physics::MAX_CELLS;

/// Motor state over time, one value for each sample; `NaN` where not known.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Motor {
    /// Cam angle, rad.
    pub angle_rad: Vec<f64>,
    /// Cam velocity, rad/s.
    pub velocity_rad_s: Vec<f64>,
    /// Current in the winding, A.
    pub current_a: Vec<f64>,
    /// Bus voltage, V.
    pub voltage_v: Vec<f64>,
    /// Duty of the bridge, −1 to 1.
    pub duty: Vec<f64>,
    /// Temperature of the servo, °C.
    pub temperature_c: Vec<f64>,
}

impl Motor {
    /// Column names of the series in a file, in the order of [`series`](Self::series).
    pub const COLUMNS: [&'static str; 6] = [
        "motor_angle_rad",
        "motor_velocity_rad_s",
        "motor_current_a",
        "bus_voltage_v",
        "motor_duty",
        "motor_temperature_c",
    ];

    /// The series, in the order of [`COLUMNS`](Self::COLUMNS).
    pub fn series(&self) -> [&Vec<f64>; 6] {
        [
            &self.angle_rad,
            &self.velocity_rad_s,
            &self.current_a,
            &self.voltage_v,
            &self.duty,
            &self.temperature_c,
        ]
    }

    /// The series to change, in the order of [`COLUMNS`](Self::COLUMNS).
    pub(super) fn series_mut(&mut self) -> [&mut Vec<f64>; 6] {
        [
            &mut self.angle_rad,
            &mut self.velocity_rad_s,
            &mut self.current_a,
            &mut self.voltage_v,
            &mut self.duty,
            &mut self.temperature_c,
        ]
    }
}

/// Cell positions over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Where it comes from, as errors and reports name it.
    pub source: PathBuf,
    /// Name of each cell there: `x1_m`, or a marker's name. Cell 1 first.
    pub cell_names: Vec<String>,
    /// Time of each sample, s, strictly increasing.
    pub time_s: Vec<f64>,
    /// Position along the canal, growing up the canal, m: `position_m[cell][sample]`; `NaN` where not seen.
    pub position_m: Vec<Vec<f64>>,
    /// Gait cycles done, unwrapped, for each sample, where it was recorded; finite.
    pub gait_phase: Option<Vec<f64>>,
    /// Motor state, where it was recorded.
    pub motor: Option<Motor>,
    /// What the reader noticed: ignored columns, markers left out, a truncated end.
    pub warnings: Vec<String>,
    /// What was repaired in it, and what was noticed but left as it is, once it has been checked.
    pub repairs: Vec<Repair>,
}

impl Recording {
    /// Number of cells, 2 to [`MAX_CELLS`].
    pub fn cells(&self) -> usize {
        debug_assert!(self.position_m.len() <= MAX_CELLS, "readers refuse more");
        self.position_m.len()
    }

    /// Whether any cell is seen anywhere: the log of a worm without a tracker has the motor alone.
    pub fn has_positions(&self) -> bool {
        self.position_m.iter().flatten().any(|at_m| at_m.is_finite())
    }

    /// Whether another holds the same times and positions to the last bit, which no two crawls do.
    pub fn is_copy_of(&self, other: &Self) -> bool {
        let same = |one: &[f64], other: &[f64]| {
            one.len() == other.len() && one.iter().zip(other).all(|(a, b)| a.to_bits() == b.to_bits())
        };
        let cells = self.position_m.iter().zip(&other.position_m);
        self.has_positions()
            && self.cells() == other.cells()
            && same(&self.time_s, &other.time_s)
            && cells.into_iter().all(|(one, other)| same(one, other))
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.time_s.len()
    }

    /// Name of a cell in errors and warnings; `cell` counts from 0.
    pub(crate) fn name_of(&self, cell: usize) -> String {
        match self.cell_names.get(cell) {
            Some(name) => format!("cell {} ({name})", cell + 1),
            None => format!("cell {}", cell + 1),
        }
    }

    /// Keeps only the marked samples; those beyond the marks go, too.
    pub(super) fn keep(&mut self, kept: &[bool]) {
        let keep = |series: &mut Vec<f64>| {
            let mut kept = kept.iter();
            series.retain(|_| kept.next().is_some_and(|kept| *kept));
        };
        keep(&mut self.time_s);
        self.position_m.iter_mut().for_each(keep);
        if let Some(phase) = &mut self.gait_phase {
            keep(phase);
        }
        if let Some(motor) = &mut self.motor {
            motor.series_mut().into_iter().for_each(keep);
        }
    }

    /// Keeps only the samples from `from_s` to `to_s`.
    pub(super) fn cut(&mut self, from_s: Option<f64>, to_s: Option<f64>) {
        let begin = from_s.map_or(0, |from_s| self.time_s.partition_point(|&time_s| time_s < from_s));
        let end = to_s.map_or(self.samples(), |to_s| {
            self.time_s.partition_point(|&time_s| time_s <= to_s)
        });
        let keep = |series: &mut Vec<f64>| {
            series.truncate(end);
            series.drain(..begin.min(series.len()));
        };
        keep(&mut self.time_s);
        self.position_m.iter_mut().for_each(keep);
        if let Some(phase) = &mut self.gait_phase {
            keep(phase);
        }
        if let Some(motor) = &mut self.motor {
            motor.series_mut().into_iter().for_each(keep);
        }
    }
}

#[cfg(test)]
mod tests;
