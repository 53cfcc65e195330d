//! A window of a few cycles of a run, with its steps and slides.

use crate::experiment::Analysis;
use crate::report::plot::{Axis, Colour, DrawError, Plot};
use std::ops::Range;

/// How far a sample may miss a window's edge, as a fraction of the last cycle.
const EDGE: f64 = 1e-6;
/// Opacity of the bands that mark steps.
const BAND: f64 = 0.09;

/// A few whole cycles of a run.
pub(super) struct Window<'a> {
    run: &'a Analysis,
    /// Its samples.
    pub samples: Range<usize>,
    /// When it begins, s of the recording's time.
    pub start_s: f64,
    /// When it ends, s.
    pub end_s: f64,
    /// Whole cycles in it.
    pub cycles: usize,
    /// Number of its first cycle in the recording, from 0; none where the recording holds no whole cycle.
    pub first_cycle: Option<usize>,
}

impl<'a> Window<'a> {
    /// The whole recording.
    pub fn whole(run: &'a Analysis) -> Self {
        let time_s = &run.series.time_s;
        Self {
            run,
            samples: 0..time_s.len(),
            start_s: time_s.first().copied().unwrap_or(f64::NAN),
            end_s: time_s.last().copied().unwrap_or(f64::NAN),
            cycles: run.cycles.len(),
            first_cycle: run.cycles.first().map(|cycle| cycle.index),
        }
    }

    /// The first settled cycles, up to `wanted`; earlier ones where the recording ends too soon; the whole recording
    /// where it holds no whole cycle.
    pub fn of_cycles(run: &'a Analysis, wanted: usize) -> Self {
        let settled = run.cycles.iter().position(|cycle| cycle.settled).unwrap_or(0);
        let first = settled.min(run.cycles.len().saturating_sub(wanted));
        let shown = &run.cycles[first..(first + wanted).min(run.cycles.len())];
        let (Some(first), Some(last)) = (shown.first(), shown.last()) else {
            return Self::whole(run);
        };
        let (start_s, end_s) = (first.start_s, last.start_s + last.duration_s);
        let time_s = &run.series.time_s;
        let slack_s = EDGE * last.duration_s;
        let from = time_s.partition_point(|time| *time < start_s - slack_s);
        let to = time_s.partition_point(|time| *time <= end_s + slack_s);
        Self {
            run,
            samples: from..to.max(from),
            start_s,
            end_s,
            cycles: shown.len(),
            first_cycle: Some(first.index),
        }
    }

    /// Its name: `cycle 2`, `cycles 2 and 3`, `cycles 2 to 4`, counted from 1.
    pub fn name(&self) -> String {
        match (self.first_cycle, self.cycles) {
            (None | Some(_), 0) | (None, _) => "the whole recording".to_owned(),
            (Some(first), 1) => format!("cycle {}", first + 1),
            (Some(first), 2) => format!("cycles {} and {}", first + 1, first + 2),
            (Some(first), cycles) => format!("cycles {} to {}", first + 1, first + cycles),
        }
    }

    /// Its time axis, from 0.
    pub fn time_axis(&self) -> Axis {
        Axis::between(0.0, self.end_s - self.start_s, 6)
    }

    /// A series over it: time since its start, and the value, scaled.
    pub fn points(&self, values: &'a [f64], scale: f64) -> impl Iterator<Item = (f64, f64)> + use<'a> {
        let start_s = self.start_s;
        let times = part(&self.run.series.time_s, &self.samples);
        let values = part(values, &self.samples);
        times
            .iter()
            .zip(values)
            .map(move |(time_s, value)| (time_s - start_s, value * scale))
    }

    /// The same with the first known value as 0.
    pub fn points_from_start(&self, values: &'a [f64], scale: f64) -> impl Iterator<Item = (f64, f64)> + use<'a> {
        let origin = self.origin(values);
        self.points(values, scale)
            .map(move |(time_s, value)| (time_s, value - origin * scale))
    }

    /// First known value of a series in it; `NaN` without one.
    pub fn origin(&self, values: &[f64]) -> f64 {
        let known = part(values, &self.samples).iter().find(|value| value.is_finite());
        known.copied().unwrap_or(f64::NAN)
    }

    /// The points of a line where the cell's tip slides, and gaps where it sticks.
    pub fn where_sliding(
        &self,
        cell: usize,
        points: impl Iterator<Item = (f64, f64)>,
    ) -> impl Iterator<Item = (f64, f64)> {
        let sliding = self.run.series.sliding.get(cell).map_or(&[][..], |sliding| sliding);
        points
            .zip(part(sliding, &self.samples))
            .map(|((time_s, value), sliding)| (time_s, if *sliding == 0 { f64::NAN } else { value }))
    }

    /// The steps in it: the cell, counted from 0, and the samples.
    pub fn steps(&self) -> Vec<(usize, Range<usize>)> {
        let stepping = part(&self.run.series.stepping_cell, &self.samples);
        let mut steps: Vec<(usize, Range<usize>)> = Vec::new();
        for (offset, &cell) in stepping.iter().enumerate() {
            let sample = self.samples.start + offset;
            match steps.last_mut() {
                Some((same, range)) if *same == cell => range.end = sample + 1,
                _ => steps.push((cell, sample..sample + 1)),
            }
        }
        steps
    }

    /// Marks the steps with a pale band in the colour of the cell that makes it, and numbers them if `named` and there
    /// is room for every number.
    pub fn draw_steps(&self, plot: &mut Plot<'_, '_, '_>, colours: &[Colour], named: bool) -> Result<(), DrawError> {
        let time_s = &self.run.series.time_s;
        let since_start_s = |at_s: f64| at_s.max(self.start_s).min(self.end_s) - self.start_s;
        let mut bands = Vec::new();
        for (cell, samples) in self.steps() {
            let (Some(&from_s), Some(&colour)) = (time_s.get(samples.start), colours.get(cell)) else {
                continue;
            };
            let to_s = time_s.get(samples.end).copied().unwrap_or(self.end_s);
            let ends = [since_start_s(from_s), since_start_s(to_s)];
            if ends[1] > ends[0] {
                bands.push((cell, ends, colour));
            }
        }
        // The steps at the window's ends may be cut short, so the longest shows how long a step is.
        let longest_s = bands.iter().map(|(_, ends, _)| ends[1] - ends[0]).fold(0.0, f64::max);
        let named = named && plot.has_room(longest_s, colours.len().to_string().len());
        for (cell, ends, colour) in bands {
            let is_whole = ends[1] - ends[0] > 0.5 * longest_s;
            let name = if named && is_whole {
                (cell + 1).to_string()
            } else {
                String::new()
            };
            plot.band(ends, colour, BAND, &name)?;
        }
        Ok(())
    }
}

/// One cell's series of a list over cells; empty where there is none.
pub(super) fn of_cell(list: &[Vec<f64>], cell: usize) -> &[f64] {
    list.get(cell).map_or(&[], |series| series)
}

/// The part of a series that it has of a range.
fn part<'a, T>(values: &'a [T], range: &Range<usize>) -> &'a [T] {
    let end = range.end.min(values.len());
    &values[range.start.min(end)..end]
}
