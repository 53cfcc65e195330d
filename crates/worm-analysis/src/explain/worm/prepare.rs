//! Prepares the runs of a campaign.

use super::super::error::ExplainError;
use super::observed::Observed;
use super::predict::{Scene, nominal, predict};
use super::residual::Residual;
use crate::experiment::RecordedRun;
use crate::explain::search::find::Evidence;
use worm_estimator::config::Config;
use worm_physics::effect::Setting;
use worm_physics::{Physics, Worm};

/// Damping ratio of a body before it is known.
const USUAL: f64 = 0.4;

/// Prepares the runs of a campaign.
pub(in crate::explain) fn prepare<'a>(
    runs: &[RecordedRun<'a>],
    config: &Config,
    evidence: Evidence,
) -> Result<Scene<'a>, ExplainError> {
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
    for (number, run) in runs.iter().enumerate() {
        if let Some(same) = runs[..number]
            .iter()
            .find(|before| run.recording.is_copy_of(before.recording))
        {
            return Err(ExplainError::Copy {
                recording: run.recording.source.display().to_string(),
                first: same.recording.source.display().to_string(),
            });
        }
        let mut observed = observe(*run, config, evidence)?;
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
    let counts_current = scene.observed.iter().any(|observed| observed.torque.is_some());
    if evidence != Evidence::Positions && !counts_current {
        return Err(ExplainError::NoCurrent);
    }
    Ok(scene)
}

/// A run by what counts of it.
fn observe<'a>(run: RecordedRun<'a>, config: &Config, evidence: Evidence) -> Result<Observed<'a>, ExplainError> {
    let gear = config.self_sensing().gear;
    let has_positions = run.recording.has_positions();
    match evidence {
        Evidence::Positions if !has_positions => Err(ExplainError::NoPositions {
            recording: run.recording.source.display().to_string(),
        }),
        Evidence::Positions => Observed::new(run, config),
        Evidence::PositionsAndCurrent if has_positions => {
            let mut observed = Observed::new(run, config)?;
            observed.count_current(&gear);
            Ok(observed)
        }
        Evidence::PositionsAndCurrent | Evidence::CurrentAlone => Observed::by_current(run, config, &gear),
    }
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
pub(super) fn judge_start(observed: &mut Observed<'_>, physics: &Physics, damping_ratio: f64) -> bool {
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
