//! How a recording is to be read.

use super::projection::Axis;
use std::path::Path;
use worm_log::ReadError;

/// What to take from a file and how much may be missing in it.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenOptions {
    /// Leave out what lies before this time, s.
    pub from_s: Option<f64>,
    /// Leave out what lies after this time, s.
    pub to_s: Option<f64>,
    /// Longest time for which a cell may be unseen, s.
    pub max_gap_s: f64,
    /// Direction up the canal in the space of the markers; `None`: found from their motion.
    pub axis: Option<Axis>,
    /// What is wanted of a recording.
    pub wanted: Wanted,
    /// Number of cells of the worm, for a table of the motor alone, which does not say it; `None`: such a table is refused.
    pub cells: Option<usize>,
}

/// What is wanted of a recording: a log or a table may be of a worm without a tracker.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Wanted {
    /// Positions: a log without them is refused.
    #[default]
    Positions,
    /// Positions with the motor at their times; where there is none, the motor's readings will do.
    PositionsOrMotor {
        /// Time over which those are averaged, s; 0 for each as it is.
        window_s: f64,
    },
    /// All readings of the motor, and no positions.
    Motor {
        /// Time over which they are averaged, s; 0 for each as it is.
        window_s: f64,
    },
}

impl Wanted {
    /// The exposure of a usual camera, s: as dense as positions are.
    pub const USUAL_WINDOW_S: f64 = 1.0 / 120.0;
}

impl Default for OpenOptions {
    fn default() -> Self {
        Self {
            from_s: None,
            to_s: None,
            max_gap_s: 0.2,
            axis: None,
            wanted: Wanted::Positions,
            cells: None,
        }
    }
}

impl OpenOptions {
    /// Refuses times that cannot be used.
    ///
    /// # Errors
    /// [`ReadError`] that names the argument and the remedy.
    pub(super) fn check(&self, path: &Path) -> Result<(), ReadError> {
        let refuse = |problem: String, remedy| Err(ReadError::whole(path, problem, remedy));
        for (name, value) in [("--from", self.from_s), ("--to", self.to_s)] {
            if let Some(value) = value.filter(|value| !value.is_finite()) {
                return refuse(format!("{name} {value} is not a time"), "give seconds");
            }
        }
        if let (Some(from_s), Some(to_s)) = (self.from_s, self.to_s)
            && from_s >= to_s
        {
            return refuse(
                format!("--from {from_s} is not before --to {to_s}"),
                "give the earlier time to --from",
            );
        }
        if !(self.max_gap_s >= 0.0 && self.max_gap_s.is_finite()) {
            return refuse(
                format!("--max-gap {} is not a duration", self.max_gap_s),
                "give seconds, 0 or more",
            );
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
