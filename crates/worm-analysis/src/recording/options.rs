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
    /// Longest time for which a cell may be out of sight, s.
    pub max_gap_s: f64,
    /// Direction up the canal in the space of the markers; without it, it is found from their motion.
    pub axis: Option<Axis>,
}

impl Default for OpenOptions {
    fn default() -> Self {
        Self {
            from_s: None,
            to_s: None,
            max_gap_s: 0.2,
            axis: None,
        }
    }
}

impl OpenOptions {
    /// Refuses times that make no sense.
    ///
    /// # Errors
    /// [`ReadError`] that names the argument and the remedy.
    pub(super) fn check(&self, path: &Path) -> Result<(), ReadError> {
        let refuse = |problem: String, remedy| Err(ReadError::whole(path, problem, remedy));
        for (name, value) in [("--from", self.from_s), ("--to", self.to_s)] {
            if let Some(value) = value.filter(|value| !value.is_finite()) {
                return refuse(format!("{name} {value} is no time"), "give seconds");
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
                format!("--max-gap {} is no length of time", self.max_gap_s),
                "give seconds, 0 or more",
            );
        }
        Ok(())
    }
}
