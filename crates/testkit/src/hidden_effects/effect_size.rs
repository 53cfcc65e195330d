//! What a hidden effect does to the positions: the same worm from the same random draws, with it and without.

use super::scene::SimulatedRun;

/// Places in a cycle at which two runs are compared.
const PLACES: usize = 48;

/// Root mean squares of the difference that an effect makes.
#[derive(Debug, Clone, Copy, Default)]
pub struct EffectSize {
    /// Of each cycle's mean advance, m.
    pub advance_m: f64,
    /// Of each cell's positions at the same phase within a cycle, their mean over the cycle apart, m.
    pub within_cycle_m: f64,
    /// Of each cycle's time, s.
    pub cycle_time_s: f64,
}

impl EffectSize {
    /// What differs between the runs of two worms.
    pub fn between(with_effect: &[SimulatedRun], baseline: &[SimulatedRun]) -> Self {
        let (mut advance, mut within, mut time) = (
            SumOfSquares::default(),
            SumOfSquares::default(),
            SumOfSquares::default(),
        );
        for (with_effect, baseline) in with_effect.iter().zip(baseline) {
            for (one, other) in advances_m(with_effect).iter().zip(&advances_m(baseline)) {
                advance.add(one - other);
            }
            for cycle in whole_cycles(with_effect).filter(|&cycle| whole_cycles(baseline).any(|other| other == cycle)) {
                let lasts_s = |simulated: &SimulatedRun| simulated.time_at(cycle + 1.0) - simulated.time_at(cycle);
                time.add(lasts_s(with_effect) - lasts_s(baseline));
                for cell in 0..with_effect.position_m.len() {
                    let differences_m: Vec<f64> = (0..PLACES)
                        .map(|place| {
                            let phase = cycle + place as f64 / PLACES as f64;
                            with_effect.position_at(cell, phase) - baseline.position_at(cell, phase)
                        })
                        .collect();
                    let mean_m = differences_m.iter().sum::<f64>() / PLACES as f64;
                    differences_m.iter().for_each(|m| within.add(m - mean_m));
                }
            }
        }
        Self {
            advance_m: advance.root_mean(),
            within_cycle_m: within.root_mean(),
            cycle_time_s: time.root_mean(),
        }
    }
}

/// Mean advance of the cells in every whole cycle of a run, m.
pub fn advances_m(simulated: &SimulatedRun) -> Vec<f64> {
    let cells = simulated.position_m.len();
    let mean_m = |phase: f64| (0..cells).map(|cell| simulated.position_at(cell, phase)).sum::<f64>() / cells as f64;
    whole_cycles(simulated)
        .map(|cycle| mean_m(cycle + 1.0) - mean_m(cycle))
        .collect()
}

/// The phases at which the whole cycles of a run begin.
pub fn whole_cycles(simulated: &SimulatedRun) -> impl Iterator<Item = f64> {
    let first = simulated.phase.first().map_or(0.0, |phase| phase.ceil());
    // A run that ends at a whole cycle has its last sample a little before.
    let last = simulated.phase.last().map_or(0.0, |phase| (phase + 0.01).floor());
    (0..(last - first).max(0.0) as usize).map(move |cycle| first + cycle as f64)
}

impl SimulatedRun {
    /// Sample before a phase, and the fraction of the interval to the next.
    fn place(&self, phase: f64) -> (usize, f64) {
        let after = self.phase.partition_point(|&earlier| earlier <= phase);
        let row = after.saturating_sub(1).min(self.phase.len() - 2);
        let interval = self.phase[row + 1] - self.phase[row];
        let fraction = if interval > 0.0 {
            (phase - self.phase[row]) / interval
        } else {
            0.0
        };
        (row, fraction)
    }

    /// Position of a cell at a phase, m.
    pub fn position_at(&self, cell: usize, phase: f64) -> f64 {
        let (row, fraction) = self.place(phase);
        let series_m = &self.position_m[cell];
        series_m[row] + fraction * (series_m[row + 1] - series_m[row])
    }

    /// Positive work of the drive up to a phase, J.
    pub fn work_at(&self, phase: f64) -> f64 {
        let (row, fraction) = self.place(phase);
        self.work_j[row] + fraction * (self.work_j[row + 1] - self.work_j[row])
    }

    /// The phase at which as much of its cycle's time has passed as `phase` has of its turn.
    pub fn phase_at_time_fraction(&self, phase: f64) -> f64 {
        let cycle = phase.floor();
        let (begun_s, ended_s) = (self.time_at(cycle), self.time_at(cycle + 1.0));
        let at_s = begun_s + (phase - cycle) * (ended_s - begun_s);
        let time_s = &self.recording.time_s;
        let row = time_s
            .partition_point(|&earlier| earlier <= at_s)
            .clamp(1, time_s.len() - 1)
            - 1;
        let fraction = (at_s - time_s[row]) / (time_s[row + 1] - time_s[row]);
        self.phase[row] + fraction * (self.phase[row + 1] - self.phase[row])
    }

    /// Time at a phase, s.
    pub fn time_at(&self, phase: f64) -> f64 {
        let (row, fraction) = self.place(phase);
        let time_s = &self.recording.time_s;
        time_s[row] + fraction * (time_s[row + 1] - time_s[row])
    }
}

#[derive(Debug, Default)]
struct SumOfSquares {
    count: f64,
    sum: f64,
}

impl SumOfSquares {
    fn add(&mut self, value: f64) {
        self.count += 1.0;
        self.sum += value * value;
    }

    fn root_mean(&self) -> f64 {
        if self.count > 0.0 {
            (self.sum / self.count).sqrt()
        } else {
            0.0
        }
    }
}
