//! The noise: how well the worm repeats its own cycles.
//!
//! Neighbouring cycles differ by noise alone, whatever the model misses, unless something changes just between them. So the noise is
//! measured by differences from each cycle to the next, and by medians of their squares: a change in the middle of a run concerns one
//! difference of many and does not count as noise. What repeats every second or third cycle does not either: where cycles that are so
//! far apart differ by much less than neighbours in the relative positions of the cells, they are compared instead. There are two kinds.
//! Camera noise and scatter within the cycle concern each cell, and are correlated from bin to bin. The body makes a random walk, since
//! every step differs a little from the last.

use super::observed::Observed;
use super::residual::Residual;
use crate::explain::search::bins::Bins;
use crate::identify::drift::Drift;

/// Median of the square of a normal quantity, in variances.
const MEDIAN_SQUARE: f64 = 0.454_936;
/// Variance of the mean of a random walk over an interval less its mean over the one before, in variances gathered in an interval.
const WALK_OF_MEANS: f64 = 2.0 / 3.0;
/// Variance of the change of that difference from one interval to the next, in the same unit: neighbouring differences overlap.
const WALK_OF_SECOND_DIFFERENCES: f64 = 1.0;
/// Variance of a variance taken by [`variance`], relative to its square, times the number of values.
const VARIANCE_OF_MEDIAN: f64 = 5.4;
/// Fraction of its bins that a step or a cycle must show.
const WHOLE: f64 = 0.9;
/// Cycles that are compared are so far apart, and by what fraction of the variance those farther apart must differ less.
const APART: [usize; 3] = [1, 2, 3];
const MUCH_LESS: f64 = 0.5;
/// Fewest changes of the advance from which their variance is taken: a single change in mid-run shows in three of them.
const MIN_DIFFERENCES: usize = 8;
/// Fewest advances in a cycle that show a scatter about a line, and what the line takes of them.
const MIN_ADVANCES: usize = 5;
const OF_LINE: f64 = 2.0;
/// Smallest variance of a position, and of the drift in a cycle, m².
const MIN_M2: f64 = 1e-14;
const MIN_DRIFT_M2: f64 = 1e-12;

/// The noise of one run.
#[derive(Debug, Clone)]
pub(in crate::explain) struct RunNoise {
    drift: Drift,
    /// Variance of what the body goes astray by in a cycle as it was measured, all at once or on the way, m².
    astray_m2: f64,
    /// Variance of one sample that neighbouring samples do not share, and of what the samples of a bin share, m².
    white_m2: f64,
    shared_m2: f64,
    /// Factor on the variance of a bin's position for its correlation with the bins beside it.
    along: f64,
    /// One over the standard deviation of each cell's relative position in each bin, 1/m; 0 where not seen.
    relative_scale: Vec<f64>,
}

