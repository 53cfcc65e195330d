//! Prepares the runs of a campaign, and recalibrates the model on them.

use super::bins::Bins;
use super::discrepancy::Discrepancy;
use super::error::ExplainError;
use super::fit::{Fit, FitProblem};
use super::hypothesis::Hypothesis;
use super::noise::RunNoise;
use super::observed::Observed;
use super::predict::{Scene, nominal, predict};
use super::residual::Residual;
use crate::experiment::RecordedRun;
use worm_estimator::config::Config;
use worm_physics::effect::Setting;
use worm_physics::{Physics, Worm};

/// How often noise and recalibration are repeated, each with the result of the other.
const NOISE_ROUNDS: usize = 2;

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
            judge_start(&mut observed, &physics);
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

/// Assumes that the worm was laid down at the start where its first cycle fits that better.
fn judge_start(observed: &mut Observed<'_>, physics: &Physics) {
    let first_cycle = |observed: &Observed<'_>| {
        let predicted = predict(observed, physics, 0.4, physics.is_periodic())?;
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
}

/// Alternates between measuring the noise and recalibrating the model; the discrepancy is as large as a fraction of the mean largest
/// deformation of the tips.
pub(super) fn recalibrate<'s, 'a>(
    scene: &'s Scene<'a>,
    base: &Hypothesis,
    fraction: f64,
) -> Result<(FitProblem<'s, 'a>, Discrepancy, Fit), ExplainError> {
    let bins: Vec<Bins> = scene.observed.iter().map(Bins::new).collect();
    let mut at = base.neutral();
    let mut round = 0;
    loop {
        let mut noise = Vec::with_capacity(scene.observed.len());
        for (run, observed) in scene.observed.iter().enumerate() {
            let predicted = scene.predict(run, base, &at).ok_or_else(|| ExplainError::SlidesDown {
                recording: observed.run.recording.source.display().to_string(),
                slope_deg: observed.run.slope_deg,
            })?;
            let residual = Residual::binned(observed, &bins[run], &predicted);
            noise.push(RunNoise::measure(observed, &bins[run], &residual));
        }
        let mut problem = FitProblem {
            scene,
            bins: bins.clone(),
            noise,
            discrepancy: None,
            repeating_excess: 0.0,
        };
        round += 1;
        if round < NOISE_ROUNDS {
            at = problem.fit(base, at, None).at;
            continue;
        }
        let discrepancy = Discrepancy::new(&problem, fraction * mean_deformation_m(scene));
        problem.discrepancy = Some(discrepancy.clone());
        let mut fit = problem.fit(base, at, None);
        problem.compute_jacobian(&mut fit);
        problem.repeating_excess = problem.repeating_excess(&fit);
        return Ok((problem, discrepancy, fit));
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
