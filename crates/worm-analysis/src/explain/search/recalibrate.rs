//! Recalibrates the model of a plant within the priors of its nuisances.

use super::discrepancy::Discrepancy;
use super::fit::Fit;
use super::hypothesis::Hypothesis;
use super::plant::Plant;
use super::problem::FitProblem;
use crate::explain::error::ExplainError;

/// Most recalibrations before the last one, which each give the noise of the next and judge what is assumed about the runs.
const ROUNDS: usize = 3;

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
    let mut fit = if other.chi_squared < fit.chi_squared {
        other
    } else {
        fit
    };
    problem.compute_jacobian(&mut fit);
    problem.repeating_excess = problem.repeating_excess(&fit);
    (problem, discrepancy, fit)
}
