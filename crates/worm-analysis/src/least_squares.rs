//! Nonlinear least squares within limits: Levenberg and Marquardt's method on residuals and priors together.
//!
//! [`minimise`] fits recordings and tables of advances; sums, normal matrix and standard errors serve the other fits of the crate, too.
//! A step solves the damped normal equations; quantities that it would take beyond a limit are put on the limit and held there, and the
//! others are solved for again. How the derivatives are kept up to date is up to the fit ([`Derivatives`]): computed at every step where
//! an evaluation is cheap, else by Broyden's rank-one updates.
//!
//! Everything is deterministic: sums run in a fixed order, and residuals and derivatives do not depend on the number of threads that
//! compute them.

use nalgebra::{DMatrix, DVector};

/// Damping at first, and its factors after a step that failed and one that succeeded.
const DAMPING: f64 = 1e-3;
const MORE_DAMPING: f64 = 6.0;
const LESS_DAMPING: f64 = 0.25;
const MIN_DAMPING: f64 = 1e-9;
/// Damping beyond which no step leads downhill.
const MAX_DAMPING: f64 = 1e6;
/// Damping from which it is better to compute new derivatives than to go on with updated ones.
const DISTRUST: f64 = 1.0;
/// Rows of all columns of derivatives that fit the processor's cache together.
const ROWS_AT_ONCE: usize = 512;

/// A quantity that is free within limits, with a normal prior.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Quantity {
    /// Mean of the prior.
    pub centre: f64,
    /// Standard deviation of the prior; infinite for none.
    pub sigma: f64,
    pub min: f64,
    pub max: f64,
    /// The scale on which the residuals change: step of numerical derivatives.
    pub step: f64,
}

impl Quantity {
    /// A quantity without prior and limits.
    pub fn unlimited(step: f64) -> Self {
        Self {
            centre: 0.0,
            sigma: f64::INFINITY,
            min: f64::NEG_INFINITY,
            max: f64::INFINITY,
            step,
        }
    }

    /// How far a value is from the prior's mean, in standard deviations.
    pub fn prior_residual(&self, value: f64) -> f64 {
        (value - self.centre) / self.sigma
    }

    /// Step of a one-sided difference that stays within the limits.
    pub fn inward_step(&self, value: f64) -> f64 {
        if value + self.step <= self.max {
            self.step
        } else {
            -self.step
        }
    }

    /// Whether a value lies on a limit.
    pub fn is_at_limit(&self, value: f64) -> bool {
        let tolerance = 1e-9 * (self.max - self.min);
        value <= self.min + tolerance || value >= self.max - tolerance
    }
}

/// Residuals as a function of some quantities.
pub(crate) trait LeastSquares {
    /// The quantities.
    fn quantities(&self) -> &[Quantity];
    /// The residuals, priors apart, at some values.
    fn residuals(&self, at: &[f64]) -> Vec<f64>;
    /// How the residuals change with each of some quantities: a column for each. `residual` is what they are at these values.
    fn derivatives(&self, at: &[f64], residual: &[f64], quantities: &[usize]) -> Vec<Vec<f64>>;
}

/// How a fit keeps its derivatives up to date.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Derivatives {
    /// Computed at every step.
    EveryStep,
    /// Updated by Broyden's rule, and computed when those no longer lead downhill.
    Updated,
    /// Updated by Broyden's rule, and never computed again: the fit ends where they no longer lead downhill, and does not count as
    /// converged.
    UpdatedOnly,
}

/// When a fit ends, and how it finds its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Method {
    pub derivatives: Derivatives,
    /// Steps after which a fit that still improves has not converged.
    pub max_steps: usize,
    /// Fall of chi-squared in a step below which the fit has converged: absolute, and as a fraction of chi-squared.
    pub converged: (f64, f64),
}

/// Values of all quantities, and what they leave.
#[derive(Debug, Clone)]
pub(crate) struct Estimate {
    pub at: Vec<f64>,
    pub residual: Vec<f64>,
    /// Derivatives of the residuals, a column for each quantity. After a fit these are those it used last.
    pub jacobian: Vec<Vec<f64>>,
    /// Square sum of the residuals and of what the priors add.
    pub chi_squared: f64,
    pub converged: bool,
}

/// Some values, without derivatives.
pub(crate) fn evaluate(problem: &impl LeastSquares, at: Vec<f64>) -> Estimate {
    let residual = problem.residuals(&at);
    Estimate {
        chi_squared: dot(&residual, &residual, None) + prior_chi_squared(problem.quantities(), &at),
        at,
        residual,
        jacobian: Vec::new(),
        converged: false,
    }
}

