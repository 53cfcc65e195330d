//! Whether the residual of the body repeats: after so many cycles, or after so many millimetres of canal.
//!
//! The displacement of the body in each cycle beyond the model's is fitted by a sine over the number of the cycle, and over the place of
//! the worm, with its own amplitude, phase and mean in every run (generalised Lomb-Scargle, Zechmeister and Kürster 2009: cycles are few
//! and unevenly spaced, and the mean of few periods is not that of the wave). The largest fraction of the variance that a sine
//! explains is compared with what it explains after shuffling the cycles of each run.
//!
//! How probable the wave is beside scatter of unknown size follows from the same fractions ([`super::wave`]), with a prior worth one cycle
//! of each run. The mean over frequencies and both kinds of waves is the evidence.

use super::observed::Observed;
use super::predicted::Predicted;
use super::recorded_worm::RecordedWorm;
use super::residual::Residual;
use super::sway;
use super::wave::ln_bayes_of_fraction;
use crate::explain::search::fit::Fit;
use crate::explain::search::judge::ln_sum::ln_mean;
use nalgebra::{Matrix3, Vector3};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;

/// Fewest cycles of a run that can show a wave.
const MIN_CYCLES: usize = 6;
/// Shortest period, in cycles and, along the canal, in mean advances of a cycle: places are uneven enough to see below two.
const SHORTEST: (f64, f64) = (2.0, 0.5);
/// Oversampling of the frequencies that a run can resolve.
const OVERSAMPLED: f64 = 12.0;
/// The same for the evidence: frequencies that a run tells apart.
const APART: f64 = 2.0;
/// How often the cycles are shuffled, and in how many of these a sine may do as well.
const SHUFFLES: usize = 200;
const AS_GOOD: usize = 2;
const SEED: u64 = 0x7065_7269;

/// How the residual repeats.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in crate::explain) struct Period {
    /// Period in time, cycles.
    pub cycles: Option<f64>,
    /// Period along the canal, m.
    pub displacement_m: Option<f64>,
}

/// One run's displacements, each with its time and place.
#[derive(Debug, Clone, Default)]
struct Series {
    cycle: Vec<f64>,
    place_m: Vec<f64>,
    displacement_m: Vec<f64>, // mean taken out
}

/// Logarithm of the Bayes factor of a wave in the residual of a fit against scatter; none where no run is long enough.
pub(in crate::explain) fn ln_bayes(worm: &RecordedWorm<'_>, predicted: &[Option<Predicted>]) -> Option<f64> {
    ln_bayes_of(&displacements_of_all(worm, predicted))
}

fn ln_bayes_of(series: &[Series]) -> Option<f64> {
    let displacements: Vec<Vec<f64>> = series.iter().map(|one| one.displacement_m.clone()).collect();
    let runs = series.len() as f64;
    let count: f64 = displacements.iter().map(|one| one.len() as f64).sum();
    let (free, waves) = (count - runs, 2.0 * runs);
    let worth = count / runs;
    let of_fraction = |fraction: f64| ln_bayes_of_fraction(fraction, free, waves, worth);
    let of_all = |at: fn(&Series) -> &[f64], frequencies: Vec<f64>| {
        let each = frequencies
            .iter()
            .map(|&frequency| of_fraction(fraction(series, &at, &displacements, frequency)));
        ln_mean(&each.collect::<Vec<_>>())
    };
    let (by_cycle, by_place) = spans(series);
    let both = [
        of_all(|one| &one.cycle, frequencies(by_cycle, APART)),
        of_all(|one| &one.place_m, frequencies(by_place, APART)),
    ];
    ln_mean(&both.into_iter().flatten().collect::<Vec<_>>())
}

/// The period of the residual of a fit: from cycle to cycle in time or along the canal, the clearer one where both are beyond chance,
/// or else within the cycles.
pub(in crate::explain) fn period(worm: &RecordedWorm<'_>, fit: &Fit) -> Period {
    let predicted = worm.predictions(fit);
    match period_of(&displacements_of_all(worm, &predicted)) {
        Period {
            cycles: None,
            displacement_m: None,
        } => Period {
            cycles: sway::period(worm, &predicted),
            displacement_m: None,
        },
        found => found,
    }
}

