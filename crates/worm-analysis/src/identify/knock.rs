//! Knocks of the camera: all cells shift at once, and stay.
//!
//! A worm that sticks slips, and then all cells shift at once, too. But its slips recur: every cycle has one near the same phase. A knock
//! has no like in other cycles. So the displacement of the body from a few samples before a moment to a few after is compared with what
//! the other cycles show around the same phase, and counts only as far as it exceeds the second largest of those. Single slips remain, where
//! a tip comes upon another surface; they are bounded by what the tips can hold, and a knock must be larger than that.

use super::gait::{IdentifiedGait, steps_made};

/// Samples before and after a moment.
const SIDE: usize = 5;
/// Longest time that they span, in median sample periods.
const MAX_SPAN_PERIODS: f64 = 20.0;
/// Phase around the same phase of another cycle in which the like is looked for, cycles.
const NEAR: f64 = 1.0 / 48.0;
/// A knock exceeds this many standard deviations of the noise of the comparison,
const NOISES: f64 = 8.0;
/// and this fraction of the stroke.
const MIN_STROKE: f64 = 0.05;
/// and so many times every other displacement that no other cycle has the like of.
const STANDS_OUT: f64 = 3.0;
/// Fraction of its shift that happens from one sample to the next, but for so many standard deviations of the noise.
const ABRUPT: (f64, f64) = (0.8, 2.0);
/// Cycles at the start that are not looked at.
const FIRST_CYCLES: f64 = 1.0;
/// How far a cell's own shift may be from that of all: in standard deviations of its noise, and as a fraction of the shift (a camera that
/// turns shifts cells by their places).
const AGREE: (f64, f64) = (4.0, 0.25);
/// Fewest other cycles that must show the same phase.
const MIN_OTHERS: usize = 2;
/// Fastest motion, as a multiple of that in another cycle, for which its displacement is scaled up.
const MAX_FASTER: f64 = 3.0;

/// A shift of all cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Knock {
    /// The first sample after it.
    pub sample: usize,
    /// How far all cells were shifted, m.
    pub shift_m: f64,
    /// Standard error of that, m.
    pub sigma_m: f64,
}

/// The displacement around one sample.
#[derive(Debug, Clone, Copy)]
struct Around {
    sample: usize,
    phase: f64,
    phase_change: f64,
    moved_m: f64,
    sigma_m: f64,
}

/// Finds the knocks in a recording whose gait is known, in order of time.
pub fn find(time_s: &[f64], position_m: &[Vec<f64>], gait: &IdentifiedGait) -> Vec<Knock> {
    let around = displacements(time_s, gait);
    let excesses: Vec<f64> = (0..around.len())
        .map(|at| excess_m(&around, at).unwrap_or(0.0))
        .collect();
    let from_phase = gait.phase[0] + FIRST_CYCLES;
    let (mut knocks, mut largest_other_m) = (Vec::new(), 0.0_f64);
    for at in peaks(&excesses) {
        let size_m = excesses[at].abs();
        let here = &around[at];
        if here.phase < from_phase {
            continue;
        }
        let is_large = size_m > (NOISES * here.sigma_m).max(MIN_STROKE * gait.stroke_m);
        match estimate(&around, at)
            .filter(|knock| is_large && is_abrupt(gait, knock) && cells_agree(position_m, gait, knock))
        {
            Some(knock) => knocks.push((knock, size_m)),
            None => largest_other_m = largest_other_m.max(size_m),
        }
    }
    let standing_out = knocks
        .into_iter()
        .filter(|(_, size_m)| *size_m >= STANDS_OUT * largest_other_m);
    standing_out.map(|(knock, _)| knock).collect()
}

/// Where the size is largest among its neighbours.
fn peaks(excesses_m: &[f64]) -> impl Iterator<Item = usize> + '_ {
    (0..excesses_m.len()).filter(|&at| {
        let size_m = excesses_m[at].abs();
        let near = at.saturating_sub(2 * SIDE)..(at + 2 * SIDE + 1).min(excesses_m.len());
        size_m > 0.0
            && near
                .into_iter()
                .all(|other| excesses_m[other].abs() < size_m || (other >= at && excesses_m[other].abs() == size_m))
    })
}

/// Whether most of the shift happens from one sample to the next.
fn is_abrupt(gait: &IdentifiedGait, knock: &Knock) -> bool {
    let near = knock.sample.saturating_sub(2)..=(knock.sample + 1).min(gait.phase.len() - 2);
    let steps_m = near.map(|sample| gait.body_m[sample + 1] - gait.body_m[sample]);
    let largest_m = steps_m
        .filter(|step_m| step_m.is_finite())
        .fold(0.0, |max: f64, step_m| max.max(step_m * knock.shift_m.signum()));
    let noise_m = gait.noise_m * (2.0 / gait.seen[knock.sample].max(1) as f64).sqrt();
    largest_m + ABRUPT.1 * noise_m >= ABRUPT.0 * knock.shift_m.abs()
}