/// Fits all quantities from some values. `known` holds derivatives near these values of the first quantities, where there are any;
/// those that are missing are computed.
pub(crate) fn minimise(
    problem: &impl LeastSquares,
    at: Vec<f64>,
    known: Option<Vec<Vec<f64>>>,
    method: &Method,
) -> Estimate {
    let quantities = problem.quantities();
    let mut here = evaluate(problem, at);
    let all: Vec<usize> = (0..quantities.len()).collect();
    let mut is_fresh = known.is_none();
    here.jacobian = known.unwrap_or_default();
    here.jacobian.truncate(all.len());
    let missing = problem.derivatives(&here.at, &here.residual, &all[here.jacobian.len()..]);
    here.jacobian.extend(missing);
    let mut damping = DAMPING;
    for _ in 0..method.max_steps {
        let next = downhill(problem, &here, &mut damping, is_fresh);
        let gained = next.as_ref().map_or(0.0, |next| here.chi_squared - next.chi_squared);
        if let Some(mut next) = next {
            next.jacobian = std::mem::take(&mut here.jacobian);
            if method.derivatives != Derivatives::EveryStep {
                broyden(&mut next, &here, quantities);
            }
            here = next;
        }
        let has_converged = gained < method.converged.0 + method.converged.1 * here.chi_squared;
        match (has_converged, method.derivatives) {
            (true, Derivatives::UpdatedOnly) => break,
            (true, _) if is_fresh => {
                here.converged = true;
                break;
            }
            (false, Derivatives::Updated | Derivatives::UpdatedOnly) => is_fresh = false,
            (false, Derivatives::EveryStep) => {
                here.jacobian = problem.derivatives(&here.at, &here.residual, &all);
            }
            (true, _) => {
                here.jacobian = problem.derivatives(&here.at, &here.residual, &all);
                is_fresh = true;
                damping = DAMPING;
            }
        }
    }
    here
}

/// The next values, after as much damping as it takes; none where no step leads downhill.
fn downhill(problem: &impl LeastSquares, here: &Estimate, damping: &mut f64, is_fresh: bool) -> Option<Estimate> {
    let quantities = problem.quantities();
    let normal = normal_matrix(quantities, &here.jacobian, None);
    let gradient = gradient(quantities, &here.at, &here.residual, &here.jacobian, None);
    while *damping < MAX_DAMPING {
        let probe = damped_step(quantities, &here.at, &normal, &gradient, *damping);
        if probe == here.at {
            return None;
        }
        let trial = evaluate(problem, probe);
        if trial.chi_squared < here.chi_squared {
            *damping = (*damping * LESS_DAMPING).max(MIN_DAMPING);
            return Some(trial);
        }
        *damping *= MORE_DAMPING;
        if !is_fresh && *damping > DISTRUST {
            return None;
        }
    }
    None
}

/// Products of all columns of one matrix with all of another: many times as fast as `tr_mul`, which takes them one by one.
pub(crate) fn cross(one: &DMatrix<f64>, other: &DMatrix<f64>) -> DMatrix<f64> {
    one.transpose() * other
}

/// What priors add to chi-squared.
pub(crate) fn prior_chi_squared(quantities: &[Quantity], at: &[f64]) -> f64 {
    let with_value = quantities.iter().zip(at);
    with_value
        .map(|(quantity, &value)| quantity.prior_residual(value).powi(2))
        .sum()
}

/// Normal matrix of residuals and priors over the rows that count; all of them for none.
pub(crate) fn normal_matrix(quantities: &[Quantity], jacobian: &[Vec<f64>], counts: Option<&[bool]>) -> DMatrix<f64> {
    let count = quantities.len();
    let mut normal = DMatrix::zeros(count, count);
    let rows = jacobian.first().map_or(0, Vec::len);
    for from in (0..rows).step_by(ROWS_AT_ONCE) {
        let part = from..rows.min(from + ROWS_AT_ONCE);
        let counts = counts.map(|counts| &counts[part.clone()]);
        for row in 0..count {
            for column in 0..=row {
                normal[(row, column)] += dot(&jacobian[row][part.clone()], &jacobian[column][part.clone()], counts);
            }
        }
    }
    for row in 0..count {
        for column in 0..row {
            normal[(column, row)] = normal[(row, column)];
        }
        normal[(row, row)] += quantities[row].sigma.powi(-2);
    }
    normal
}

/// Gradient of half of chi-squared over the rows that count; all of them for none.
pub(crate) fn gradient(
    quantities: &[Quantity],
    at: &[f64],
    residual: &[f64],
    jacobian: &[Vec<f64>],
    counts: Option<&[bool]>,
) -> DVector<f64> {
    let of = |number: usize| {
        let quantity = &quantities[number];
        dot(&jacobian[number], residual, counts) + (at[number] - quantity.centre) * quantity.sigma.powi(-2)
    };
    DVector::from_iterator(quantities.len(), (0..quantities.len()).map(of))
}

