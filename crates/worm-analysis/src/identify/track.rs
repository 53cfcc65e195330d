//! Smooths a quantity that changes steadily: a Kalman filter with a random-walk velocity, run forward and backward (Rauch, Tung,
//! Striebel). The variance of the velocity's steps is the one that makes the readings most likely.

use nalgebra::{Matrix2, Vector2};

/// Process noise of the velocity that is tried: variance gathered in a second, units²/s³.
const WANDERS: [f64; 9] = [1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0];
/// Square of an innovation, in variances, from which a reading is rejected.
const STRANGE: f64 = 25.0;
/// Smallest standard deviation of the initial velocity, units/s; otherwise it is the mean velocity, so that a first reading far off does
/// not mislead the filter.
const FIRST_VELOCITY: f64 = 0.1;

/// A smoothed series.
#[derive(Debug, Clone)]
pub(super) struct Smoothed {
    /// One value for each time.
    pub value: Vec<f64>,
    /// Root mean square of the standard errors.
    pub sigma: f64,
}

/// Smooths readings with their variances; none where there is no reading.
pub(super) fn smooth(time_s: &[f64], readings: &[Option<(f64, f64)>]) -> Smoothed {
    let wander = WANDERS
        .into_iter()
        .map(|wander| (filter(time_s, readings, wander, &mut Vec::new()), wander))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map_or(WANDERS[0], |best| best.1);
    let mut passes = Vec::with_capacity(time_s.len());
    filter(time_s, readings, wander, &mut passes);
    let Some(last) = passes.last() else {
        return Smoothed {
            value: Vec::new(),
            sigma: 0.0,
        };
    };
    let (mut state, mut covariance) = (last.state, last.covariance);
    let mut value = vec![state[0]; passes.len()];
    let mut squares = covariance[(0, 0)];
    for at in (0..passes.len() - 1).rev() {
        let (here, next) = (&passes[at], &passes[at + 1]);
        if let Some(inverse) = next.predicted_covariance.try_inverse() {
            let gain = here.covariance * transition(time_s[at + 1] - time_s[at]).transpose() * inverse;
            state = here.state + gain * (state - next.predicted);
            covariance = here.covariance + gain * (covariance - next.predicted_covariance) * gain.transpose();
        } else {
            (state, covariance) = (here.state, here.covariance);
        }
        value[at] = state[0];
        squares += covariance[(0, 0)];
    }
    let sigma = (squares / passes.len() as f64).max(0.0).sqrt();
    Smoothed { value, sigma }
}

/// The series nearest to a series, in least squares, that never falls: what falls is replaced by its mean.
pub(super) fn never_falling(series: &[f64]) -> Vec<f64> {
    let mut level: Vec<(f64, usize)> = Vec::with_capacity(series.len()); // mean and how many
    for &value in series {
        let mut here = (value, 1);
        while let Some(&(mean, count)) = level.last()
            && mean > here.0
        {
            let both = count + here.1;
            here = (here.0 + (mean - here.0) * count as f64 / both as f64, both);
            level.pop();
        }
        level.push(here);
    }
    level
        .into_iter()
        .flat_map(|(mean, count)| std::iter::repeat_n(mean, count))
        .collect()
}

struct Pass {
    predicted: Vector2<f64>,
    predicted_covariance: Matrix2<f64>,
    state: Vector2<f64>,
    covariance: Matrix2<f64>,
}

fn transition(step_s: f64) -> Matrix2<f64> {
    Matrix2::new(1.0, step_s, 0.0, 1.0)
}

/// Velocity from the first reading to the last, units/s; 0 where there are not two.
fn mean_velocity(time_s: &[f64], readings: &[Option<(f64, f64)>]) -> f64 {
    let mut seen = time_s
        .iter()
        .zip(readings)
        .filter_map(|(&at_s, reading)| Some((at_s, reading.as_ref()?.0)));
    match (seen.next(), seen.next_back()) {
        (Some((begin_s, begin)), Some((end_s, end))) if end_s > begin_s => (end - begin) / (end_s - begin_s),
        _ => 0.0,
    }
}

/// Runs forward; the logarithm of the likelihood of the readings, but for a constant.
fn filter(time_s: &[f64], readings: &[Option<(f64, f64)>], wander: f64, passes: &mut Vec<Pass>) -> f64 {
    let first = readings.iter().flatten().next().copied().unwrap_or((0.0, 1.0));
    let mean_velocity = mean_velocity(time_s, readings);
    let velocity_sigma = mean_velocity.abs().max(FIRST_VELOCITY);
    let mut state = Vector2::new(first.0, mean_velocity);
    let mut covariance = Matrix2::new(first.1 + 1.0, 0.0, 0.0, velocity_sigma * velocity_sigma);
    let mut log_likelihood = 0.0;
    for (at, reading) in readings.iter().enumerate() {
        let step_s = if at == 0 { 0.0 } else { time_s[at] - time_s[at - 1] };
        let on = transition(step_s);
        let cross = wander * step_s * step_s / 2.0;
        let process = Matrix2::new(wander * step_s.powi(3) / 3.0, cross, cross, wander * step_s);
        let predicted = on * state;
        let predicted_covariance = on * covariance * on.transpose() + process;
        (state, covariance) = (predicted, predicted_covariance);
        if let Some((value, variance)) = reading {
            let spread = predicted_covariance[(0, 0)] + variance;
            let whitened = value - predicted[0];
            let strangeness = (whitened * whitened / spread).min(STRANGE);
            log_likelihood -= 0.5 * (strangeness + spread.ln());
            // A reading that cannot be is passed over; should it have been right, the next ones bring it back.
            if strangeness < STRANGE {
                let gain = predicted_covariance.column(0) / spread;
                state += gain * whitened;
                covariance -= gain * predicted_covariance.row(0);
            }
        }
        passes.push(Pass {
            predicted,
            predicted_covariance,
            state,
            covariance,
        });
    }
    log_likelihood
}

#[cfg(test)]
mod tests;
