//! The runs of the campaign, and what their recordings show.

use serde::Serialize;

/// A run of the campaign.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunSummary {
    /// Where it comes from.
    pub recording: String,
    /// Slope, degrees.
    pub slope_deg: f64,
    /// Known extra mass, kg.
    pub payload_kg: f64,
    /// Whole gait cycles.
    pub cycles: usize,
    /// Time of a gait cycle, s.
    pub cycle_s: f64,
    /// Whether the gait phase was recorded.
    pub phase_recorded: bool,
    /// Whether positions count; where they do not, the motor's current alone is evidence.
    pub sees_positions: bool,
    /// Whether the recording starts with the worm just laid down.
    pub laid_down: bool,
    /// Standard deviation of one position, m.
    pub noise_m: f64,
    /// Standard deviation of the random walk that the body makes in a cycle beyond any model, m.
    pub drift_per_cycle_m: f64,
    /// Mean advance per cycle: measured, by the recalibrated model, by the named one (where there is one), m.
    pub advance_m: [f64; 3],
    /// Standard error of the measured advance, m, where the run is known by its advance alone; figures that need positions are
    /// then `NaN`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub advance_sigma_m: Option<f64>,
    /// What the motor's current shows, where it counts as evidence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub current: Option<CurrentEvidence>,
}

/// What the motor's current shows of a run, beside what models have it show; `NaN` where a model cannot make the run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CurrentEvidence {
    /// Root mean square of the mean cycle's torque on the cam that stays unexplained: by the recalibrated model, by the named one (where
    /// there is one), N m. The ripple of gears that nobody described is part of both.
    pub torque_residual_n_m: [f64; 2],
    /// Net work that the cam takes in a cycle: by the current and the gears of the answer, by the recalibrated model, by the named one, J.
    pub work_j: [f64; 3],
}
