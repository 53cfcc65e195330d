//! What was not seen: short gaps may be bridged, long ones would be invented.

use super::series::Recording;
use std::ops::Range;
use worm_log::ReadError;

/// Times computed from frame numbers differ by rounding; so much more than the longest gap is not longer.
const TIME_ROUNDING_S: f64 = 1e-9;

impl Recording {
    /// Positions with their gaps bridged by straight lines, `[cell][sample]`, m. What lies before a cell was first seen or
    /// after it was last seen stays `NaN`. The recording keeps what was measured apart from what was bridged.
    pub fn filled(&self) -> Vec<Vec<f64>> {
        let mut position_m = self.position_m.clone();
        for series in &mut position_m {
            bridge(&self.time_s, series);
        }
        position_m
    }

    /// Checks that no cell is out of sight, and no sample missing, for longer than `max_gap_s`.
    ///
    /// # Errors
    /// [`ReadError`] with the cell and the times between which it is not seen.
    pub fn check_gaps(&self, max_gap_s: f64) -> Result<(), ReadError> {
        for (cell, series) in self.position_m.iter().enumerate() {
            if let Some(gap) = holes(series)
                .map(|hole| self.gap(&hole))
                .find(|gap| is_longer(gap.to_s - gap.from_s, max_gap_s))
            {
                return Err(gap.refusal(self, cell, max_gap_s));
            }
        }
        Ok(())
    }

    fn gap(&self, hole: &Range<usize>) -> Gap {
        Gap {
            from_s: self.time_s[hole.start.saturating_sub(1)],
            to_s: self.time_s[hole.end.min(self.samples() - 1)],
            at_edge: hole.start == 0 || hole.end == self.samples(),
        }
    }
}

/// A time for which a cell is not seen; `from_s` and `to_s` are when it is seen next to it, or the recording's ends.
struct Gap {
    from_s: f64,
    to_s: f64,
    at_edge: bool,
}

impl Gap {
    fn refusal(&self, recording: &Recording, cell: usize, max_gap_s: f64) -> ReadError {
        let Self { from_s, to_s, at_edge } = self;
        let length_s = to_s - from_s;
        let cut = if *at_edge { "cut it off" } else { "leave it out" };
        ReadError::whole(
            &recording.source,
            format!(
                "{} is not seen from {from_s:.3} s to {to_s:.3} s, for {length_s:.3} s, and {max_gap_s} s may be bridged",
                recording.name_of(cell)
            ),
            format!(
                "give --max-gap {:.1} to accept it, or {cut} with --from or --to",
                round_up(length_s)
            ),
        )
    }
}

/// Whether a time is longer than the longest gap, by more than rounding.
pub(super) fn is_longer(time_s: f64, max_gap_s: f64) -> bool {
    time_s > max_gap_s + TIME_ROUNDING_S
}

/// The next tenth of a second above.
pub(super) fn round_up(time_s: f64) -> f64 {
    (time_s * 10.0).floor() / 10.0 + 0.1
}

/// Runs of values that were not seen.
pub(super) fn holes(values: &[f64]) -> impl Iterator<Item = Range<usize>> {
    let mut at = 0;
    std::iter::from_fn(move || {
        let start = at + values[at..].iter().position(|value| value.is_nan())?;
        let length = values[start..].iter().position(|value| !value.is_nan());
        at = length.map_or(values.len(), |length| start + length);
        Some(start..at)
    })
}

/// Replaces what was not seen by straight lines between what was; the edges stay as they are.
pub(super) fn bridge(time_s: &[f64], values: &mut [f64]) {
    let inner: Vec<_> = holes(values)
        .filter(|hole| hole.start > 0 && hole.end < values.len())
        .collect();
    for hole in inner {
        let (before, after) = (hole.start - 1, hole.end);
        let slope = (values[after] - values[before]) / (time_s[after] - time_s[before]);
        for index in hole {
            values[index] = values[before] + slope * (time_s[index] - time_s[before]);
        }
    }
}
