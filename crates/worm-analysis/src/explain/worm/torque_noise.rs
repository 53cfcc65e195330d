//! The noise of the torque: how well the current repeats from cycle to cycle.
//!
//! As of the positions (see [`super::noise`]): neighbouring cycles differ by noise alone, whatever the model misses, and a median does not
//! see a change in mid-run. Beside the jump from one step to the next a bin's torque depends on when exactly the jump was sampled; those
//! bins do not count. Nor do those in which the drive was brought to rest, or set in motion: the friction of the gears and the dampers in
//! the pads are known at one speed alone.

use super::noise::variance;
use super::observed::Observed;
use super::torque_residual::ends;
use crate::explain::search::bins::{Bin, Bins};
use std::ops::Range;

/// Torque that no bin is sure of, N m: rounding of current and velocity within it.
const FLOOR_N_M: f64 = 2e-4;
/// Fewest bins of a step of which the outer ones can be left out.
const MIN_BINS: usize = 4;
/// By how much of itself the pace of the drive may differ from that at the same place a cycle before or after.
const SAME_PACE: f64 = 0.1;

/// The noise of the torque in one run.
#[derive(Debug, Clone, Default)]
pub(in crate::explain) struct TorqueNoise {
    /// One over the standard deviation in each bin, 1/(N m); 0 where it does not count. Empty without a current.
    scale: Vec<f64>,
}

impl TorqueNoise {
    /// By the residual of the torque in bins under some hypothesis, N m.
    pub fn measure(observed: &Observed<'_>, bins: &Bins, residual_n_m: &[f64]) -> Self {
        if residual_n_m.is_empty() {
            return Self::default();
        }
        let is_steady = at_steady_pace(observed, bins);
        let is_evidence = |bin: usize| is_steady[bin] && !is_at_jump(bins, bin);
        let is_settled = |bin: usize| bins.bins[bin].samples.start >= observed.settled_from();
        let changes: Vec<f64> = (0..bins.len())
            .map(|bin| match cycles_later(bins, bin, 1) {
                Some(later) if is_settled(bin) && is_evidence(bin) && is_evidence(later) => {
                    residual_n_m[later] - residual_n_m[bin]
                }
                _ => f64::NAN,
            })
            .collect();
        let of_bin = 0.5 * variance(&changes).unwrap_or(0.0);
        // What neighbouring bins share counts as often as there are bins.
        let of_steps: Vec<f64> = changes.chunks(bins.per_step).map(mean_of_seen).collect();
        let along = variance(&of_steps).map_or(1.0, |of_step| 0.5 * of_step * bins.per_step as f64 / of_bin);
        let variance = of_bin * along.clamp(1.0, bins.per_step as f64) + FLOOR_N_M.powi(2);
        let scale = |(bin, residual): (usize, &f64)| {
            if residual.is_finite() && is_evidence(bin) {
                variance.sqrt().recip()
            } else {
                0.0
            }
        };
        Self {
            scale: residual_n_m.iter().enumerate().map(scale).collect(),
        }
    }

    /// Rows of a run: none without a current.
    pub fn rows(&self) -> usize {
        self.scale.len()
    }

    /// Whether a bin's torque is evidence; not without a current.
    pub fn counts(&self, bin: usize) -> bool {
        self.scale.get(bin).is_some_and(|scale| *scale > 0.0)
    }

    /// Root mean square over the bins of a cycle of what is there on average, N m.
    pub fn rms_of_mean_cycle(&self, bins: &Bins, torque_n_m: &[f64]) -> f64 {
        let places = bins.per_cycle() as usize;
        let (mut sums_n_m, mut counts) = (vec![0.0; places], vec![0.0; places]);
        for bin in (0..bins.len()).filter(|&bin| self.counts(bin)) {
            sums_n_m[bins.place(bin)] += torque_n_m[bin];
            counts[bins.place(bin)] += 1.0;
        }
        let seen = sums_n_m.iter().zip(&counts).filter(|(_, count)| **count > 0.0);
        let squares: Vec<f64> = seen.map(|(sum_n_m, count)| (sum_n_m / count).powi(2)).collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }

    /// Appends a torque in every bin, N m, whitened.
    pub fn whiten(&self, torque_n_m: &[f64], out: &mut Vec<f64>) {
        let with_scale = torque_n_m.iter().zip(&self.scale);
        out.extend(with_scale.map(|(torque, scale)| if *scale > 0.0 { torque * scale } else { 0.0 }));
    }
}

/// The bin at the same place some cycles later.
fn cycles_later(bins: &Bins, bin: usize, cycles: i64) -> Option<usize> {
    let number = bins.bins[bin].number + cycles * bins.per_cycle();
    let at = bins.bins.partition_point(|bin| bin.number < number);
    bins.bins.get(at).filter(|bin| bin.number == number).map(|_| at)
}

