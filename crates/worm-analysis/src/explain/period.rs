//! Whether what is left of the body's way comes back: every so many cycles, or every so many millimetres of canal.
//!
//! The way that the body makes in each cycle beyond the model's is laid against a wave over the cycles' number, and over where the
//! worm was, with an amplitude, a phase and a mean of its own in every run (Zechmeister and Kürster 2009: cycles are few and uneven
//! in place, and the mean of few periods is not that of the wave).
//! The largest share of its scatter that a wave takes away is held against what it takes when the cycles of each run change
//! places, which keeps their scatter and loses any wave.

use super::fit::{Fit, FitProblem};
use super::residual::Residual;
use nalgebra::{Matrix3, Vector3};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;

/// Fewest cycles of a run that say anything of a wave.
const MIN_CYCLES: usize = 6;
/// Shortest period, in cycles and, along the canal, in mean advances of a cycle: places are uneven enough to see below two.
const SHORTEST: (f64, f64) = (2.0, 0.5);
/// Frequencies for each that a run can tell from the next.
const OVERSAMPLED: f64 = 12.0;
/// How often the cycles change places, and how many of these may do as well.
const SHUFFLES: usize = 200;
const AS_GOOD: usize = 2;
const SEED: u64 = 0x7065_7269;

/// How what is left repeats.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Period {
    /// In time, cycles.
    pub cycles: Option<f64>,
    /// Along the canal, m.
    pub displacement_m: Option<f64>,
}

/// One run's ways, each at a place or time.
#[derive(Debug, Clone, Default)]
struct Series {
    cycle: Vec<f64>,
    place_m: Vec<f64>,
    displacement_m: Vec<f64>, // mean taken out
}

/// The period of what a fit leaves; the clearer one where both in time and along the canal are beyond chance.
pub(super) fn period(problem: &FitProblem<'_, '_>, fit: &Fit) -> Period {
    let runs = 0..problem.scene.observed.len();
    let series: Vec<Series> = runs.filter_map(|run| ways(problem, run, fit)).collect();
    period_of(&series)
}

fn period_of(series: &[Series]) -> Period {
    let longest = |at: fn(&Series) -> &[f64]| {
        let spans = series.iter().map(|one| at(one)[at(one).len() - 1] - at(one)[0]);
        spans.fold(0.0, f64::max)
    };
    let by_cycle = strongest(series, |one| &one.cycle, longest(|one| &one.cycle), SHORTEST.0);
    let span_m = longest(|one| &one.place_m);
    let cycles: usize = series.iter().map(|one| one.cycle.len()).max().unwrap_or(1);
    let by_place = strongest(series, |one| &one.place_m, span_m, SHORTEST.1 * span_m / cycles as f64);
    match (by_cycle, by_place) {
        (Some(by_cycle), Some(by_place)) if by_cycle.1 >= by_place.1 => Period {
            cycles: Some(by_cycle.0),
            displacement_m: None,
        },
        (Some(by_cycle), None) => Period {
            cycles: Some(by_cycle.0),
            displacement_m: None,
        },
        (_, Some(by_place)) => Period {
            cycles: None,
            displacement_m: Some(by_place.0),
        },
        (None, None) => Period::default(),
    }
}

/// What the body makes in each settled cycle of a run beyond the model's way.
fn ways(problem: &FitProblem<'_, '_>, run: usize, fit: &Fit) -> Option<Series> {
    let observed = &problem.scene.observed[run];
    let predicted = problem.scene.predict(run, &fit.hypothesis, &fit.at)?;
    let left = Residual::new(observed, &predicted);
    let from = observed.settled_from();
    let first = observed.phase.get(from)?;
    let count = observed.whole_cycles();
    let cells = observed.cells() as f64;
    // Means over a cycle: of what is left of the body's way, and of its place.
    let mut means: Vec<(f64, f64, f64)> = vec![(0.0, 0.0, 0.0); count];
    for sample in from..observed.samples() {
        let cycle = (observed.phase[sample] - first).floor() as usize;
        let place_m: f64 = observed.position_m.iter().map(|cell_m| cell_m[sample]).sum::<f64>() / cells;
        if let Some(mean) = means.get_mut(cycle)
            && (left.body_m[sample] + place_m).is_finite()
        {
            *mean = (mean.0 + left.body_m[sample], mean.1 + place_m, mean.2 + 1.0);
        }
    }
    let mut series = Series::default();
    for (cycle, pair) in means.windows(2).enumerate() {
        let (before, after) = (pair[0], pair[1]);
        if before.2 > 0.0 && after.2 > 0.0 {
            series.cycle.push(cycle as f64);
            series.place_m.push(0.5 * (before.1 / before.2 + after.1 / after.2));
            series.displacement_m.push(after.0 / after.2 - before.0 / before.2);
        }
    }
    let mean_m = series.displacement_m.iter().sum::<f64>() / series.displacement_m.len() as f64;
    series
        .displacement_m
        .iter_mut()
        .for_each(|displacement_m| *displacement_m -= mean_m);
    (series.displacement_m.len() >= MIN_CYCLES).then_some(series)
}

