//! Prepares the runs of a campaign, and recalibrates the model on them.

use super::bins::Bins;
use super::discrepancy::Discrepancy;
use super::error::ExplainError;
use super::fit::{Fit, FitProblem};
use super::hypothesis::Hypothesis;
use super::noise::RunNoise;
use super::observed::Observed;
use super::parameter::{Nuisance, What};
use super::predict::{Scene, nominal, predict};
use super::residual::Residual;
use crate::experiment::RecordedRun;
use worm_estimator::config::Config;
use worm_physics::effect::Setting;
use worm_physics::{Physics, Worm};

/// Most recalibrations before the last one, which each give the noise of the next and judge the starts of the runs.
const ROUNDS: usize = 3;
/// Damping ratios of a body before it is known, and of a heavily damped one.
const USUAL: f64 = 0.4;
const HEAVY: f64 = 2.0;

/// Prepares the runs of a campaign.
pub(super) fn prepare<'a>(runs: &[RecordedRun<'a>], config: &Config) -> Result<Scene<'a>, ExplainError> {
    if runs.is_empty() {
        return Err(ExplainError::NoRun);
    }
    if config.worm.cells < 3 {
        return Err(ExplainError::TwoCells);
    }
    let settings: Vec<Setting> = config
        .effect
        .iter()
        .map(|effect| effect.setting(config.worm.cells))
        .collect::<Result<_, _>>()?;
    let mut scene = Scene {
        observed: Vec::with_capacity(runs.len()),
        nominal: Vec::with_capacity(runs.len()),
    };
    for run in runs {
        let mut observed = Observed::new(*run, config)?;
        if let Some(first) = scene.observed.first() {
            same_order(first, &observed)?;
        }
        let worm = Worm::try_from(config)?.with_slope_rad(run.slope_deg.to_radians())?;
        let physics = Physics::of(nominal(&observed, worm, run.payload_kg)).with(&settings);
        if physics.clamped_worm().check_hold().is_err() {
            return Err(ExplainError::SlidesDown {
                recording: run.recording.source.display().to_string(),
                slope_deg: run.slope_deg,
            });
        }
        if observed.may_be_laid_down {
            judge_start(&mut observed, &physics, USUAL);
        }
        scene.observed.push(observed);
        scene.nominal.push(physics);
    }
    Ok(scene)
}

fn same_order(first: &Observed<'_>, other: &Observed<'_>) -> Result<(), ExplainError> {
    if first.step_order == other.step_order {
        return Ok(());
    }
    let from_one = |order: &[usize]| order.iter().map(|cell| cell + 1).collect();
    Err(ExplainError::StepOrder {
        recording: other.run.recording.source.display().to_string(),
        found: from_one(&other.step_order),
        first: first.run.recording.source.display().to_string(),
        expected: from_one(&first.step_order),
    })
}

/// Assumes that the worm was laid down at the start where its first cycle fits that better. Returns whether that is new.
fn judge_start(observed: &mut Observed<'_>, physics: &Physics, damping_ratio: f64) -> bool {
    let before = observed.laid_down;
    let first_cycle = |observed: &Observed<'_>| {
        let predicted = predict(observed, physics, damping_ratio, physics.is_periodic())?;
        let residual = Residual::new(observed, &predicted);
        let until = observed.phase.partition_point(|&phase| phase < observed.phase[0] + 1.0);
        let body: Vec<f64> = residual.body_m[..until]
            .iter()
            .copied()
            .filter(|at_m| at_m.is_finite())
            .collect();
        let mean = body.iter().sum::<f64>() / body.len() as f64;
        Some(body.iter().map(|at_m| (at_m - mean).powi(2)).sum::<f64>())
    };
    observed.assume_laid_down(true);
    let laid_down = first_cycle(observed);
    observed.assume_laid_down(false);
    let under_way = first_cycle(observed);
    let is_laid_down = match (laid_down, under_way) {
        (Some(laid_down), Some(under_way)) => laid_down < under_way,
        (Some(_), None) => true,
        _ => false,
    };
    observed.assume_laid_down(is_laid_down);
    is_laid_down != before
}

