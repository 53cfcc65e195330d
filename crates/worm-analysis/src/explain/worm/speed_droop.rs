//! Motor droop: what load does to time, not to positions.
//!
//! A motor that slows down under load leaves the positions of the crawl as they are and delays them. It shows in how long the steps take
//! against the force that the stepping cell needs: how much longer on a steep canal than on the level, and how much longer in the heavy
//! part of a step.
//!
//! # The model
//! Each step is divided into sixths. The logarithm of the duration of one, as the median over the cycles of a run, is a profile common to
//! all runs (cam and motor), plus ln(1 + d F) with F the mean force in it by the fitted model, plus what a motor does anyway: a speed
//! of its own in every run, swings once a step and once a turn that differ from run to run, and noise. All of these are normal with
//! the standard deviations below, so a generalised least-squares chi-squared measures how well each d fits. Sixths, since a swing once
//! a step can imitate any pattern of thirds. The mean speeds of whole runs show little: the mean force grows by only a third from the
//! level to 45°.

use super::observed::{MIN_CYCLES, Observed};
use super::predict::Scene;
use crate::explain::search::fit::Fit;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use std::f64::consts::TAU;
use worm_physics::effect::MOTOR_DROOP;
use worm_physics::{Crawl, Mechanics};

/// Parts that a step is cut into.
const PARTS: usize = 6;
/// Spread of the logarithm of a run's mean speed about that of the campaign.
const SPEED_OF_RUN: f64 = 0.01;
/// Spread of a run's own swing of the speed once in each step, and once in each turn.
const SWING_PER_STEP: f64 = 0.1;
const SWING_PER_TURN: f64 = 0.05;
/// Spread of one part beyond that: swings multiply.
const SWING_OF_PART: f64 = 0.004;
/// The same where the phase was found from the positions: compliance shifts it within a step under load.
const FOUND_PHASE: f64 = 0.05;
/// Spread of the profile that all runs share: it is unknown.
const SHARED: f64 = 1.0;
/// Largest correlation from one cycle to the next that so few cycles can establish.
const MAX_CORRELATION: f64 = 0.8;
/// Standard deviation over median deviation, of the normal distribution.
const BY_MEDIAN: f64 = 1.4826;
/// Variance of a median over that of a mean.
const MEDIAN_COST: f64 = 1.57;
/// Fraction of the usual speed below which the motor rests: a dwell is no droop.
const RESTS: f64 = 0.1;
/// Fraction of a part over which the speed is averaged for that.
const REST_WINDOW: f64 = 0.25;
/// Cycles that the model crawls before its forces count, and samples of them in each part.
const SETTLING_CYCLES: usize = 3;
const LOOKS: usize = 10;
/// Values of the slowdown on the initial grid, and Gauss-Newton steps from the best of them.
const TRIALS: usize = 60;
const POLISHING: usize = 20;

/// The slowdown of the motor under load, by the times of its steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::explain) struct SpeedDroop {
    /// d of speed = speed₀ / (1 + d F), beyond the nominal one, 1/N.
    pub slowdown_per_n: f64,
    /// Its standard error, 1/N.
    pub sigma: f64,
    /// Rise of twice the log likelihood over no slowdown.
    pub improvement: f64,
}

/// How long the parts of a run's cycle take, and under what force.
struct Paced {
    /// Logarithm of the duration over the nominal one, of each part from phase 0.
    late: Vec<f64>,
    /// Variance of each.
    variance: f64,
    /// Mean force in each part, 0 or more, N.
    force_n: Vec<f64>,
    /// Nominal slowdown, 1/N.
    nominal_per_n: f64,
}

/// Slowdown under load, by all runs with enough cycles; none where no run has, or no force is known.
///
/// `cycle_s_nominal` is the cycle time ordered on each run; an error common to all runs does not matter.
pub(in crate::explain) fn speed_droop(scene: &Scene<'_>, fit: &Fit, cycle_s_nominal: &[f64]) -> Option<SpeedDroop> {
    let runs = scene.observed.iter().zip(cycle_s_nominal).enumerate();
    let paced: Vec<Paced> = runs
        .filter_map(|(run, (observed, &cycle_s))| {
            let (late, variance) = lateness(observed, cycle_s)?;
            let (force_n, nominal_per_n) = forces(scene, run, fit)?;
            let of_phase = if observed.phase_recorded { 0.0 } else { FOUND_PHASE };
            Some(Paced {
                late,
                variance: variance + of_phase.powi(2),
                force_n,
                nominal_per_n,
            })
        })
        .collect();
    likeliest(&paced, MOTOR_DROOP.severity().max)
}