/// Period and share of the scatter of the wave that takes away most; none where chance does as well.
fn strongest(series: &[Series], at: impl Fn(&Series) -> &[f64], longest: f64, shortest: f64) -> Option<(f64, f64)> {
    if series.is_empty() || !(longest > shortest && shortest > 0.0) {
        return None;
    }
    let step = 1.0 / (OVERSAMPLED * longest);
    let count = ((1.0 / shortest) / step) as usize;
    let frequencies: Vec<f64> = (OVERSAMPLED as usize..=count)
        .map(|number| number as f64 * step)
        .collect();
    let best = |ways: &[Vec<f64>]| {
        let fraction = |&frequency: &f64| (frequency, fraction(series, &at, ways, frequency));
        let fractions = frequencies.iter().map(fraction);
        fractions.fold((0.0, 0.0), |best, one| if one.1 > best.1 { one } else { best })
    };
    let mut ways: Vec<Vec<f64>> = series.iter().map(|one| one.displacement_m.clone()).collect();
    let found = best(&ways);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(SEED);
    let mut as_good = 0;
    for _ in 0..SHUFFLES {
        ways.iter_mut().for_each(|ways| ways.shuffle(&mut rng));
        as_good += usize::from(best(&ways).1 >= found.1);
        if as_good > AS_GOOD {
            return None;
        }
    }
    Some((1.0 / found.0, found.1))
}

/// Share of the square sum of all ways that waves of one frequency take away.
fn fraction(series: &[Series], at: &impl Fn(&Series) -> &[f64], ways: &[Vec<f64>], frequency: f64) -> f64 {
    let (mut whole, mut taken) = (0.0, 0.0);
    for (one, ways) in series.iter().zip(ways) {
        let mut normal = Matrix3::zeros();
        let mut right = Vector3::zeros();
        for (at, displacement_m) in at(one).iter().zip(ways) {
            let (sin, cos) = (TAU * frequency * at).sin_cos();
            let wave = Vector3::new(cos, sin, 1.0);
            normal += wave * wave.transpose();
            right += wave * *displacement_m;
            whole += displacement_m * displacement_m;
        }
        taken += normal
            .try_inverse()
            .map_or(0.0, |inverse| right.dot(&(inverse * right)));
    }
    taken / whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};

    /// Three runs of eleven cycles with a wave and scatter of a quarter of its height.
    fn runs(wave: impl Fn(f64, f64) -> f64, seed: u64) -> Vec<Series> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut noise = || -> f64 { StandardNormal.sample(&mut rng) };
        [7.0e-3, 4.6e-3, 3.1e-3]
            .map(|advance_m| {
                let cycle: Vec<f64> = (0..11).map(f64::from).collect();
                let place_m: Vec<f64> = cycle.iter().map(|cycle| advance_m * cycle).collect();
                let ways = cycle.iter().zip(&place_m);
                let mut displacement_m: Vec<f64> =
                    ways.map(|(&cycle, &m)| wave(cycle, m) + 0.25e-4 * noise()).collect();
                let mean_m = displacement_m.iter().sum::<f64>() / 11.0;
                displacement_m
                    .iter_mut()
                    .for_each(|displacement_m| *displacement_m -= mean_m);
                Series {
                    cycle,
                    place_m,
                    displacement_m,
                }
            })
            .to_vec()
    }

    #[test]
    fn a_wave_is_found_in_time_or_along_the_canal() {
        for seed in 0..5 {
            let swings = period_of(&runs(|cycle, _| 1e-4 * (TAU * cycle / 4.3 + 1.0).sin(), seed));
            // Within three times the least standard error of a frequency, √(6/N) σ/A / (π T): Rife and Boorstyn 1974.
            let error = (6.0_f64 / 33.0).sqrt() * 0.25 / (0.5 * TAU * 10.0);
            assert!(
                swings
                    .cycles
                    .is_some_and(|cycles| (1.0 / cycles - 1.0 / 4.3).abs() < 3.0 * error),
                "seed {seed}: {swings:?}"
            );
            let ribs = period_of(&runs(|_, m| 1e-4 * (TAU * m / 11e-3 + 1.0).sin(), seed));
            assert!(
                ribs.displacement_m
                    .is_some_and(|displacement_m| (displacement_m - 11e-3).abs() < 0.6e-3),
                "seed {seed}: {ribs:?}"
            );
        }
    }

    #[test]
    fn scatter_has_no_period() {
        let found = (0..40).filter(|&seed| period_of(&runs(|_, _| 0.0, seed)) != Period::default());
        // One in a hundred for each of two searches: more than three of forty happen in one case of two hundred.
        assert!(found.count() <= 3);
    }
}
