//! A recorded gait phase: checks, and which cell steps in which part of it.

use super::{Finder, MIN_CYCLES};
use crate::identify::gait_error::GaitError;

/// How far a recorded phase may fall behind its maximum so far before it counts as running back, cycles.
const BACKWARD: f64 = 0.03;
/// How far cells may be from where a recorded phase has them: in standard deviations of the noise, and as a fraction of the stroke.
const CONTRADICTION: (f64, f64) = (5.0, 0.1);
/// Largest recorded phase, cycles: a worm that crawled for decades, and a sample is still resolved.
const LARGEST_PHASE: f64 = 1e9;

impl Finder<'_> {
    /// Adopts a recorded phase, and finds which cell moves ahead in which part of it.
    pub(super) fn take_phase(&mut self, phase: &[f64]) -> Result<(), GaitError> {
        let cells = self.cells();
        if let Some(at) = phase
            .iter()
            .position(|phase| phase.is_nan() || phase.abs() > LARGEST_PHASE)
        {
            return Err(GaitError::Phase(format!(
                "at {:.2} s it is {}: count whole cycles from the recording's start",
                self.time_s[at], phase[at]
            )));
        }
        if runs_back(phase) {
            let (first, last) = (phase[0], phase[phase.len() - 1]);
            return Err(if begins_anew(phase) {
                GaitError::Phase(
                    "it begins anew with every cycle: count it on, so that the second cycle runs from 1 to 2, or take the column out".to_owned(),
                )
            } else if last < first {
                GaitError::Backward
            } else {
                GaitError::Phase(
                    "it runs back in places: cut the recording to where the worm crawls forward (--from, --to)"
                        .to_owned(),
                )
            });
        }
        let cycles = phase[phase.len() - 1] - phase[0];
        if cycles < MIN_CYCLES {
            return Err(GaitError::TooFewSteps { cycles });
        }
        if cycles * cells as f64 > phase.len() as f64 {
            return Err(GaitError::Phase(format!(
                "{cycles:.0} cycles in {} samples are less than a sample for each step: is it counted in cycles?",
                phase.len()
            )));
        }
        let mut rise_m = vec![vec![0.0; cells]; cells]; // [part][cell]
        for sample in 1..phase.len() {
            let part = ((phase[sample] + phase[sample - 1]) / 2.0 * cells as f64)
                .floor()
                .rem_euclid(cells as f64) as usize;
            let moves: Vec<f64> = self
                .seen_m
                .iter()
                .map(|series| series[sample] - series[sample - 1])
                .collect();
            if moves.iter().any(|displacement| displacement.is_nan()) {
                continue;
            }
            let mean_m = moves.iter().sum::<f64>() / cells as f64;
            for (rise_m, displacement_m) in rise_m[part].iter_mut().zip(moves) {
                *rise_m += displacement_m - mean_m;
            }
        }
        let max = |row: &Vec<f64>| (0..cells).max_by(|&a, &b| row[a].total_cmp(&row[b])).unwrap_or(0);
        let order: Vec<usize> = rise_m.iter().map(max).collect();
        for cell in 0..cells {
            if !order.contains(&cell) {
                return Err(GaitError::Phase(format!(
                    "in no {cells}th part of its cycles does cell {} move ahead: is the phase counted in cycles, and does it begin with a step?",
                    cell + 1
                )));
            }
        }
        self.set_order(order);
        self.phase = phase.to_vec();
        for sample in 1..self.phase.len() {
            self.phase[sample] = self.phase[sample].max(self.phase[sample - 1]);
        }
        Ok(())
    }

    /// Whether the cells at rest stand where a recorded phase has them. `noise_m` is the noise by the positions alone.
    pub(super) fn check_phase(&self, off_m: f64, noise_m: f64) -> Result<(), GaitError> {
        if off_m <= CONTRADICTION.0 * noise_m + CONTRADICTION.1 * self.stroke_m {
            return Ok(());
        }
        Err(GaitError::Phase(format!(
            "the cells stand {:.1} mm off where it has them: is it counted in cycles, and does it begin with a step?",
            off_m * 1e3
        )))
    }
}

/// Whether a recorded phase falls from nearly 1 to nearly 0 at the end of each cycle.
fn begins_anew(phase: &[f64]) -> bool {
    let falls = || phase.windows(2).filter(|pair| pair[1] < pair[0] - BACKWARD);
    let is_of_one_cycle = phase.iter().all(|phase| (0.0..=1.0).contains(phase));
    is_of_one_cycle && falls().count() > 0 && falls().all(|pair| pair[0] - pair[1] > 0.5)
}

/// Whether a recorded phase goes back, by more than a clock may be late.
fn runs_back(phase: &[f64]) -> bool {
    let mut farthest = f64::NEG_INFINITY;
    phase.iter().any(|&here| {
        farthest = farthest.max(here);
        here < farthest - BACKWARD
    })
}