/// Standard errors of all quantities by their normal matrix; infinite where nothing is known.
pub(crate) fn standard_errors(mut normal: DMatrix<f64>) -> Vec<f64> {
    let count = normal.nrows();
    for quantity in 0..count {
        normal[(quantity, quantity)] += 1e-12 * (1.0 + normal[(quantity, quantity)]);
    }
    match normal.cholesky() {
        Some(factor) => {
            let inverse = factor.inverse();
            (0..count)
                .map(|quantity| inverse[(quantity, quantity)].max(0.0).sqrt())
                .collect()
        }
        None => vec![f64::INFINITY; count],
    }
}

/// The values after one damped Gauss-Newton step, within the limits; the same values where the normal matrix is singular.
pub(crate) fn damped_step(
    quantities: &[Quantity],
    from: &[f64],
    normal: &DMatrix<f64>,
    gradient: &DVector<f64>,
    damping: f64,
) -> Vec<f64> {
    let count = from.len();
    let mut is_held = vec![false; count];
    let mut at = from.to_vec();
    // Quantities that would leave their limits are put on them and held, and the step is computed again without them.
    for _ in 0..=count {
        let open: Vec<usize> = (0..count).filter(|&quantity| !is_held[quantity]).collect();
        if open.is_empty() {
            break;
        }
        let mut matrix = submatrix(normal, &open);
        let mut right = DVector::from_fn(open.len(), |row, _| {
            let shifted: f64 = (0..count)
                .filter(|&other| is_held[other])
                .map(|other| normal[(open[row], other)] * (at[other] - from[other]))
                .sum();
            -gradient[open[row]] - shifted
        });
        for row in 0..open.len() {
            matrix[(row, row)] += damping * matrix[(row, row)] + 1e-12;
        }
        let Some(factor) = matrix.cholesky() else {
            return from.to_vec();
        };
        factor.solve_mut(&mut right);
        let mut any_left = false;
        for (row, &number) in open.iter().enumerate() {
            let quantity = &quantities[number];
            let to = from[number] + right[row];
            if to < quantity.min || to > quantity.max {
                at[number] = to.clamp(quantity.min, quantity.max);
                is_held[number] = true;
                any_left = true;
            } else {
                at[number] = to;
            }
        }
        if !any_left {
            break;
        }
    }
    at
}

/// The rows and columns of some quantities.
pub(crate) fn submatrix(matrix: &DMatrix<f64>, quantities: &[usize]) -> DMatrix<f64> {
    let count = quantities.len();
    DMatrix::from_fn(count, count, |row, column| {
        matrix[(quantities[row], quantities[column])]
    })
}

/// Corrects the derivatives by the step that was just made (Broyden's rank-one update, each quantity on its own scale).
fn broyden(next: &mut Estimate, before: &Estimate, quantities: &[Quantity]) {
    let shift: Vec<f64> = next
        .at
        .iter()
        .zip(&before.at)
        .map(|(after, before)| after - before)
        .collect();
    let length: f64 = shift
        .iter()
        .zip(quantities)
        .map(|(shift, quantity)| (shift / quantity.step).powi(2))
        .sum();
    if length == 0.0 {
        return;
    }
    let pairs = next.residual.iter().zip(&before.residual);
    let mut missed: Vec<f64> = pairs.map(|(after, before)| after - before).collect();
    for (column, shift) in next.jacobian.iter().zip(&shift) {
        if *shift != 0.0 {
            for (missed, slope) in missed.iter_mut().zip(column) {
                *missed -= slope * shift;
            }
        }
    }
    for ((column, shift), quantity) in next.jacobian.iter_mut().zip(&shift).zip(quantities) {
        let fraction = shift / (quantity.step * quantity.step) / length;
        if fraction != 0.0 {
            for (slope, missed) in column.iter_mut().zip(&missed) {
                *slope += fraction * missed;
            }
        }
    }
}

