//! Recalibrates the model of a plant within the priors of its nuisances.

use super::discrepancy::Discrepancy;
use super::fit::Fit;
use super::hypothesis::Hypothesis;
use super::plant::Plant;
use super::problem::FitProblem;
use crate::explain::error::ExplainError;

/// Most recalibrations before the last one, which each give the noise of the next and judge what is assumed about the runs.
const ROUNDS: usize = 3;
/// Recalibrations that are made to the end, of those that came furthest in a few steps.
const TO_THE_END: usize = 3;

/// Measures the noise of a plant by its model as recalibrated with that noise. Returns the values of all nuisances.
///
/// # Errors
/// [`ExplainError`] where the plant could not have made a run.
pub(in crate::explain) fn measure_noise<P: Plant>(plant: &mut P, base: &Hypothesis) -> Result<Vec<f64>, ExplainError> {
    let mut at = base.neutral();
    for _ in 0..ROUNDS {
        plant.measure_noise(base, &at)?;
        at = FitProblem::with_noise_alone(&*plant).fit(base, at, None).at;
        if !plant.judge_assumptions(base, &at) {
            break;
        }
    }
    plant.settle(base, &at);
    plant.measure_noise(base, &at)?;
    Ok(at)
}

/// Recalibrates the model of a plant whose noise is known, from some values, beside a discrepancy as large as a fraction of its unit.
/// Returns the problem, the discrepancy, and the fit with derivatives.
pub(in crate::explain) fn recalibrate<'p, P: Plant>(
    plant: &'p P,
    base: &Hypothesis,
    from: Vec<f64>,
    fraction: f64,
) -> (FitProblem<'p, P>, Discrepancy, Fit) {
    let scale = fraction * plant.discrepancy_unit();
    let discrepancy = Discrepancy::new(plant.discrepancy_columns(scale), scale);
    let mut problem = FitProblem {
        discrepancy: Some(discrepancy.clone()),
        ..FitProblem::with_noise_alone(plant)
    };
    let fit = problem.fit(base, from, None);
    let other = problem.fit(base, plant.another_start(base, &fit.at), None);
    let mut rough: Vec<Fit> = plant
        .recalibration_starts(base)
        .into_iter()
        .map(|start| problem.fit_roughly(base, start, None))
        .collect();
    rough.sort_by(|a, b| a.chi_squared.total_cmp(&b.chi_squared));
    let promising = rough.into_iter().take(TO_THE_END);
    let mut fit = promising
        .map(|rough| problem.fit_from(base, rough.at, None))
        .chain([other])
        .fold(
            fit,
            |best, one| if one.chi_squared < best.chi_squared { one } else { best },
        );
    problem.compute_jacobian(&mut fit);
    problem.repeating_excess = problem.repeating_excess(&fit);
    (problem, discrepancy, fit)
}