fn period_of(series: &[Series]) -> Period {
    let (cycles, places) = spans(series);
    let by_cycle = strongest(series, |one| &one.cycle, &frequencies(cycles, OVERSAMPLED));
    let by_place = strongest(series, |one| &one.place_m, &frequencies(places, OVERSAMPLED));
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

fn displacements_of_all(worm: &RecordedWorm<'_>, predicted: &[Option<Predicted>]) -> Vec<Series> {
    let runs = worm.scene.observed.iter().zip(predicted);
    runs.filter_map(|(observed, predicted)| displacements(observed, predicted.as_ref()?))
        .collect()
}

/// Displacement of the body in each settled cycle of a run beyond the model's.
fn displacements(observed: &Observed<'_>, predicted: &Predicted) -> Option<Series> {
    let left = Residual::new(observed, predicted);
    let from = observed.settled_from();
    let first = observed.phase.get(from)?;
    let count = observed.whole_cycles();
    let cells = observed.cells() as f64;
    // Means over a cycle: of the residual of the body, and of its place.
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

/// The longest run and the shortest period that it shows: in cycles, and along the canal in metres.
fn spans(series: &[Series]) -> ((f64, f64), (f64, f64)) {
    let longest = |at: fn(&Series) -> &[f64]| {
        let spans = series.iter().map(|one| at(one)[at(one).len() - 1] - at(one)[0]);
        spans.fold(0.0, f64::max)
    };
    let span_m = longest(|one| &one.place_m);
    let cycles: usize = series.iter().map(|one| one.cycle.len()).max().unwrap_or(1);
    (
        (longest(|one| &one.cycle), SHORTEST.0),
        (span_m, SHORTEST.1 * span_m / cycles as f64),
    )
}

/// Frequencies from one wave in the longest run to the shortest period.
fn frequencies((longest, shortest): (f64, f64), oversampled: f64) -> Vec<f64> {
    if !(longest > shortest && shortest > 0.0) {
        return Vec::new();
    }
    let step = 1.0 / (oversampled * longest);
    let count = ((1.0 / shortest) / step) as usize;
    (oversampled as usize..=count)
        .map(|number| number as f64 * step)
        .collect()
}

/// Period of the sine that explains most of the variance, and the fraction; none where chance does as well.
fn strongest(series: &[Series], at: impl Fn(&Series) -> &[f64], frequencies: &[f64]) -> Option<(f64, f64)> {
    if frequencies.is_empty() {
        return None;
    }
    let best = |displacements: &[Vec<f64>]| {
        let fraction = |&frequency: &f64| (frequency, fraction(series, &at, displacements, frequency));
        let fractions = frequencies.iter().map(fraction);
        fractions.fold((0.0, 0.0), |best, one| if one.1 > best.1 { one } else { best })
    };
    let mut displacements: Vec<Vec<f64>> = series.iter().map(|one| one.displacement_m.clone()).collect();
    let found = best(&displacements);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(SEED);
    let mut as_good = 0;
    for _ in 0..SHUFFLES {
        displacements
            .iter_mut()
            .for_each(|displacements| displacements.shuffle(&mut rng));
        as_good += usize::from(best(&displacements).1 >= found.1);
        if as_good > AS_GOOD {
            return None;
        }
    }
    Some((1.0 / found.0, found.1))
}

/// Fraction of the square sum of all ways that waves of one frequency take away.
fn fraction(series: &[Series], at: &impl Fn(&Series) -> &[f64], displacements: &[Vec<f64>], frequency: f64) -> f64 {
    let (mut whole, mut taken) = (0.0, 0.0);
    for (one, displacements) in series.iter().zip(displacements) {
        let mut normal = Matrix3::zeros();
        let mut right = Vector3::zeros();
        for (at, displacement_m) in at(one).iter().zip(displacements) {
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
                let displacements = cycle.iter().zip(&place_m);
                let mut displacement_m: Vec<f64> = displacements
                    .map(|(&cycle, &m)| wave(cycle, m) + 0.25e-4 * noise())
                    .collect();
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
    fn a_wave_is_evidence_and_scatter_is_none() {
        let of =
            |wave: &dyn Fn(f64, f64) -> f64, seed: u64| ln_bayes_of(&runs(wave, seed)).expect("they are long enough");
        for seed in 0..5 {
            let swings = of(&|cycle, _| 1e-4 * (TAU * cycle / 4.3 + 1.0).sin(), seed);
            let ribs = of(&|_, m| 1e-4 * (TAU * m / 11e-3 + 1.0).sin(), seed);
            assert!(swings > 5.0 && ribs > 5.0, "seed {seed}: {swings} and {ribs}");
        }
        // The mean of a Bayes factor over data without a wave is 1, most of it from few of them.
        let mean = (0..200).map(|seed| of(&|_, _| 0.0, seed).exp()).sum::<f64>() / 200.0;
        assert!((0.02..4.0).contains(&mean), "{mean}");
    }

    #[test]
    fn scatter_has_no_period() {
        let found = (0..40).filter(|&seed| period_of(&runs(|_, _| 0.0, seed)) != Period::default());
        // One in a hundred for each of two searches: more than three of forty happen in one case of two hundred.
        assert!(found.count() <= 3);
    }
}
