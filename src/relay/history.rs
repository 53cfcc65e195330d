//! The last ten minutes of a worm, in few numbers: what a chart shows to who joins late.

use super::wire::Sample;
use std::collections::VecDeque;
use worm_estimator::message::{Estimate, State};
use worm_physics::MAX_CELLS;

/// Time between samples, ns: five a second show every gait.
pub(crate) const INTERVAL_NS: u64 = 200_000_000;

/// How many are kept: ten minutes, 0.5 MB.
const MAX_SAMPLES: usize = 3000;

/// Samples of the last ten minutes.
#[derive(Debug, Clone, Default)]
pub(crate) struct History(VecDeque<Kept>);

/// A sample without memory of its own elsewhere.
#[derive(Debug, Clone, Copy)]
struct Kept {
    time_ns: u64,
    phase: f64,
    motor_current_a: f32,
    cells: u8,
    position_m: [f32; MAX_CELLS],
    deformation_m: [f32; MAX_CELLS],
}

impl History {
    /// Takes the newest estimate, if enough time has passed since the last one that was kept.
    pub(crate) fn take(&mut self, state: &State, estimate: &Estimate) {
        let last_ns = self.0.back().map_or(0, |last| last.time_ns);
        // An estimate before the first state has no time.
        if estimate.time_ns == 0 || estimate.time_ns < last_ns.saturating_add(INTERVAL_NS) {
            return;
        }
        self.push(Kept {
            time_ns: estimate.time_ns,
            phase: estimate.phase,
            motor_current_a: state.motor_current_a as f32,
            cells: estimate.cell_count.min(MAX_CELLS as u32) as u8,
            position_m: estimate.position_m.map(|value| value as f32),
            deformation_m: estimate.deformation_m.map(|value| value as f32),
        });
    }

    fn push(&mut self, sample: Kept) {
        if self.0.len() == MAX_SAMPLES {
            self.0.pop_front();
        }
        self.0.push_back(sample);
    }

    /// Adds what somebody else has kept. Own samples of the same time give way.
    pub(crate) fn merge(&mut self, samples: &[Sample]) {
        let Some(first) = samples.first() else { return };
        while self.0.back().is_some_and(|own| own.time_ns >= first.time_ns) {
            self.0.pop_back();
        }
        samples.iter().for_each(|sample| self.push(Kept::of(sample)));
    }

    /// The samples for the wire, the oldest first.
    pub(crate) fn samples(&self) -> Vec<Sample> {
        self.0.iter().map(Kept::sample).collect()
    }

    /// Position and deformation of a cell, from 0, in the last `span_s`: (seconds before now, m). Leaves out what was not known.
    pub(crate) fn of_cell(&self, cell: usize, now_ns: u64, span_s: f64) -> CellHistory {
        let mut found = CellHistory::default();
        for sample in &self.0 {
            let at_s = -(now_ns.saturating_sub(sample.time_ns) as f64) * 1e-9;
            if at_s < -span_s || cell >= usize::from(sample.cells) {
                continue;
            }
            for (values, value) in [
                (&mut found.position_m, sample.position_m[cell]),
                (&mut found.deformation_m, sample.deformation_m[cell]),
            ] {
                if value.is_finite() {
                    values.push((at_s, f64::from(value)));
                }
            }
        }
        found
    }
}

/// What one cell did.
#[derive(Debug, Default)]
pub(crate) struct CellHistory {
    /// Its position, m.
    pub(crate) position_m: Vec<(f64, f64)>,
    /// Its tip's deformation, m.
    pub(crate) deformation_m: Vec<(f64, f64)>,
}

impl Kept {
    fn of(sample: &Sample) -> Self {
        let of_cells = |values: &[Option<f32>]| {
            std::array::from_fn(|cell| values.get(cell).copied().flatten().unwrap_or(f32::NAN))
        };
        Self {
            time_ns: sample.time_ns,
            phase: sample.phase.unwrap_or(f64::NAN),
            motor_current_a: sample.motor_current_a.unwrap_or(f32::NAN),
            cells: sample.position_m.len().min(MAX_CELLS) as u8,
            position_m: of_cells(&sample.position_m),
            deformation_m: of_cells(&sample.deformation_m),
        }
    }

    fn sample(&self) -> Sample {
        let cells = usize::from(self.cells);
        let known = |value: &f32| value.is_finite().then_some(*value);
        Sample {
            time_ns: self.time_ns,
            phase: self.phase.is_finite().then_some(self.phase),
            motor_current_a: known(&self.motor_current_a),
            position_m: self.position_m[..cells].iter().map(known).collect(),
            deformation_m: self.deformation_m[..cells].iter().map(known).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(time_ns: u64) -> Sample {
        Sample {
            time_ns,
            phase: Some(time_ns as f64 * 1e-9),
            motor_current_a: None,
            position_m: vec![Some(0.25), None],
            deformation_m: vec![Some(-0.001), None],
        }
    }

    #[test]
    fn what_one_side_keeps_the_other_takes_over_once_and_in_bounded_memory() {
        let mut history = History::default();
        let samples: Vec<_> = (1..=4000).map(|number| sample(number * INTERVAL_NS)).collect();
        history.merge(&samples[..3000]);
        assert_eq!(history.samples(), samples[..3000]);
        // A relay that began later knows only the end, in part the same.
        history.merge(&samples[2500..]);
        assert_eq!(history.samples(), samples[1000..]);
        let now_ns = 4000 * INTERVAL_NS;
        let first = history.of_cell(0, now_ns, 1.0);
        assert_eq!(first.position_m.len(), 6, "{first:?}");
        assert_eq!(first.deformation_m.last(), Some(&(0.0, f64::from(-0.001_f32))));
        for unknown in [1, 2, 99] {
            assert!(history.of_cell(unknown, now_ns, 1.0).position_m.is_empty());
        }
    }
}