/// Scalar product over the rows that count; all of them for none.
pub(crate) fn dot(a: &[f64], b: &[f64], counts: Option<&[bool]>) -> f64 {
    match counts {
        None => {
            // Eight sums side by side: the order is fixed, and the processor computes them at once.
            let mut sums = [0.0; 8];
            let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
            let remainder: f64 = a8.remainder().iter().zip(b8.remainder()).map(|(a, b)| a * b).sum();
            for (a, b) in a8.zip(b8) {
                for lane in 0..8 {
                    sums[lane] += a[lane] * b[lane];
                }
            }
            sums.iter().sum::<f64>() + remainder
        }
        Some(counts) => a
            .iter()
            .zip(b)
            .zip(counts)
            .filter(|(_, counts)| **counts)
            .map(|((a, b), _)| a * b)
            .sum(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A decay a e^(−b t), seen without noise at t = 0, 0.5, 1, ….
    struct Decay {
        quantities: [Quantity; 2],
        seen: Vec<f64>,
    }

    const TIMES: usize = 12;

    impl Decay {
        fn new(amplitude: f64, rate: f64) -> Self {
            let quantity = Quantity::unlimited(1e-4);
            let mut decay = Self {
                quantities: [quantity; 2],
                seen: vec![0.0; TIMES],
            };
            decay.seen = decay.residuals(&[amplitude, rate]);
            decay
        }
    }

    impl LeastSquares for Decay {
        fn quantities(&self) -> &[Quantity] {
            &self.quantities
        }

        fn residuals(&self, at: &[f64]) -> Vec<f64> {
            let value = |time: usize| at[0] * (-at[1] * 0.5 * time as f64).exp();
            (0..TIMES).map(|time| value(time) - self.seen[time]).collect()
        }

        fn derivatives(&self, at: &[f64], residual: &[f64], quantities: &[usize]) -> Vec<Vec<f64>> {
            let column = |&quantity: &usize| {
                let step = self.quantities[quantity].inward_step(at[quantity]);
                let mut probe = at.to_vec();
                probe[quantity] += step;
                let beside = self.residuals(&probe);
                beside
                    .iter()
                    .zip(residual)
                    .map(|(beside, here)| (beside - here) / step)
                    .collect()
            };
            quantities.iter().map(column).collect()
        }
    }

    const METHOD: Method = Method {
        derivatives: Derivatives::EveryStep,
        max_steps: 40,
        converged: (1e-14, 0.0),
    };

    #[test]
    fn it_finds_the_values_that_made_the_data() {
        let decay = Decay::new(2.0, 0.7);
        for derivatives in [Derivatives::EveryStep, Derivatives::Updated] {
            let method = Method { derivatives, ..METHOD };
            let found = minimise(&decay, vec![1.0, 0.1], None, &method);
            assert!(found.converged, "{derivatives:?}: {found:?}");
            assert!(
                (found.at[0] - 2.0).abs() < 1e-5 && (found.at[1] - 0.7).abs() < 1e-5,
                "{derivatives:?}: {found:?}"
            );
        }
        let known = vec![vec![1.0; TIMES]];
        let method = Method {
            derivatives: Derivatives::UpdatedOnly,
            ..METHOD
        };
        let rough = minimise(&decay, vec![1.0, 0.1], Some(known), &method);
        assert!(!rough.converged);
        assert!(
            rough.chi_squared < 0.5 * evaluate(&decay, vec![1.0, 0.1]).chi_squared,
            "{rough:?}"
        );
    }

    #[test]
    fn what_would_leave_its_limits_stays_on_them_and_the_others_make_the_best_of_it() {
        let mut decay = Decay::new(2.0, 0.7);
        decay.quantities[1].max = 0.5;
        let found = minimise(&decay, vec![1.0, 0.1], None, &METHOD);
        assert!(
            found.converged && decay.quantities[1].is_at_limit(found.at[1]),
            "{found:?}"
        );
        assert!(!decay.quantities[0].is_at_limit(found.at[0]));
        // Linear least squares for the amplitude alone.
        let decays: Vec<f64> = (0..TIMES).map(|time| (-0.25 * time as f64).exp()).collect();
        let amplitude =
            -dot(&decays, &decay.seen.iter().map(|seen| -seen).collect::<Vec<_>>(), None) / dot(&decays, &decays, None);
        assert!((found.at[0] - amplitude).abs() < 1e-5, "{found:?} for {amplitude}");
    }

    #[test]
    fn priors_pull_and_make_standard_errors_smaller() {
        let mut decay = Decay::new(2.0, 0.7);
        let free = minimise(&decay, vec![1.0, 0.1], None, &METHOD);
        let sigmas = standard_errors(normal_matrix(&decay.quantities, &free.jacobian, None));
        decay.quantities[0].centre = 1.5;
        decay.quantities[0].sigma = sigmas[0];
        let drawn = minimise(&decay, vec![1.0, 0.1], None, &METHOD);
        let with_prior = standard_errors(normal_matrix(&decay.quantities, &drawn.jacobian, None));
        assert!((1.6..1.9).contains(&drawn.at[0]), "{drawn:?}");
        assert!(with_prior[0] < 0.8 * sigmas[0], "{with_prior:?} and {sigmas:?}");
        assert!(drawn.chi_squared > prior_chi_squared(&decay.quantities, &drawn.at));
    }
}