/// The most likely slowdown from 0 to a maximum.
fn likeliest(paced: &[Paced], max_per_n: f64) -> Option<SpeedDroop> {
    let factor = covariance(paced)?.cholesky()?;
    let whitened = |per_n: f64| whiten(&factor, left(paced, per_n));
    let chi_squared = |per_n: f64| whitened(per_n).norm_squared();
    let min = chi_squared(0.0);
    // Denser towards 0, where small differences matter.
    let trials = (0..=TRIALS).map(|trial| max_per_n * (trial as f64 / TRIALS as f64).powi(3));
    let (mut best, mut per_n) = trials
        .map(|per_n| (chi_squared(per_n), per_n))
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    for _ in 0..POLISHING {
        let slope = whiten(&factor, steepness(paced, per_n));
        let curvature = slope.norm_squared();
        if curvature <= 0.0 {
            break;
        }
        let next = (per_n - slope.dot(&whitened(per_n)) / curvature).clamp(0.0, max_per_n);
        let reached = chi_squared(next);
        if reached >= best {
            break;
        }
        (best, per_n) = (reached, next);
    }
    let curvature = whiten(&factor, steepness(paced, per_n)).norm_squared();
    Some(SpeedDroop {
        slowdown_per_n: per_n,
        sigma: curvature.sqrt().recip(),
        improvement: min - best,
    })
}

/// Residual of the lateness of all runs under a slowdown.
fn left(paced: &[Paced], per_n: f64) -> DVector<f64> {
    each_part(paced, |run, late, force_n| {
        late - ((run.nominal_per_n + per_n) * force_n).ln_1p()
    })
}

/// Its derivative.
fn steepness(paced: &[Paced], per_n: f64) -> DVector<f64> {
    each_part(paced, |run, _, force_n| {
        -force_n / (1.0 + (run.nominal_per_n + per_n) * force_n)
    })
}

fn each_part(paced: &[Paced], value: impl Fn(&Paced, f64, f64) -> f64) -> DVector<f64> {
    let values = paced
        .iter()
        .flat_map(|run| run.late.iter().zip(&run.force_n).map(|(&late, &n)| value(run, late, n)));
    DVector::from_vec(values.collect())
}

fn whiten(factor: &Cholesky<f64, Dyn>, mut values: DVector<f64>) -> DVector<f64> {
    // Its diagonal has no zeros, so there always is a solution.
    factor.l_dirty().solve_lower_triangular_mut(&mut values);
    values
}

/// Covariance of the lateness of all parts of all runs; none where there is no run.
fn covariance(paced: &[Paced]) -> Option<DMatrix<f64>> {
    let parts = paced.first()?.late.len();
    let angle = |a: usize, b: usize, period: usize| TAU * (a as f64 - b as f64) / period as f64;
    Some(DMatrix::from_fn(
        paced.len() * parts,
        paced.len() * parts,
        |row, column| {
            let ((run, part), (other_run, other)) = ((row / parts, row % parts), (column / parts, column % parts));
            let mut covariance = if part == other { SHARED.powi(2) } else { 0.0 };
            if run == other_run {
                covariance += SPEED_OF_RUN.powi(2)
                    + SWING_PER_STEP.powi(2) * angle(part, other, PARTS).cos()
                    + SWING_PER_TURN.powi(2) * angle(part, other, parts).cos();
                if part == other {
                    covariance += SWING_OF_PART.powi(2) + paced[run].variance;
                }
            }
            covariance
        },
    ))
}

