//! The parts of a campaign that are left out in turn, to see how a hypothesis predicts what it was not fitted to.

use super::bins::Bins;

/// Blocks of neighbouring cycles.
const BLOCKS: usize = 3;

/// What is left out at once.
#[derive(Debug, Clone)]
pub(in crate::explain) struct Fold {
    /// For each run and whole cycle since its first sample, whether it is left out.
    pub left_out: Vec<Vec<bool>>,
}

/// The parts of a campaign that are left out in turn. Each partition of the data is in it as a whole.
#[derive(Debug, Clone)]
pub(in crate::explain) struct Folds {
    pub each: Vec<Fold>,
    /// Number of partitions.
    pub partitions: f64,
}

impl Folds {
    /// First the runs, where there are several, then the blocks of cycles. `bins` are those of every run.
    pub fn of_runs_and_cycles(bins: &[&Bins]) -> Self {
        let runs = bins.len();
        let cycles = |run: usize| bins[run].cycles;
        let mut each = Vec::new();
        if runs > 1 {
            for run in 0..runs {
                let left_out = (0..runs).map(|other| vec![other == run; cycles(other)]);
                each.push(Fold {
                    left_out: left_out.collect(),
                });
            }
        }
        for block in 0..BLOCKS {
            let left_out = (0..runs).map(|run| {
                let first = bins[run].bins.first().map_or(0, |bin| bin.cycle);
                let count = cycles(run);
                (0..count)
                    .map(|cycle| cycle >= first && (cycle - first) * BLOCKS / (count - first).max(1) == block)
                    .collect()
            });
            each.push(Fold {
                left_out: left_out.collect(),
            });
        }
        let partitions = if runs > 1 { 2.0 } else { 1.0 };
        Self { each, partitions }
    }
}