/// In which bins the drive turned as fast as at the same place a cycle before or after.
fn at_steady_pace(observed: &Observed<'_>, bins: &Bins) -> Vec<bool> {
    let time_s = &observed.run.recording.time_s;
    let of_bin = |bin: &Bin| {
        let Range { start, end } = ends(observed, &bin.samples);
        (observed.phase[end] - observed.phase[start]) / (time_s[end] - time_s[start])
    };
    let paces: Vec<f64> = bins.bins.iter().map(of_bin).collect();
    let is_same = |bin: usize, other: usize| (paces[other] / paces[bin] - 1.0).abs() < SAME_PACE;
    (0..bins.len())
        .map(|bin| {
            let beside = [-1, 1].map(|cycles| cycles_later(bins, bin, cycles));
            beside.into_iter().flatten().any(|other| is_same(bin, other))
        })
        .collect()
}

/// Whether a bin lies beside the jump from one step to the next.
fn is_at_jump(bins: &Bins, bin: usize) -> bool {
    let of_step = bins.place(bin) % bins.per_step;
    bins.per_step >= MIN_BINS && (of_step == 0 || of_step + 1 == bins.per_step)
}

fn mean_of_seen(values: &[f64]) -> f64 {
    let seen: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    seen.iter().sum::<f64>() / seen.len() as f64
}

#[cfg(test)]
mod tests {
    use super::super::binning::bins;
    use super::*;
    use crate::explain::fixture::{Campaign, record, scene};
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use std::f64::consts::TAU;

    #[test]
    fn it_is_what_does_not_repeat_and_leaves_the_jumps_out() {
        const NOISE_N_M: f64 = 2e-3;
        let campaign = Campaign::default();
        let recordings = record(&campaign, None, 5);
        let scene = scene(&recordings, &campaign);
        let observed = &scene.observed[0];
        let bins = bins(observed);
        assert!(bins.per_step >= MIN_BINS);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        // What repeats, and far more where one step follows the other, is no noise.
        let residual_n_m: Vec<f64> = (0..bins.len())
            .map(|bin| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                let repeats_n_m = 0.01 * (TAU * bins.bins[bin].phase).sin();
                let jump_n_m = if is_at_jump(&bins, bin) { 0.5 * noise } else { 0.0 };
                repeats_n_m + jump_n_m + NOISE_N_M * noise
            })
            .collect();
        let noise = TorqueNoise::measure(observed, &bins, &residual_n_m);
        assert_eq!(noise.rows(), bins.len());
        let mut unit = Vec::new();
        noise.whiten(&vec![1.0; bins.len()], &mut unit);
        for (bin, scale) in unit.iter().enumerate() {
            if is_at_jump(&bins, bin) {
                assert!(*scale == 0.0, "bin {bin}");
            } else {
                // At most what neighbours seem to share by chance makes it larger.
                assert!((0.7..1.15).contains(&(scale * NOISE_N_M)), "bin {bin}: {scale}");
            }
        }
        let mean_n_m = noise.rms_of_mean_cycle(&bins, &residual_n_m);
        assert!((mean_n_m / (0.01 / 2f64.sqrt()) - 1.0).abs() < 0.1, "{mean_n_m}");
    }

    /// As a controller that ends a crawl does, which the model's mean cycle does not.
    #[test]
    fn a_drive_that_slows_down_at_the_end_is_no_evidence() {
        const STOPS_CYCLES: f64 = 0.15;
        let campaign = Campaign::default();
        let mut recordings = record(&campaign, None, 5);
        let recording = &mut recordings[0];
        let phase = recording.gait_phase.as_ref().expect("it is simulated with one");
        let stops_at = phase.last().expect("samples") - STOPS_CYCLES;
        let from = phase.partition_point(|&phase| phase < stops_at);
        let from_s = recording.time_s[from];
        for at_s in &mut recording.time_s[from..] {
            *at_s = from_s + 1.5 * (*at_s - from_s);
        }
        let scene = scene(&recordings, &campaign);
        let observed = &scene.observed[0];
        let bins = bins(observed);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(6);
        let scatter_n_m: Vec<f64> = (0..bins.len())
            .map(|_| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                2e-3 * noise
            })
            .collect();
        let noise = TorqueNoise::measure(observed, &bins, &scatter_n_m);
        let within = |bin: usize| !is_at_jump(&bins, bin);
        let (steady, slow): (Vec<usize>, Vec<usize>) = (0..bins.len())
            .filter(|&bin| within(bin))
            .partition(|&bin| ends(observed, &bins.bins[bin].samples).end <= from);
        assert!(
            slow.len() > 3 && steady.len() > 10 * slow.len(),
            "{} and {}",
            slow.len(),
            steady.len()
        );
        let lost: Vec<usize> = steady.into_iter().filter(|&bin| !noise.counts(bin)).collect();
        assert!(lost.is_empty(), "{lost:?}");
        let partly = slow.iter().filter(|&&bin| bins.bins[bin].samples.start < from).count();
        assert!(slow[partly..].iter().all(|&bin| !noise.counts(bin)), "{slow:?}");
    }
}
