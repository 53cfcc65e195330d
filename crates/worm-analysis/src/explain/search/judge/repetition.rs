//! The evidence that something repeats after some cycles, whatever it is.
//!
//! A canal that sways, or a drive whose every other turn differs, moves a worm to and fro in a rhythm that is not the gait's. So beside a
//! fit the residual of each run may hold waves of one frequency, in cycles, on each channel. The frequency is the same in
//! every run, amplitude and phase are each run's own; the mean over the frequencies is the evidence that there is such a rhythm. What
//! moves the body as a whole may pass for its random walk here; [`crate::explain::worm::period`] asks for that.

use super::super::discrepancy::Discrepancy;
use super::super::plant::Recorded;
use super::beside::{Blocks, Fitted};
use super::ln_sum::ln_mean;
use std::f64::consts::TAU;

/// Most frequencies.
const MOST: usize = 16;
/// Fewest cycles that can show a rhythm.
const MIN_CYCLES: f64 = 5.0;
/// Longest period as a fraction of the longest run: what is slower looks like a drift.
const LONGEST: f64 = 0.5;
/// Shortest period, cycles: what is faster looks, once a cycle, like something slower.
const SHORTEST: f64 = 2.0;

/// Every rhythm that a campaign can show.
#[derive(Debug, Clone)]
pub(in crate::explain) struct Repetitions {
    runs: usize,
    /// One block for each frequency and, within it, each run.
    columns: Blocks,
}

impl Repetitions {
    /// Evenly spaced frequencies, as many as the longest run distinguishes.
    pub fn new(plant: &impl Recorded, discrepancy: &Discrepancy) -> Self {
        let runs = plant.runs();
        let longest = (0..runs).map(|run| cycles(plant, run)).fold(0.0, f64::max);
        let frequencies = frequencies(longest);
        let blocks: Vec<(f64, usize)> = frequencies
            .iter()
            .flat_map(|&frequency| (0..runs).map(move |run| (frequency, run)))
            .collect();
        let of_block = |number: usize| {
            let (frequency, run) = blocks[number];
            columns(plant, discrepancy.scale_m, frequency, run)
        };
        Self {
            runs,
            columns: Blocks::new(blocks.len(), of_block, discrepancy),
        }
    }

    /// The evidence for a rhythm beside a fit, as the logarithm of the mean Bayes factor; none where no run is long enough.
    pub(super) fn beside(&self, fitted: &Fitted<'_>) -> Option<f64> {
        let ln_bayes = self.columns.ln_bayes(fitted);
        let of_frequency = ln_bayes.chunks_exact(self.runs).map(|runs| runs.iter().sum::<f64>());
        ln_mean(&of_frequency.collect::<Vec<_>>())
    }
}

/// Cycles of a run that count.
fn cycles(plant: &impl Recorded, run: usize) -> f64 {
    let bins = &plant.bins(run).bins;
    let ends = bins.first().zip(bins.last());
    ends.map_or(0.0, |(first, last)| last.phase - first.phase)
}

/// Frequencies per cycle that a run of so many cycles distinguishes, from the slowest to the fastest.
fn frequencies(cycles: f64) -> Vec<f64> {
    if cycles < MIN_CYCLES {
        return Vec::new();
    }
    let (slowest, fastest) = (1.0 / (LONGEST * cycles), 1.0 / SHORTEST);
    let count = (((fastest - slowest) * 2.0 * cycles).ceil() as usize).clamp(1, MOST - 1);
    let step = (fastest - slowest) / count as f64;
    (0..=count).map(|number| slowest + step * number as f64).collect()
}

/// The columns of one frequency in one run, whitened by the noise.
fn columns(plant: &impl Recorded, scale_m: f64, frequency: f64, of: usize) -> Vec<Vec<f64>> {
    let channels = plant.channels();
    let waves = (0..channels).flat_map(|channel| [0.0, 0.25].map(|turns| (channel, turns)));
    let column = |(channel, turns): (usize, f64)| {
        let of_run = |run: usize| {
            let bins = plant.bins(run);
            let mut pattern = vec![0.0; bins.len() * channels];
            if run == of {
                for (bin, pattern) in bins.bins.iter().zip(pattern.chunks_exact_mut(channels)) {
                    let angle = TAU * (frequency * (bin.phase - bins.start_phase) + turns);
                    pattern[channel] = scale_m * angle.cos();
                }
            }
            plant.rows_of(run, &pattern)
        };
        (0..plant.runs()).flat_map(of_run).collect()
    };
    waves.map(column).collect()
}

#[cfg(test)]
mod tests {
    use super::super::beside::beside_the_nominal_worm;
    use super::*;
    use crate::experiment::Simulation;
    use crate::explain::fixture::{Campaign, hypothesis, record, with_discrepancy, worm};
    use worm_estimator::config::Config;

    /// The evidence beside the true worm where one cell goes to and fro by so many metres once in so many cycles.
    fn found(amplitude_m: f64, period: f64) -> f64 {
        let usual = Campaign::default();
        let campaign = Campaign {
            simulation: Simulation {
                cycles: 9.0,
                ..usual.simulation
            },
            ..usual
        };
        let cycle_s = campaign.simulation.cycle_s.unwrap_or(Config::default().gait.cycle_s);
        let mut recordings = record(&campaign, None, 3);
        for recording in &mut recordings {
            let series_m = recording.position_m[1].iter_mut();
            for (at_m, time_s) in series_m.zip(&recording.time_s) {
                *at_m += amplitude_m * (TAU * time_s / (period * cycle_s)).sin();
            }
        }
        let worm = worm(&recordings, &campaign, &hypothesis(None));
        let (problem, discrepancy) = with_discrepancy(&worm);
        let repetitions = Repetitions::new(&worm, &discrepancy);
        let found = beside_the_nominal_worm(&problem, |fitted| repetitions.beside(fitted));
        found.expect("there are cycles enough")
    }

    #[test]
    fn a_rhythm_that_is_not_the_gaits_is_evidence_and_the_gaits_own_is_none() {
        for period in [2.0, 3.3] {
            let ln_bayes = found(6e-5, period);
            assert!(ln_bayes > 10.0, "every {period} cycles: {ln_bayes}");
        }
        for (amplitude_m, period) in [(0.0, 2.0), (6e-5, 1.0)] {
            let ln_bayes = found(amplitude_m, period);
            assert!(ln_bayes < 0.0, "{amplitude_m} m every {period} cycles: {ln_bayes}");
        }
    }

    #[test]
    fn frequencies_are_as_many_as_the_cycles_tell_apart() {
        assert_eq!(frequencies(4.0), Vec::<f64>::new());
        let of_ten = frequencies(10.0);
        assert_eq!((of_ten.len(), of_ten[0], of_ten[6]), (7, 0.2, 0.5));
        assert!(frequencies(60.0).len() <= MOST);
    }
}