/// Alternates between measuring the noise and recalibrating the model; the discrepancy is as large as a fraction of the mean largest
/// deformation of the tips.
pub(super) fn recalibrate<'s, 'a>(
    scene: &'s mut Scene<'a>,
    base: &Hypothesis,
    fraction: f64,
) -> Result<(FitProblem<'s, 'a>, Discrepancy, Fit), ExplainError> {
    let mut at = base.neutral();
    for _ in 0..ROUNDS {
        at = problem_at(scene, base, &at)?.fit(base, at, None).at;
        if !judge_starts_anew(scene, base, &at) {
            break;
        }
    }
    scene.settle(base, &at);
    let scene: &'s Scene<'a> = scene;
    let mut problem = problem_at(scene, base, &at)?;
    let discrepancy = Discrepancy::new(&problem, fraction * mean_deformation_m(scene));
    problem.discrepancy = Some(discrepancy.clone());
    let mut fit = from_heavy_damping(&problem, problem.fit(base, at, None));
    problem.compute_jacobian(&mut fit);
    problem.repeating_excess = problem.repeating_excess(&fit);
    Ok((problem, discrepancy, fit))
}

/// The problem with the noise that a hypothesis leaves at some values.
fn problem_at<'s, 'a>(scene: &'s Scene<'a>, base: &Hypothesis, at: &[f64]) -> Result<FitProblem<'s, 'a>, ExplainError> {
    let bins: Vec<Bins> = scene.observed.iter().map(Bins::new).collect();
    let mut noise = Vec::with_capacity(scene.observed.len());
    for (run, observed) in scene.observed.iter().enumerate() {
        let predicted = scene.predict(run, base, at).ok_or_else(|| ExplainError::SlidesDown {
            recording: observed.run.recording.source.display().to_string(),
            slope_deg: observed.run.slope_deg,
        })?;
        let residual = Residual::binned(observed, &bins[run], &predicted);
        noise.push(RunNoise::measure(observed, &bins[run], &residual));
    }
    Ok(FitProblem {
        scene,
        bins,
        noise,
        discrepancy: None,
        repeating_excess: 0.0,
    })
}

/// Judges by the recalibrated model whether the worms were laid down at the start: the nominal one is too far from some. Returns
/// whether any judgement is new.
fn judge_starts_anew(scene: &mut Scene<'_>, base: &Hypothesis, at: &[f64]) -> bool {
    let mut is_new = false;
    for run in 0..scene.observed.len() {
        let (physics, damping_ratio) = scene.physics(run, base, at);
        let observed = &mut scene.observed[run];
        if observed.may_be_laid_down {
            is_new |= judge_start(observed, &physics, damping_ratio);
        }
    }
    is_new
}

/// A fit, or that from a heavily damped body where it is the better one: with damping the data of a fast worm may have two minima.
fn from_heavy_damping(problem: &FitProblem<'_, '_>, fit: Fit) -> Fit {
    let mut at = fit.at.clone();
    for (free, value) in fit.hypothesis.free.iter().zip(&mut at) {
        match free.what {
            What::Nuisance(Nuisance::Damping) => *value = HEAVY.ln(),
            What::Nuisance(Nuisance::Presliding) => *value = free.quantity.min,
            _ => {}
        }
    }
    let other = problem.fit(&fit.hypothesis, at, None);
    if other.chi_squared < fit.chi_squared {
        other
    } else {
        fit
    }
}

/// Mean of the largest deformations of the tips, m: friction over stiffness.
fn mean_deformation_m(scene: &Scene<'_>) -> f64 {
    let worms = scene.nominal.iter().map(|physics| &physics.worm);
    let all_m: Vec<f64> = worms
        .flat_map(|worm| worm.contacts())
        .map(|contact| 0.5 * (contact.forward_bound_m + contact.backward_bound_m))
        .collect();
    all_m.iter().sum::<f64>() / all_m.len() as f64
}
