//! Whether the body moves in a rhythm of its own within the cycles: what changes most from cycle to cycle, and whether that repeats.
//!
//! A canal that sways faster than the worm walks moves the body to and fro several times in a cycle, and a tip whose friction comes and
//! goes lets it slip farther in some cycles than in others. The body's displacement in a cycle shows neither. So the increments of its
//! residual from bin to bin make a table of a row for each cycle. Of that table, less its mean and its trend over the cycles, the
//! strongest pattern is taken (principal components), and how strong it is in each cycle is a series in which any rhythm but the gait's
//! shows as a wave. A wave is held against scatter of unknown size by [`super::wave`]; of pure scatter, every direction of the
//! series is as probable as any other.

use super::predicted::Predicted;
use super::recorded_worm::RecordedWorm;
use super::residual::Residual;
use super::wave::ln_bayes_of_fraction;
use crate::explain::search::bins::Bins;
use crate::explain::search::judge::ln_sum::ln_mean;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// Fewest cycles of a run that can show a wave beside a mean and a trend.
const MIN_CYCLES: usize = 6;
/// Longest period as a fraction of the longest run: what is slower looks like a drift.
const LONGEST: f64 = 0.5;
/// Mean and trend.
const DRIFTS: usize = 2;
/// Logarithm of the Bayes factor from which a period is stated.
const CLEAR: f64 = 3.0;
/// Oversampling of the frequencies that a run can resolve, and fewest bins of a wave.
const OVERSAMPLED: f64 = 4.0;
const BINS_OF_WAVE: f64 = 4.0;
/// Part of a wave below which it is none beside mean, trend and other waves.
const VANISHING: f64 = 1e-6;

/// Logarithm of the Bayes factor of a wave in what the body does within the cycles beyond a fit, against scatter; none where no run is
/// long enough.
pub(in crate::explain) fn ln_bayes(worm: &RecordedWorm<'_>, predicted: &[Option<Predicted>]) -> Option<f64> {
    ln_bayes_of(&tables(worm, predicted))
}

/// Period of the wave, cycles, where there clearly is one.
pub(in crate::explain) fn period(worm: &RecordedWorm<'_>, predicted: &[Option<Predicted>]) -> Option<f64> {
    period_of(&tables(worm, predicted))
}

/// The table of each run that is long enough, beyond mean and trend over its rows.
fn tables(worm: &RecordedWorm<'_>, predicted: &[Option<Predicted>]) -> Vec<DMatrix<f64>> {
    let table = |(run, predicted): (usize, &Option<Predicted>)| {
        let (observed, bins) = (&worm.scene.observed[run], &worm.bins[run]);
        let left = Residual::binned(observed, bins, predicted.as_ref()?);
        beyond_drifts(&increments_m(bins, &left.body_m, observed.settled_from()))
    };
    predicted.iter().enumerate().filter_map(table).collect()
}

/// The body's increments from each bin to the next, a row for each whole cycle from some sample on; 0 where they were not seen.
fn increments_m(bins: &Bins, body_m: &[f64], settled_from: usize) -> DMatrix<f64> {
    let per_cycle = bins.per_cycle();
    let from = bins.bins.partition_point(|bin| bin.samples.start < settled_from);
    let settled = &bins.bins[from..];
    let (Some(first), Some(last)) = (settled.first(), settled.last()) else {
        return DMatrix::zeros(0, 0);
    };
    let cycles = ((last.number + 1 - first.number) / per_cycle) as usize;
    let mut table = DMatrix::zeros(cycles, per_cycle as usize);
    for (pair, pair_m) in settled.windows(2).zip(body_m[from..].windows(2)) {
        let increment_m = pair_m[1] - pair_m[0];
        let at = pair[0].number - first.number;
        let (cycle, place) = ((at / per_cycle) as usize, (at % per_cycle) as usize);
        if cycle < cycles && pair[1].number == pair[0].number + 1 && increment_m.is_finite() {
            table[(cycle, place)] = increment_m;
        }
    }
    table
}

/// A table beyond mean and trend over its rows; none with few of them.
fn beyond_drifts(table: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    (table.nrows() >= MIN_CYCLES).then(|| {
        let drifts = drifts(table.nrows());
        table - &drifts * drifts.tr_mul(table)
    })
}

/// How strong the strongest pattern of a table is in each of its rows.
fn strongest(table: &DMatrix<f64>) -> DVector<f64> {
    let eigen = (table * table.transpose()).symmetric_eigen();
    eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned()
}

/// Mean and trend over rows, as orthonormal columns.
fn drifts(rows: usize) -> DMatrix<f64> {
    let middle = 0.5 * (rows as f64 - 1.0);
    let columns = DMatrix::from_fn(rows, DRIFTS, |row, power| (row as f64 - middle).powi(power as i32));
    columns.qr().q()
}

fn ln_bayes_of(tables: &[DMatrix<f64>]) -> Option<f64> {
    let patterns: Vec<DVector<f64>> = tables.iter().map(strongest).collect();
    let longest = patterns.iter().map(DVector::len).max()? as f64;
    let of_frequency = |frequency: f64| {
        let (mut taken, mut free, mut waves) = (0.0, 0.0, 0.0);
        for pattern in &patterns {
            let (of_waves, count) = in_waves(pattern, frequency);
            taken += of_waves;
            free += (pattern.len() - DRIFTS) as f64;
            waves += count as f64;
        }
        let runs = patterns.len() as f64;
        // Each pattern is of length 1.
        ln_bayes_of_fraction(taken / runs, free, waves, free / runs)
    };
    let slowest = 1.0 / (LONGEST * longest);
    let count = ((0.5 - slowest) * 2.0 * longest).ceil().max(1.0);
    let all = (0..=count as usize).map(|number| of_frequency(slowest + (0.5 - slowest) * number as f64 / count));
    ln_mean(&all.collect::<Vec<_>>())
}

