//! What the page draws, beyond the JSON.

/// Series and maps that the page draws, beyond the JSON.
#[derive(Debug, Clone, Default)]
pub struct Figures {
    /// One map for each run: residual of the recalibrated model.
    pub maps_before: Vec<ResidualMap>,
    /// The same for the named model, where there is one.
    pub maps_after: Vec<ResidualMap>,
    /// Each run's displacement of the body within a cycle.
    pub cycles: Vec<CycleSeries>,
    /// Each run's mean torque on the cam, where the motor's current counts.
    pub torque: Vec<TorqueSeries>,
    /// The old model's text and the new one's difference to it, as lines with ' ', '-' or '+' before them.
    pub model_diff: Vec<String>,
}

/// Residual by cell and phase of one run.
#[derive(Debug, Clone, Default)]
pub struct ResidualMap {
    /// Slope, degrees.
    pub slope_deg: f64,
    /// The cell, from 1, that steps in each bin.
    pub stepping_cell: Vec<usize>,
    /// Phase at the middle of each bin.
    pub phase: Vec<f64>,
    /// Displacement within the bin beyond the model's, mean over the cycles, m: `[cell][bin]`.
    pub residual_m: Vec<Vec<f64>>,
    /// That in standard errors: `[cell][bin]`; `NaN` where too few cycles were seen.
    pub significance: Vec<Vec<f64>>,
    /// The significance that the largest on all maps of the campaign stays below by chance nineteen times in twenty.
    pub limit: f64,
}

/// The mean cycle of one run: data and models, all over the same phases.
#[derive(Debug, Clone, Default)]
pub struct CycleSeries {
    /// Slope, degrees.
    pub slope_deg: f64,
    /// Phase, 0 to 1.
    pub phase: Vec<f64>,
    /// Mean position of the cells since the start of the cycle less what the stroke alone would make, m: measured, mean over
    /// the settled cycles.
    pub measured_m: Vec<f64>,
    /// Standard deviation over the cycles, m.
    pub scatter_m: Vec<f64>,
    /// By the nominal model, m.
    pub baseline_m: Vec<f64>,
    /// By the recalibrated model, m.
    pub recalibrated_m: Vec<f64>,
    /// By the named model, m; empty where there is none.
    pub named_m: Vec<f64>,
}

/// The mean torque on the cam over the phase in one run, all over the same phases.
#[derive(Debug, Clone, Default)]
pub struct TorqueSeries {
    /// Slope, degrees.
    pub slope_deg: f64,
    /// Phase, 0 to 1; those beside the jump from one step to the next are left out.
    pub phase: Vec<f64>,
    /// By the current and the gears as they are believed to be, N m.
    pub measured_n_m: Vec<f64>,
    /// As the recalibrated model has the current show it, its recalibrated gears included, N m.
    pub recalibrated_n_m: Vec<f64>,
    /// Likewise by the named model; empty where there is none.
    pub named_n_m: Vec<f64>,
}