impl RunNoise {
    /// The noise of a run, by its residual in bins under some hypothesis.
    pub fn measure(observed: &Observed<'_>, bins: &Bins, residual: &Residual) -> Self {
        let cells = observed.cells();
        let counted = if observed.phase_recorded { cells } else { cells - 1 } as f64;
        let all = APART.map(|apart| CycleChanges::new(observed, bins, residual, apart));
        let changes = quietest(&all);
        // A relative position lacks its share in the body's.
        let position_m2 = (0.5 * changes.of_bins_m2() * counted / (counted - 1.0)).max(MIN_M2);
        let per_bin = bins.bins.iter().map(|bin| bin.samples.len() as f64).sum::<f64>() / bins.len() as f64;
        let white_m2 = observed.noise_m.powi(2).min(position_m2 * per_bin);
        let shared_m2 = (position_m2 - white_m2 / per_bin).max(0.0);
        let along = changes.along().clamp(1.0, bins.per_step as f64);
        let of_step_m2 = position_m2 * along / counted / bins.per_step as f64;
        let of_steps_m2 = 0.5 * changes.of_steps_m2();
        let per_step_m2 = (of_steps_m2 - 2.0 * of_step_m2) / WALK_OF_MEANS * cells as f64;
        // Where the estimate is lost in its own error, the drift may still be as large as that.
        let of_few = |count: usize| (VARIANCE_OF_MEDIAN / count.max(1) as f64).sqrt();
        let error_m2 = of_steps_m2 / WALK_OF_MEANS * of_few(changes.steps()) * cells as f64;
        let of_cycle_m2 = of_step_m2 / cells as f64;
        let per_cycle_m2 = changes.of_cycles_m2().map_or(0.0, |m2| {
            (m2 * (1.0 - of_few(changes.cycles())) - 6.0 * of_cycle_m2) / WALK_OF_SECOND_DIFFERENCES
        });
        let measured_m2 = per_step_m2.max(per_cycle_m2).max(MIN_DRIFT_M2);
        let drift_m2 = measured_m2.max(error_m2);
        // What happens once in a cycle shows in one step of it, and in its advance.
        let of_advances_m2 = changes.of_advances_m2().unwrap_or(0.0) - 2.0 * of_cycle_m2;
        let astray_m2 = measured_m2.max(of_advances_m2);
        Self::new(observed, bins, astray_m2, [white_m2, shared_m2, along, drift_m2])
    }

    fn new(
        observed: &Observed<'_>,
        bins: &Bins,
        astray_m2: f64,
        [white_m2, shared_m2, along, drift_m2]: [f64; 4],
    ) -> Self {
        let cells = observed.cells();
        let mut relative_scale = Vec::with_capacity(bins.len() * cells);
        let mut body_m2 = Vec::with_capacity(bins.len());
        for bin in &bins.bins {
            let (mut sum_m2, mut seen) = (0.0, 0.0);
            for cell in 0..cells {
                let samples = bin.samples.clone();
                let count = samples
                    .filter(|&sample| observed.position_m[cell][sample].is_finite())
                    .count() as f64;
                let own_m2 = along * (white_m2 / count + shared_m2);
                let counts = count > 0.0 && (observed.phase_recorded || cell != bin.leading);
                relative_scale.push(if counts { own_m2.sqrt().recip() } else { 0.0 });
                if counts {
                    sum_m2 += own_m2;
                    seen += 1.0;
                }
            }
            body_m2.push(if seen > 0.0 {
                sum_m2 / (seen * seen)
            } else {
                f64::INFINITY
            });
        }
        let phase: Vec<f64> = bins.bins.iter().map(|bin| bin.phase).collect();
        Self {
            drift: Drift::new(&phase, &body_m2, drift_m2),
            astray_m2,
            white_m2,
            shared_m2,
            along,
            relative_scale,
        }
    }

    /// The noise of another run of the same worm before the same camera, which keeps one sample in `thinned`.
    pub fn of_another(&self, observed: &Observed<'_>, bins: &Bins, thinned: f64) -> Self {
        let white_m2 = self.white_m2 / thinned;
        Self::new(
            observed,
            bins,
            self.astray_m2,
            [white_m2, self.shared_m2, self.along, self.drift.per_cycle_m2()],
        )
    }

    /// Appends the whitened residuals of a run, each of variance 1 where the hypothesis holds: for every bin the body's, then for
    /// every bin each cell's.
    pub fn whiten(&self, residual: &Residual, out: &mut Vec<f64>) {
        self.drift
            .whiten(residual.body_m.iter().copied(), |whitened| out.push(whitened));
        let with_scale = residual.relative_m.iter().zip(&self.relative_scale);
        out.extend(with_scale.map(|(relative_m, scale)| if relative_m.is_nan() { 0.0 } else { relative_m * scale }));
    }