fn period_of(tables: &[DMatrix<f64>]) -> Option<f64> {
    if ln_bayes_of(tables)? < CLEAR {
        return None;
    }
    let longest = tables.iter().map(DMatrix::nrows).max()? as f64;
    let fastest = tables.iter().map(DMatrix::ncols).min()? as f64 / BINS_OF_WAVE;
    let step = 1.0 / (OVERSAMPLED * longest);
    let frequencies = (1..).map(|number| step * f64::from(number));
    let resolved = frequencies
        .skip_while(|&frequency| frequency < 1.0 / (LONGEST * longest))
        .take_while(|&frequency| frequency < fastest);
    let power = |frequency: f64| tables.iter().map(|table| power(table, frequency)).sum::<f64>();
    let strongest = resolved.max_by(|&a, &b| power(a).total_cmp(&power(b)))?;
    Some(1.0 / strongest)
}

/// Square sum of what a wave of some frequency, one over cycles, has of a table.
fn power(table: &DMatrix<f64>, frequency: f64) -> f64 {
    let (mut in_phase, mut a_quarter_off) = (0.0, 0.0);
    for (column, increments) in table.column_iter().enumerate() {
        let of_cycle = column as f64 / table.ncols() as f64;
        for (row, increment) in increments.iter().enumerate() {
            let (sin, cos) = (TAU * frequency * (row as f64 + of_cycle)).sin_cos();
            in_phase += increment * cos;
            a_quarter_off += increment * sin;
        }
    }
    (in_phase * in_phase + a_quarter_off * a_quarter_off) / table.len() as f64
}

/// The square sum of a pattern's part in waves of a frequency beside mean and trend, and how many waves there are: one where the rows
/// show only its cosine.
fn in_waves(pattern: &DVector<f64>, frequency: f64) -> (f64, usize) {
    let drifts = drifts(pattern.len());
    let mut sum = 0.0;
    let mut found: Vec<DVector<f64>> = Vec::new();
    for turns in [0.0, 0.25] {
        let wave = DVector::from_fn(pattern.len(), |row, _| (TAU * (frequency * row as f64 + turns)).cos());
        let length = wave.norm();
        let mut beyond = &wave - &drifts * drifts.tr_mul(&wave);
        for other in &found {
            beyond -= other * other.dot(&beyond);
        }
        if beyond.norm() > VANISHING * length.max(1.0) {
            beyond.normalize_mut();
            sum += beyond.dot(pattern).powi(2);
            found.push(beyond);
        }
    }
    (sum, found.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    const PLACES: usize = 24;

    /// Three runs of some cycles with scatter of 1 in every increment, and something more at each time, cycles.
    fn runs(cycles: usize, more: &dyn Fn(f64) -> f64, seed: u64) -> Vec<DMatrix<f64>> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let tables = (0..3).filter_map(|_| {
            let table = DMatrix::from_fn(cycles, PLACES, |cycle, place| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                noise + more(cycle as f64 + place as f64 / PLACES as f64)
            });
            beyond_drifts(&table)
        });
        tables.collect()
    }

    /// The evidence in such runs.
    fn found(cycles: usize, more: &dyn Fn(f64) -> f64, seed: u64) -> Option<f64> {
        ln_bayes_of(&runs(cycles, more, seed))
    }

    #[test]
    fn a_rhythm_within_the_cycles_is_evidence() {
        for seed in 0..5 {
            for per_cycle in [4.3, 1.7, 0.31] {
                let runs = runs(11, &|cycles| 2.0 * (TAU * per_cycle * cycles + 1.0).sin(), seed);
                let ln_bayes = ln_bayes_of(&runs);
                assert!(ln_bayes > Some(5.0), "seed {seed}, {per_cycle} a cycle: {ln_bayes:?}");
                let period = period_of(&runs).expect("it is clear");
                // Half of what a run tells apart.
                assert!(
                    (1.0 / period - per_cycle).abs() < 0.5 / 11.0,
                    "{per_cycle} a cycle: every {period}"
                );
            }
        }
    }

    #[test]
    fn scatter_trends_the_gait_and_a_change_are_none() {
        // The mean of a Bayes factor over data without a wave is 1, most of it from few of them.
        let of_scatter = |seed: u64| found(11, &|_| 0.0, seed).map_or(0.0, f64::exp);
        let mean = (0..200).map(of_scatter).sum::<f64>() / 200.0;
        assert!((0.02..4.0).contains(&mean), "{mean}");
        let others: [&dyn Fn(f64) -> f64; 3] = [
            &|cycles| 2.0 * (TAU * 3.0 * cycles).sin(),
            &|cycles| 0.5 * cycles * (TAU * cycles).sin(),
            &|cycles| if cycles < 6.0 { 0.0 } else { 2.0 * (TAU * cycles).sin() },
        ];
        for (number, other) in others.iter().enumerate() {
            let largest = (0..5)
                .filter_map(|seed| found(11, other, seed))
                .fold(f64::MIN, f64::max);
            assert!(largest < 3.0, "number {number}: {largest}");
        }
    }

    #[test]
    fn few_cycles_show_nothing() {
        assert_eq!(found(5, &|_| 0.0, 1), None);
    }
}