/// How much longer than nominal each part of a cycle takes, as a logarithm, and the variance of that; none with too few cycles.
fn lateness(observed: &Observed<'_>, cycle_s: f64) -> Option<(Vec<f64>, f64)> {
    let parts = PARTS * observed.cells();
    let from = observed.settled_from();
    let phase = observed.phase.get(from..)?;
    let moving_s = moving_s(&observed.run.recording.time_s[from..], phase, parts);
    let first = (phase.first()? * parts as f64).ceil();
    let cycles = ((phase.last()? * parts as f64 - first) / parts as f64).floor().max(0.0) as usize;
    if cycles < MIN_CYCLES {
        return None;
    }
    let reached_s: Vec<f64> = (0..=cycles * parts)
        .map(|part| reached_s(&moving_s, phase, (first + part as f64) / parts as f64))
        .collect();
    let nominal_s = cycle_s / parts as f64;
    let mut by_part: Vec<Vec<f64>> = vec![Vec::new(); parts];
    for (number, pair) in reached_s.windows(2).enumerate() {
        let place = (first as i64 + number as i64).rem_euclid(parts as i64) as usize;
        by_part[place].push(((pair[1] - pair[0]) / nominal_s).ln());
    }
    // A part of no duration was not seen.
    if by_part.iter().flatten().any(|late| !late.is_finite()) {
        return None;
    }
    let late: Vec<f64> = by_part.iter().map(|cycles| median(cycles.clone())).collect();
    let off = |part: usize, cycle: usize| by_part[part][cycle] - late[part];
    let all_off = (0..parts).flat_map(|part| (0..cycles).map(move |cycle| off(part, cycle).abs()));
    let spread = BY_MEDIAN * median(all_off.collect());
    // The speed of the motor drifts slowly: neighbouring cycles are correlated.
    let blocks: Vec<f64> = (0..cycles)
        .map(|cycle| median((0..parts).map(|part| off(part, cycle)).collect()))
        .collect();
    let squares: f64 = blocks.iter().map(|off| off * off).sum();
    let products: f64 = blocks.windows(2).map(|pair| pair[0] * pair[1]).sum();
    let correlation = if squares > 0.0 {
        (products / squares).clamp(0.0, MAX_CORRELATION)
    } else {
        0.0
    };
    let alike = (1.0 + correlation) / (1.0 - correlation);
    Some((late, MEDIAN_COST * spread * spread * alike / (cycles as f64 - 1.0)))
}

/// Time in which the motor turned, up to each sample, s.
fn moving_s(time_s: &[f64], phase: &[f64], parts: usize) -> Vec<f64> {
    let last = time_s.len() - 1;
    let usual = (phase[last] - phase[0]) / last as f64; // per sample; rests lower it, and then fewer of them are found
    let window = ((REST_WINDOW / parts as f64 / usual).ceil() as usize).clamp(1, last);
    let mut rests = vec![false; last];
    for at in 0..=last - window {
        if phase[at + window] - phase[at] < RESTS * usual * window as f64 {
            rests[at..at + window].fill(true);
        }
    }
    let mut moved_s = 0.0;
    let mut moving_s = vec![0.0];
    for (pair, rests) in time_s.windows(2).zip(rests) {
        if !rests {
            moved_s += pair[1] - pair[0];
        }
        moving_s.push(moved_s);
    }
    moving_s
}

/// When a phase was reached, s.
fn reached_s(time_s: &[f64], phase: &[f64], at: f64) -> f64 {
    let after = phase.partition_point(|&phase| phase < at).clamp(1, phase.len() - 1);
    let width = phase[after] - phase[after - 1];
    let fraction = if width > 0.0 {
        (at - phase[after - 1]) / width
    } else {
        1.0
    };
    time_s[after - 1] + fraction * (time_s[after] - time_s[after - 1])
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let high = values.len() / 2;
    if values.len().is_multiple_of(2) {
        0.5 * (values[high - 1] + values[high])
    } else {
        values[high]
    }
}

/// Mean force of the stepping cell's actuator in each part of a settled cycle by the fitted model, N, and the nominal
/// slowdown, 1/N; none where the worm slides down.
fn forces(scene: &Scene<'_>, run: usize, fit: &Fit) -> Option<(Vec<f64>, f64)> {
    let observed = &scene.observed[run];
    let (physics, damping) = scene.physics(run, &fit.hypothesis, &fit.at);
    let mechanics = Mechanics::new(&physics);
    let looks = PARTS * observed.cells() * LOOKS;
    let look_s = observed.cycle_s / looks as f64;
    let mut crawl = Crawl::at_rest(&mechanics, 0.0, &observed.first_m, Some(damping)).ok()?;
    let mut force_n = vec![0.0; PARTS * observed.cells()];
    for look in 0..(SETTLING_CYCLES + 1) * looks {
        // In the middle of each look: at its ends another cell may step.
        let phase = (look as f64 + 0.5) / looks as f64;
        crawl.advance_to(&mechanics, phase, look_s).ok()?;
        if let Some(look) = look.checked_sub(SETTLING_CYCLES * looks) {
            force_n[look / LOOKS] += crawl.actuator_force_n(&mechanics).max(0.0) / LOOKS as f64;
        }
    }
    Some((force_n, physics.slowdown_per_n))
}

#[cfg(test)]
mod tests;