    /// The body's drift at every sample, by its residual there, m.
    pub fn smooth(&self, observed: &Observed<'_>, body_m: &[f64]) -> Vec<f64> {
        let sample_m2 = (self.white_m2 + self.along * self.shared_m2) / observed.cells() as f64;
        let variance_m2 = body_m.iter().enumerate().map(|(sample, body_m)| {
            let counts = sample >= observed.counts_from && body_m.is_finite();
            if counts { sample_m2 } else { f64::INFINITY }
        });
        Drift::new(
            &observed.phase,
            &variance_m2.collect::<Vec<_>>(),
            self.drift.per_cycle_m2(),
        )
        .smooth(body_m)
    }

    /// Standard deviation of what the body goes astray by in a cycle as it was measured, all at once or on the way, m.
    pub fn astray_per_cycle_m(&self) -> f64 {
        self.astray_m2.sqrt()
    }

    /// Standard deviation of the body's random walk after one cycle, m; where its estimate is lost in its own error, as large as that.
    pub fn drift_per_cycle_m(&self) -> f64 {
        self.drift.per_cycle_m2().sqrt()
    }
}

/// The changes between neighbouring cycles, or between those farther apart whose relative positions differ much less.
fn quietest(all: &[CycleChanges; APART.len()]) -> &CycleChanges {
    let limit_m2 = MUCH_LESS * all[0].of_bins_m2();
    let seen = |changes: &&CycleChanges| (f64::MIN_POSITIVE..limit_m2).contains(&changes.of_bins_m2());
    let least = all
        .iter()
        .filter(seen)
        .min_by(|a, b| a.of_bins_m2().total_cmp(&b.of_bins_m2()));
    least.unwrap_or(&all[0])
}

/// Changes of a residual from each settled cycle to one after it, and of the body from each to the next: a body that sways in a rhythm
/// of its own has to pass for a walk, or it would look like one effect or another.
struct CycleChanges {
    /// Of each cell's relative position: `[cell][place in the cycle][cycle]`, m.
    relative_m: Vec<Vec<Vec<f64>>>,
    /// Of the displacement of the body from the mean over one step to the mean over the next: `[step][cycle]`, m.
    steps_m: Vec<Vec<f64>>,
    /// Of the body's mean advance in a cycle, m.
    cycles_m: Vec<f64>,
    /// Advances of the body in a cycle beyond their mean and trend, m.
    advances_m: Vec<f64>,
    per_step: usize,
}

impl CycleChanges {
    fn new(observed: &Observed<'_>, bins: &Bins, residual: &Residual, apart: usize) -> Self {
        let cells = observed.cells();
        let per_cycle = bins.per_cycle() as usize;
        let from = bins
            .bins
            .partition_point(|bin| bin.samples.start < observed.settled_from());
        let first = bins
            .bins
            .get(from)
            .map_or(0, |bin| bin.number.div_euclid(per_cycle as i64));
        let last = bins
            .bins
            .last()
            .map_or(0, |bin| bin.number.div_euclid(per_cycle as i64));
        let cycles = (last - first + 1).max(1) as usize;
        // `[cycle][place]`, the body first, then each cell.
        let mut tables = vec![vec![vec![f64::NAN; per_cycle]; cycles]; 1 + cells];
        for bin in from..bins.len() {
            let (cycle, place) = (
                (bins.bins[bin].number.div_euclid(per_cycle as i64) - first) as usize,
                bins.place(bin),
            );
            tables[0][cycle][place] = residual.body_m[bin];
            for cell in 0..cells {
                tables[1 + cell][cycle][place] = residual.relative_m[bin * cells + cell];
            }
        }
        let changes = |table: &[Vec<f64>], place: usize| -> Vec<f64> {
            let pairs = table.iter().zip(table.iter().skip(apart));
            pairs.map(|(one, other)| other[place] - one[place]).collect()
        };
        let relative_m = tables[1..]
            .iter()
            .map(|table| (0..per_cycle).map(|place| changes(table, place)).collect())
            .collect();
        // The mean over a part of a cycle is another one where the body gets ahead of the model.
        let mean_of = |values: &[f64]| {
            let seen: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
            if (seen.len() as f64) < WHOLE * values.len() as f64 {
                f64::NAN
            } else {
                seen.iter().sum::<f64>() / seen.len() as f64
            }
        };
        let step_means: Vec<f64> = tables[0]
            .iter()
            .flat_map(|cycle| cycle.chunks_exact(bins.per_step).map(mean_of))
            .collect();
        let displacements: Vec<f64> = step_means.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let mut steps_m = vec![Vec::new(); cells];
        for step in cells..displacements.len() {
            steps_m[step % cells].push(displacements[step] - displacements[step - cells]);
        }
        let cycle_means: Vec<f64> = tables[0].iter().map(|cycle| mean_of(cycle)).collect();
        let cycles_m = cycle_means
            .windows(3)
            .map(|three| three[2] - 2.0 * three[1] + three[0])
            .collect();
        let advances_m: Vec<f64> = cycle_means.windows(2).map(|pair| pair[1] - pair[0]).collect();
        Self {
            relative_m,
            steps_m,
            cycles_m,
            advances_m: beyond_line(&advances_m),
            per_step: bins.per_step,
        }
    }

