//! The torque at the cam over the phase of a gait cycle, as the motor's current says it, beside the model's.

use serde::Serialize;
use worm_estimator::self_sensing::SelfSensing;

/// Torque over the phase. Lists are over bins of equal width, the first begins at the start of the cycle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TorqueProfile {
    /// Middle of each bin, as a fraction of the cycle.
    pub phase: Vec<f64>,
    /// Mean torque that the cam took in it, after the gears' friction and the inertia, N m.
    pub measured_n_m: Vec<f64>,
    /// The same by the exact model of the worm that explains it best, N m.
    pub model_n_m: Vec<f64>,
    /// Root mean square of the difference, N m.
    pub residual_n_m: f64,
    /// Cycles that the mean is over; older ones count less.
    pub cycles: f64,
}

impl TorqueProfile {
    /// What self-sensing has found; none before its first cycle.
    pub fn of(sensing: &SelfSensing) -> Option<Self> {
        let sensed = sensing.sensed()?;
        let (measured_n_m, model_n_m) = sensing.profiles_n_m();
        let bins = measured_n_m.len() as f64;
        let squares: f64 = measured_n_m
            .iter()
            .zip(model_n_m)
            .map(|(measured, model)| (measured - model).powi(2))
            .sum();
        Some(Self {
            phase: (0..measured_n_m.len()).map(|bin| (bin as f64 + 0.5) / bins).collect(),
            measured_n_m: measured_n_m.to_vec(),
            model_n_m: model_n_m.to_vec(),
            residual_n_m: (squares / bins).sqrt(),
            cycles: sensed.cycles,
        })
    }
}
