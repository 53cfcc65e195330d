//! The evidence that something changes in the middle of a run, whatever it is.
//!
//! What is wrong in every cycle alike looks like the discrepancy; what begins at some cycle does not. So beside a fit the residual may
//! hold, from one cycle of a run on and in all later runs, or from one cycle of every run on, another course of each channel by how
//! far it is from the leading one (cosines in the phase of the step), and another advance. The mean over all cycles and runs is the
//! evidence that there is one (known as a structural change: Zeileis and Hornik 2007).

use super::super::discrepancy::Discrepancy;
use super::super::plant::Recorded;
use super::beside::{Blocks, Fitted};
use super::ln_sum::ln_sum;
use std::f64::consts::PI;
use std::ops::Range;

/// Cosines in the phase of a step.
const COSINES: usize = 3;
/// Most cycles of a run at which a change is looked for: in a long run they lie some cycles apart.
const MOST: usize = 24;
/// Fewest cycles before a change and after it.
const MIN_CYCLES: usize = 1;

/// One possible change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::explain) struct Change {
    /// Cycles since the start of the run.
    pub cycle: usize,
    /// The run in which it happens, to stay; every run for none.
    pub run: Option<usize>,
}

impl Change {
    /// Cycles since it happened or, in the runs after that, since their start; none before. Asked for so many cycles after a run's start.
    pub fn since(&self, run: usize, cycles: f64) -> Option<f64> {
        let from = match self.run {
            Some(of) if run < of => return None,
            Some(of) if run > of => 0.0,
            _ => self.cycle as f64,
        };
        (cycles >= from).then_some(cycles - from)
    }
}

/// Every possible change of a campaign.
#[derive(Debug, Clone)]
pub(in crate::explain) struct StructuralChanges {
    all: Vec<Change>,
    columns: Blocks,
}

impl StructuralChanges {
    /// All cycles of a campaign, of each run to stay so and of all at once.
    pub fn new(plant: &impl Recorded, discrepancy: &Discrepancy) -> Self {
        let runs = plant.runs();
        let cycles = |run: usize| {
            let bins = &plant.bins(run).bins;
            let since_start = |phase: f64| phase - plant.bins(run).start_phase;
            let first = bins.first().map_or(0.0, |bin| since_start(bin.phase));
            let last = bins.last().map_or(0.0, |bin| since_start(bin.phase));
            first.ceil() as usize + MIN_CYCLES..(last.floor() as usize + 1).saturating_sub(MIN_CYCLES)
        };
        let places = |cycles: Range<usize>| {
            let apart = cycles.len().div_ceil(MOST).max(1);
            cycles.step_by(apart)
        };
        let single = (0..runs).flat_map(|run| places(cycles(run)).map(move |cycle| Change { cycle, run: Some(run) }));
        let common = (0..runs)
            .map(cycles)
            .reduce(|a, b| a.start.max(b.start)..a.end.min(b.end));
        let all_at_once = common
            .filter(|_| runs > 1)
            .into_iter()
            .flat_map(places)
            .map(|cycle| Change { cycle, run: None });
        let all: Vec<Change> = single.chain(all_at_once).collect();
        Self {
            columns: Blocks::new(
                all.len(),
                |number| columns(plant, discrepancy.scale_m, all[number]),
                discrepancy,
            ),
            all,
        }
    }

    /// The evidence for a change beside a fit, as the logarithm of the mean Bayes factor, and the most probable change.
    pub(super) fn beside(&self, fitted: &Fitted<'_>) -> Option<(f64, Change)> {
        let ln_bayes = self.columns.ln_bayes(fitted);
        let best = (0..self.all.len()).max_by(|&a, &b| ln_bayes[a].total_cmp(&ln_bayes[b]))?;
        let mean = ln_sum(ln_bayes.iter().copied()) - (self.all.len() as f64).ln();
        Some((mean, self.all[best]))
    }
}

/// The columns of one change, whitened by the noise.
fn columns(plant: &impl Recorded, scale_m: f64, change: Change) -> Vec<Vec<f64>> {
    let channels = plant.channels();
    let of_role = (0..channels).flat_map(|role| (0..COSINES).map(move |cosine| Some((role, cosine))));
    let column = |what: Option<(usize, usize)>| {
        let of_run = |run: usize| {
            let bins = plant.bins(run);
            let mut pattern = vec![0.0; bins.len() * channels];
            for (bin, pattern) in bins.bins.iter().zip(pattern.chunks_exact_mut(channels)) {
                let Some(since) = change.since(run, bin.phase - bins.start_phase) else {
                    continue;
                };
                match what {
                    Some((role, cosine)) => {
                        pattern[(bin.leading + role) % channels] =
                            scale_m * (PI * cosine as f64 * bin.of_step).cos() / (1.0 + 0.5 * cosine as f64);
                    }
                    None => pattern.fill(scale_m * since),
                }
            }
            plant.rows_of(run, &pattern)
        };
        (0..plant.runs()).flat_map(of_run).collect()
    };
    of_role.chain([None]).map(column).collect()
}

#[cfg(test)]
mod tests {
    use super::super::super::hypothesis::Hypothesis;
    use super::super::super::parameter::Onset;
    use super::super::beside::beside_the_nominal_worm;
    use super::*;
    use crate::explain::fixture::{Campaign, begun, hypothesis, record_under, with_discrepancy, worm};

    /// The evidence for a change beside the worm as it is at the start.
    fn found(truth: &(Hypothesis, Vec<f64>)) -> (f64, Change) {
        let campaign = Campaign {
            slopes_deg: vec![0.0, 30.0],
            ..Campaign::default()
        };
        let recordings = record_under(&campaign, truth, 3);
        let worm = worm(&recordings, &campaign, &hypothesis(None));
        let (problem, discrepancy) = with_discrepancy(&worm);
        let changes = StructuralChanges::new(&worm, &discrepancy);
        let found = beside_the_nominal_worm(&problem, |fitted| changes.beside(fitted));
        found.expect("there are cycles enough")
    }

    #[test]
    fn what_begins_in_mid_run_is_found_where_it_begins_and_nothing_elsewhere() {
        let truth = Some(("unequal-clamping", Some(1), &[0.8][..]));
        let onset = Onset::from(2.0, Some(1));
        let (ln_bayes, change) = found(&begun(truth, onset));
        assert!(ln_bayes > 20.0, "{ln_bayes}");
        assert_eq!(change.run, Some(1));
        assert!(change.cycle.abs_diff(2) <= 1, "{change:?}");
        let (ln_bayes, _) = found(&hypothesis(None));
        assert!(ln_bayes < 0.0, "{ln_bayes}");
    }
}