    /// Variance of the change of a relative position, m²: mean over cells and places.
    fn of_bins_m2(&self) -> f64 {
        mean(
            self.relative_m
                .iter()
                .flatten()
                .filter_map(|changes_m| variance(changes_m)),
        )
    }

    /// Variance of the mean change over a step, over that of as many independent bins.
    fn along(&self) -> f64 {
        let of_steps = self.relative_m.iter().flat_map(|of_cell| {
            of_cell.chunks_exact(self.per_step).map(|step| {
                let cycles = step.first().map_or(0, Vec::len);
                let mean_m =
                    |cycle: usize| step.iter().map(|changes_m| changes_m[cycle]).sum::<f64>() / step.len() as f64;
                variance(&(0..cycles).map(mean_m).collect::<Vec<_>>())
            })
        });
        mean(of_steps.flatten()) * self.per_step as f64 / self.of_bins_m2()
    }

    /// Variance of the change of the body's displacement from step to step, m².
    fn of_steps_m2(&self) -> f64 {
        variance(&self.steps_m.concat()).unwrap_or(0.0)
    }

    /// Number of changes from step to step that were seen.
    fn steps(&self) -> usize {
        let all = self.steps_m.iter().flatten();
        all.filter(|change_m| change_m.is_finite()).count()
    }

    /// Number of changes from cycle to cycle that were seen.
    fn cycles(&self) -> usize {
        self.cycles_m.iter().filter(|change_m| change_m.is_finite()).count()
    }

    /// Variance of the body's advance in a cycle about its mean and trend, m²; none with few cycles.
    fn of_advances_m2(&self) -> Option<f64> {
        let count = self.advances_m.len() as f64;
        Some(variance(&self.advances_m)? * count / (count - OF_LINE))
    }

    /// Variance of the change of the body's advance from cycle to cycle, m²; none with few cycles.
    fn of_cycles_m2(&self) -> Option<f64> {
        (self.cycles() >= MIN_DIFFERENCES)
            .then(|| variance(&self.cycles_m))
            .flatten()
    }
}

/// Values beyond the straight line through them; those that are not finite are left out. Empty of too few to show more than a line.
fn beyond_line(values: &[f64]) -> Vec<f64> {
    let seen: Vec<(f64, f64)> = values
        .iter()
        .enumerate()
        .map(|(at, value)| (at as f64, *value))
        .filter(|(_, value)| value.is_finite())
        .collect();
    if seen.len() < MIN_ADVANCES {
        return Vec::new();
    }
    let mean_of = |of: &dyn Fn(&(f64, f64)) -> f64| mean(seen.iter().map(of));
    let (middle, value) = (mean_of(&|(at, _)| *at), mean_of(&|(_, value)| *value));
    let slope = mean_of(&|(at, here)| (at - middle) * (here - value)) / mean_of(&|(at, _)| (at - middle).powi(2));
    seen.iter()
        .map(|(at, here)| here - value - slope * (at - middle))
        .collect()
}

