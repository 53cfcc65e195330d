//! How well a servo's model predicts recordings, without any fit.

use super::answer::Measures;
use super::explain::Bench;
use super::gap::{mean_absolute, root_mean_square};
use super::predict::predict;
use super::present_current::reported_a;
use crate::bench::ServoModel;
use serde::Serialize;

/// How well a run is predicted: from its first reading on, never reset.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ServoPredictionError {
    /// The recording.
    pub recording: String,
    /// Position P gain.
    pub position_p_gain: f64,
    /// Of the position, rad.
    pub mean_absolute_error_rad: f64,
    /// Of the position, rad.
    pub root_mean_square_error_rad: f64,
    /// Of the velocity as the servo reports it, which lags by 20 ms, rad/s.
    pub mean_absolute_error_rad_s: f64,
    /// Of the current, A, where the torque is on.
    pub mean_absolute_error_a: f64,
    /// Of the current, A.
    pub root_mean_square_error_a: f64,
    /// Electrical energy that the model predicts, J.
    pub electrical_j: f64,
}

/// By how much the reported velocity of an X-series servo lags, s.
const VELOCITY_LAG_S: f64 = 0.02;

/// Predicts every run of a bench by a model; the current is what the model says that it measures.
pub fn prediction_errors(bench: &Bench<'_>, model: &ServoModel) -> Vec<ServoPredictionError> {
    let physics = model.on(bench.pendulum, bench.supply_v, bench.duty_limit);
    let of_run = |observed: &super::observed::Observed<'_>| {
        let recording = observed.recording;
        let predicted = predict(observed, &physics);
        let off = |predicted: &[f64], measured: &[f64]| -> Vec<f64> {
            predicted
                .iter()
                .zip(measured)
                .map(|(predicted, measured)| predicted - measured)
                .collect()
        };
        let position = off(&predicted.angle_rad, &recording.position_rad);
        let lagged: Vec<f64> = (0..recording.readings())
            .map(|reading| {
                let seen_s = recording.time_s[reading] - VELOCITY_LAG_S;
                let at = recording.time_s.partition_point(|time_s| *time_s < seen_s);
                predicted.velocity_rad_s[at]
            })
            .collect();
        let velocity = off(&lagged, &recording.velocity_rad_s);
        let current: Vec<f64> = (0..recording.readings())
            .filter(|&reading| recording.torque_enabled[reading])
            .map(|reading| {
                let of_model = reported_a(model.current, predicted.duty[reading], predicted.current_a[reading]);
                of_model - recording.current_a[reading]
            })
            .collect();
        ServoPredictionError {
            recording: observed.name(),
            position_p_gain: observed.gain,
            mean_absolute_error_rad: mean_absolute(&position),
            root_mean_square_error_rad: root_mean_square(&position),
            mean_absolute_error_rad_s: mean_absolute(&velocity),
            mean_absolute_error_a: mean_absolute(&current),
            root_mean_square_error_a: root_mean_square(&current),
            electrical_j: predicted.energy.electrical_j,
        }
    };
    bench.observed().iter().map(of_run).collect()
}

impl Measures {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Winding => "winding",
            Self::Supply => "supply",
            Self::Duty => "duty",
        }
    }
}