/// The displacement of the body around every sample that has enough on both sides.
fn displacements(time_s: &[f64], gait: &IdentifiedGait) -> Vec<Around> {
    let seen: Vec<usize> = (0..time_s.len())
        .filter(|&sample| gait.body_m[sample].is_finite())
        .collect();
    let last = time_s.len() - 1;
    let period_s = (time_s[last] - time_s[0]) / last as f64;
    let mean = |samples: &[usize], value: &dyn Fn(usize) -> f64| {
        samples.iter().map(|&sample| value(sample)).sum::<f64>() / samples.len() as f64
    };
    let windows = seen.windows(2 * SIDE);
    let usable =
        windows.filter(|window| time_s[window[2 * SIDE - 1]] - time_s[window[0]] <= MAX_SPAN_PERIODS * period_s);
    usable
        .map(|window| {
            let (before, after) = window.split_at(SIDE);
            let change = |value: &dyn Fn(usize) -> f64| mean(after, value) - mean(before, value);
            let variance = mean(window, &|sample| 1.0 / gait.seen[sample].max(1) as f64);
            Around {
                sample: after[0],
                phase: mean(window, &|sample| gait.phase[sample]),
                phase_change: change(&|sample| gait.phase[sample]),
                moved_m: change(&|sample| gait.body_m[sample]),
                sigma_m: gait.noise_m * (2.0 * variance / SIDE as f64).sqrt(),
            }
        })
        .collect()
}

/// What other cycles show around the phase of `at`: for each, the displacements there, scaled to the speed here.
fn in_other_cycles<'a>(
    around: &'a [Around],
    at: usize,
) -> impl Iterator<Item = impl Iterator<Item = (f64, f64)> + 'a> + 'a {
    let here = around[at];
    let (first, last) = (around[0].phase, around[around.len() - 1].phase);
    let cycles = (first - here.phase).floor() as i64..=(last - here.phase).ceil() as i64;
    cycles.filter(|cycle| *cycle != 0).map(move |cycle| {
        let phase = here.phase + cycle as f64;
        let from = around.partition_point(|other| other.phase < phase - NEAR);
        let to = around.partition_point(|other| other.phase <= phase + NEAR);
        around[from..to].iter().map(move |other| {
            let faster = here.phase_change / other.phase_change;
            let faster = if faster.is_finite() {
                faster.clamp(1.0, MAX_FASTER)
            } else {
                1.0
            };
            ((other.phase - phase).abs(), other.moved_m * faster)
        })
    })
}

/// By how much the displacement at a sample exceeds what at least two other cycles show near the same phase, m, with its sign; standing
/// still never exceeds. None where too few other cycles show the phase.
fn excess_m(around: &[Around], at: usize) -> Option<f64> {
    let (mut largest, mut smallest) = (Vec::new(), Vec::new());
    for cycle in in_other_cycles(around, at) {
        let range = cycle.fold(None, |range: Option<(f64, f64)>, (_, moved_m)| {
            let (low, high) = range.unwrap_or((moved_m, moved_m));
            Some((low.min(moved_m), high.max(moved_m)))
        });
        if let Some((low, high)) = range {
            smallest.push(low);
            largest.push(high);
        }
    }
    if largest.len() < MIN_OTHERS {
        return None;
    }
    largest.sort_by(|a, b| b.total_cmp(a));
    smallest.sort_by(f64::total_cmp);
    let here_m = around[at].moved_m;
    let (high, low) = (largest[1].max(0.0), smallest[1].min(0.0));
    Some((here_m - high).max(0.0) + (here_m - low).min(0.0))
}

/// The shift at a sample: the displacement less the median of that at the same phase of other cycles.
fn estimate(around: &[Around], at: usize) -> Option<Knock> {
    let mut usual_m: Vec<f64> = in_other_cycles(around, at)
        .filter_map(|cycle| cycle.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, moved_m)| moved_m))
        .collect();
    usual_m.sort_by(f64::total_cmp);
    let median_m = *usual_m.get(usual_m.len() / 2)?;
    let mut deviations_m: Vec<f64> = usual_m.iter().map(|moved_m| (moved_m - median_m).abs()).collect();
    deviations_m.sort_by(f64::total_cmp);
    // The median of |x| is 0.6745 standard deviations.
    let scatter_m = deviations_m[deviations_m.len() / 2] / 0.6745;
    let here = around[at];
    Some(Knock {
        sample: here.sample,
        shift_m: here.moved_m - median_m,
        sigma_m: (here.sigma_m.powi(2) + scatter_m.powi(2)).sqrt(),
    })
}

/// Whether every cell that is seen on both sides shifts like all together.
fn cells_agree(position_m: &[Vec<f64>], gait: &IdentifiedGait, knock: &Knock) -> bool {
    let samples = gait.phase.len();
    let before = knock.sample.saturating_sub(SIDE)..knock.sample;
    let after = knock.sample..(knock.sample + SIDE).min(samples);
    let cells = gait.step_order.len();
    let shift_m = |place: usize| {
        let cell = gait.step_order[place];
        let mean = |range: std::ops::Range<usize>| {
            let (sum, count) = range
                .map(|sample| position_m[cell][sample] - gait.stroke_m * steps_made(cells, place, gait.phase[sample]))
                .filter(|at_m| at_m.is_finite())
                .fold((0.0, 0.0), |(sum, count), at_m| (sum + at_m, count + 1.0));
            sum / count
        };
        mean(after.clone()) - mean(before.clone())
    };
    let mut shifts_m: Vec<f64> = (0..cells).map(shift_m).filter(|shift_m| shift_m.is_finite()).collect();
    if shifts_m.is_empty() {
        return false;
    }
    shifts_m.sort_by(f64::total_cmp);
    let middle_m = shifts_m[shifts_m.len() / 2];
    let allowed_m = AGREE.0 * gait.noise_m * (2.0 / SIDE as f64).sqrt() + AGREE.1 * knock.shift_m.abs();
    shifts_m.iter().all(|shift_m| (shift_m - middle_m).abs() <= allowed_m)
}

#[cfg(test)]
mod tests;