/// Variance of values about 0 by the median of their squares; none where there are none.
pub(super) fn variance(values: &[f64]) -> Option<f64> {
    let mut squares: Vec<f64> = values
        .iter()
        .map(|value| value * value)
        .filter(|square| square.is_finite())
        .collect();
    if squares.is_empty() {
        return None;
    }
    squares.sort_by(f64::total_cmp);
    let middle = 0.5 * (squares[squares.len() / 2] + squares[(squares.len() - 1) / 2]);
    Some(middle / MEDIAN_SQUARE)
}

/// Mean; 0 of nothing.
fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    sum / f64::max(count, 1.0)
}

#[cfg(test)]
mod tests {
    use super::super::binning::bins;
    use super::*;
    use crate::experiment::Simulation;
    use crate::explain::fixture::{Campaign, NOISE_M, WALK_M, hypothesis, record, scene};
    use crate::recording::Recording;

    /// The noise of the first run by the right model.
    fn measured(recordings: &[Recording]) -> (RunNoise, usize) {
        let campaign = Campaign::default();
        let scene = scene(recordings, &campaign);
        let observed = &scene.observed[0];
        let bins = bins(observed);
        let (right, at) = hypothesis(None);
        let predicted = scene.predict(0, &right, &at).expect("it holds");
        let residual = Residual::binned(observed, &bins, &predicted);
        (RunNoise::measure(observed, &bins, &residual), bins.len())
    }

    #[test]
    fn it_is_what_the_recording_was_made_with() {
        let recordings = record(&Campaign::default(), None, 1);
        let (noise, bins) = measured(&recordings);
        let per_bin = recordings[0].time_s.len() as f64 / bins as f64;
        let position_m = (noise.white_m2 / per_bin + noise.shared_m2).sqrt();
        assert!(
            (position_m * per_bin.sqrt() / NOISE_M - 1.0).abs() < 0.2,
            "{position_m}"
        );
        assert!(
            (0.4..2.5).contains(&(noise.drift_per_cycle_m() / WALK_M)),
            "{}",
            noise.drift_per_cycle_m()
        );
    }

    #[test]
    fn what_every_other_cycle_does_is_none_of_it() {
        let usual = Campaign::default();
        let cycles = 9.0;
        let campaign = Campaign {
            simulation: Simulation {
                cycles,
                ..usual.simulation
            },
            ..usual
        };
        let recordings = record(&campaign, None, 1);
        let mut alternating = recordings.clone();
        let samples = alternating[0].time_s.len() as f64;
        for (sample, at_m) in alternating[0].position_m[1].iter_mut().enumerate() {
            let cycle = (sample as f64 / samples * cycles) as usize;
            *at_m += if cycle.is_multiple_of(2) { 2e-4 } else { -2e-4 };
        }
        let [(plain, _), (alternating, _)] = [&recordings, &alternating].map(|recordings| measured(recordings));
        let position_m2 = |noise: &RunNoise| noise.along * (noise.white_m2 + noise.shared_m2);
        let ratio = position_m2(&alternating) / position_m2(&plain);
        assert!(ratio < 1.5, "the variance grows by a factor {ratio}");
    }

    #[test]
    fn a_change_in_the_middle_of_a_run_is_none_of_it() {
        let recordings = record(&Campaign::default(), None, 1);
        let mut changed = recordings.clone();
        let middle = changed[0].time_s.len() / 2;
        changed[0].position_m[1][middle..]
            .iter_mut()
            .for_each(|at_m| *at_m += 4e-4);
        let [(plain, _), (changed, _)] = [&recordings, &changed].map(|recordings| measured(recordings));
        let position_m2 = |noise: &RunNoise| noise.along * (noise.white_m2 + noise.shared_m2);
        let ratio = position_m2(&changed) / position_m2(&plain);
        assert!(ratio < 1.5, "the variance grows by a factor {ratio}");
        assert!(changed.drift_per_cycle_m() < 2.0 * plain.drift_per_cycle_m().max(WALK_M));
    }
}
