//! Positions that were not seen: short gaps are bridged, long ones refused, because bridging them would invent data.

use super::series::Recording;
use std::ops::Range;
use worm_log::ReadError;

/// Times computed from frame numbers differ by rounding; a gap that exceeds the limit by less than this is within it, s.
const TIME_ROUNDING_S: f64 = 1e-9;

/// Time of a gait cycle of the paper's worm, s.
const USUAL_CYCLE_S: f64 = 2.5;

impl Recording {
    /// Positions with their gaps bridged by straight lines, `[cell][sample]`, m. What lies before a cell was first seen or
    /// after it was last seen stays `NaN`. The recording itself stays as it was measured.
    pub fn filled(&self) -> Vec<Vec<f64>> {
        let mut position_m = self.position_m.clone();
        for series in &mut position_m {
            bridge(&self.time_s, series);
        }
        position_m
    }

    /// Checks that no cell is unseen for longer than `max_gap_s`.
    ///
    /// # Errors
    /// [`ReadError`] with the cell and the times between which it is not seen.
    pub fn check_gaps(&self, max_gap_s: f64) -> Result<(), ReadError> {
        for (cell, series) in self.position_m.iter().enumerate() {
            if let Some(gap) = unseen_runs(series)
                .map(|run| self.gap(&run))
                .find(|gap| is_longer(gap.to_s - gap.from_s, max_gap_s))
            {
                return Err(gap.refusal(self, cell, max_gap_s));
            }
        }
        Ok(())
    }

    /// What to do about a gap. To bridge one over more than a gait cycle would invent the cycle, so that is not proposed.
    pub(super) fn remedy_of_gap(&self, from_s: f64, to_s: f64, at_edge: bool) -> String {
        let cut = if at_edge { "cut it off" } else { "leave it out" };
        if !self.is_longer_than_a_cycle(from_s, to_s) {
            let proposed_s = round_up(to_s - from_s);
            return format!("give --max-gap {proposed_s:.1} to accept it, or {cut} with --from or --to");
        }
        let by_current = match (&self.motor, &self.gait_phase) {
            (Some(_), Some(_)) => {
                "; by the motor's current, `wormd analyze` and `wormd explain` take it whole with --current=alone"
            }
            _ => "",
        };
        format!("{cut} with --from or --to: it is longer than a gait cycle{by_current}")
    }

    /// Whether more than a gait cycle is made between two times: by the phase, or where that is not known by the usual time of one.
    fn is_longer_than_a_cycle(&self, from_s: f64, to_s: f64) -> bool {
        let phase_at = |time_s: f64| {
            let phase = self.gait_phase.as_ref()?;
            let sample = self.time_s.partition_point(|&at_s| at_s < time_s);
            phase.get(sample).copied().filter(|phase| phase.is_finite())
        };
        match (phase_at(from_s), phase_at(to_s)) {
            (Some(from), Some(to)) => (to - from).abs() > 1.0,
            _ => is_longer(to_s - from_s, USUAL_CYCLE_S),
        }
    }

    fn gap(&self, run: &Range<usize>) -> Gap {
        Gap {
            from_s: self.time_s[run.start.saturating_sub(1)],
            to_s: self.time_s[run.end.min(self.samples() - 1)],
            at_edge: run.start == 0 || run.end == self.samples(),
        }
    }
}

/// A time during which a cell is not seen: from the last sample before it in which it is seen to the first after it, or to the
/// recording's ends.
struct Gap {
    from_s: f64,
    to_s: f64,
    at_edge: bool,
}

impl Gap {
    fn refusal(&self, recording: &Recording, cell: usize, max_gap_s: f64) -> ReadError {
        let Self { from_s, to_s, at_edge } = self;
        let length_s = to_s - from_s;
        ReadError::whole(
            &recording.source,
            format!(
                "{} is not seen from {from_s:.3} s to {to_s:.3} s, for {length_s:.3} s, and {max_gap_s} s may be bridged",
                recording.name_of(cell)
            ),
            recording.remedy_of_gap(*from_s, *to_s, *at_edge),
        )
    }
}

/// Whether a time exceeds the longest permitted gap by more than rounding.
pub(super) fn is_longer(time_s: f64, max_gap_s: f64) -> bool {
    time_s > max_gap_s + TIME_ROUNDING_S
}

/// The next tenth of a second above `time_s`.
pub(super) fn round_up(time_s: f64) -> f64 {
    (time_s * 10.0).floor() / 10.0 + 0.1
}

/// Runs of values that were not seen.
pub(super) fn unseen_runs(values: &[f64]) -> impl Iterator<Item = Range<usize>> {
    let mut at = 0;
    std::iter::from_fn(move || {
        let start = at + values[at..].iter().position(|value| value.is_nan())?;
        let length = values[start..].iter().position(|value| !value.is_nan());
        at = length.map_or(values.len(), |length| start + length);
        Some(start..at)
    })
}

/// Interpolates unseen values linearly between the seen ones; unseen values at either end stay as they are.
pub(super) fn bridge(time_s: &[f64], values: &mut [f64]) {
    let inner: Vec<_> = unseen_runs(values)
        .filter(|run| run.start > 0 && run.end < values.len())
        .collect();
    for run in inner {
        let (before, after) = (run.start - 1, run.end);
        let slope = (values[after] - values[before]) / (time_s[after] - time_s[before]);
        for index in run {
            values[index] = values[before] + slope * (time_s[index] - time_s[before]);
        }
    }
}

#[cfg(test)]
mod tests;
