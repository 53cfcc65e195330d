//! The result of an analysis. Its names in JSON are a contract.

use super::TorqueProfile;
use crate::recording::Repair;
use serde::Serialize;

/// Where the gait phase comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PhaseSource {
    /// From the recording's own phase.
    Recorded,
    /// Found from the positions.
    Positions,
}

/// The result for one recording. Lists over cells begin with cell 1.
#[derive(Debug, Clone, Serialize)]
pub struct Analysis {
    /// The recording, as it was named.
    pub recording: String,
    /// Slope of the canal, degrees.
    pub slope_deg: f64,
    /// Number of cells.
    pub cells: usize,
    /// Number of samples.
    pub samples: usize,
    /// Time from the first to the last sample, s.
    pub duration_s: f64,
    /// Mean time of a gait cycle, s; rests before the first are not in it.
    pub cycle_s: f64,
    /// The cells in the order in which they step, counted from 1.
    pub step_order: Vec<usize>,
    /// Where the gait phase comes from.
    pub phase_source: PhaseSource,
    /// Stroke seen in the positions, m.
    pub stroke_m: f64,
    /// Standard deviation of one measured position, m, found from the positions.
    pub noise_m: f64,
    /// Largest tip deformations by inspection (section 3.2.1), m, and the search around them (3.2.3).
    pub first_estimate: FirstEstimate,
    /// The exhaustive search around the first estimate (section 3.2.3); none for more cells than it can try.
    pub paper_search: Option<PaperSearch>,
    /// Largest tip deformations by the continuous estimator, m.
    pub max_deformation_m: Vec<f64>,
    /// Their standard errors, m.
    pub max_deformation_sigma_m: Vec<f64>,
    /// Whether the tips were laid down unloaded at the start of the recording, which makes the estimates more exact.
    pub laid_down: bool,
    /// Time mean of Σ δᵢ over whole cycles (8), m.
    pub mean_deformation_m: f64,
    /// Mass by (9), kg; none on the level, where nothing pulls.
    pub mass_estimate_kg: Option<f64>,
    /// Its standard error, kg.
    pub mass_sigma_kg: Option<f64>,
    /// Time mean of the total force kt Σ δᵢ + m g sin λ (5) with the configured mass, N: 0 where momentum is balanced.
    pub momentum_violation_n: f64,
    /// Damping ratio of the body on its contacts, from its oscillation when a tip begins to slide.
    pub damping_ratio: f64,
    /// Variance that theory leaves of the measured way, over what noise and drift explain: 1 where theory holds.
    pub misfit_ratio: f64,
    /// Every whole gait cycle.
    pub cycles: Vec<CycleResult>,
    /// Mean over the settled cycles.
    pub mean: CycleValues,
    /// Standard deviation over the settled cycles.
    pub std: CycleValues,
    /// What theory predicts.
    pub theory: Theory,
    /// Energy that rigid contacts would take over the measured mean advance, J.
    pub rigid_energy_j: f64,
    /// Limitations of these figures.
    pub warnings: Vec<String>,
    /// What was repaired in the recording, and what was noticed but left as it is.
    pub repairs: Vec<Repair>,
    /// Torque at the cam by the motor's current, where the recording is a log that has it; [`analyze`](super::analyze) leaves it open.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_profile: Option<TorqueProfile>,
    /// The series behind the figures, sample by sample.
    #[serde(skip)]
    pub series: Series,
}

/// Largest tip deformations by inspection, section 3.2.1.
#[derive(Debug, Clone, Serialize)]
pub struct FirstEstimate {
    /// Half the displacement of each cell in its step until the others stop moving back, m.
    pub max_deformation_m: Vec<f64>,
}

/// The exhaustive search of section 3.2.3.
#[derive(Debug, Clone, Serialize)]
pub struct PaperSearch {
    /// The best candidate, m.
    pub max_deformation_m: Vec<f64>,
    /// How many were tried.
    pub candidates: usize,
    /// Violation of the momentum balance (7) by the best: time mean of the total force, N.
    pub mean_force_n: f64,
    /// Standard deviation of its total contact force over the cycles, N.
    pub force_std_n: f64,
}

/// One whole gait cycle.
#[derive(Debug, Clone, Serialize)]
pub struct CycleResult {
    /// Number of the cycle in the recording, from 0.
    pub index: usize,
    /// When it began, s of the recording's time.
    pub start_s: f64,
    /// How long it took, s.
    pub duration_s: f64,
    /// Whether every tip's contact point was known from its start; only such cycles enter mean and standard deviation.
    pub settled: bool,
    /// Its figures.
    #[serde(flatten)]
    pub values: CycleValues,
}

/// The figures of a cycle.
#[derive(Debug, Clone, Default, Serialize)]
pub struct CycleValues {
    /// Net displacement, m: mean over the cells.
    pub advance_m: f64,
    /// Distance that each tip slid forward, m.
    pub forward_slide_m: Vec<f64>,
    /// Distance that each tip slid backward, m, counted positive.
    pub backward_slide_m: Vec<f64>,
    /// Energy by losses and weight (11), J.
    pub energy_loss_j: f64,
    /// Net actuator work (13), J.
    pub energy_actuator_net_j: f64,
    /// Positive part of the actuator work, J.
    pub energy_actuator_positive_j: f64,
}

impl CycleValues {
    /// Mean and standard deviation (of single cycles, with one degree of freedom taken) of each figure; `NaN` where there are
    /// too few cycles.
    pub(super) fn mean_and_std(cycles: &[&Self], cells: usize) -> (Self, Self) {
        let count = cycles.len() as f64;
        let both = |of: &dyn Fn(&Self) -> f64| {
            let mean = cycles.iter().map(|cycle| of(cycle)).sum::<f64>() / count;
            let squares: f64 = cycles.iter().map(|cycle| (of(cycle) - mean).powi(2)).sum();
            (mean, (squares / (count - 1.0)).sqrt())
        };
        let each = |of: &dyn Fn(&Self, usize) -> f64| -> (Vec<f64>, Vec<f64>) {
            (0..cells).map(|cell| both(&|cycle| of(cycle, cell))).unzip()
        };
        let advance = both(&|cycle| cycle.advance_m);
        let forward = each(&|cycle, cell| cycle.forward_slide_m[cell]);
        let backward = each(&|cycle, cell| cycle.backward_slide_m[cell]);
        let loss = both(&|cycle| cycle.energy_loss_j);
        let net = both(&|cycle| cycle.energy_actuator_net_j);
        let positive = both(&|cycle| cycle.energy_actuator_positive_j);
        let figures = |advance_m, forward_slide_m, backward_slide_m, loss, net, positive| Self {
            advance_m,
            forward_slide_m,
            backward_slide_m,
            energy_loss_j: loss,
            energy_actuator_net_j: net,
            energy_actuator_positive_j: positive,
        };
        (
            figures(advance.0, forward.0, backward.0, loss.0, net.0, positive.0),
            figures(advance.1, forward.1, backward.1, loss.1, net.1, positive.1),
        )
    }
}

/// What theory predicts for a steady cycle.
#[derive(Debug, Clone, Serialize)]
pub struct Theory {
    /// The worm with the deformations and stroke found here; none where it slides down.
    pub identified: Option<TheoryCycle>,
    /// The configured worm; none where it slides down.
    pub nominal: Option<TheoryCycle>,
}

/// A steady cycle in theory.
#[derive(Debug, Clone, Serialize)]
pub struct TheoryCycle {
    /// Its figures.
    #[serde(flatten)]
    pub values: CycleValues,
    /// Largest tip deformations that it is based on, m.
    pub max_deformation_m: Vec<f64>,
    /// Energy that the same worm on rigid contacts would take over the same advance, J.
    pub rigid_energy_j: f64,
}

/// The series behind the figures: `[sample]`, or `[cell][sample]`. All have one entry for each sample in use.
#[derive(Debug, Clone, Default)]
pub struct Series {
    /// Time, s.
    pub time_s: Vec<f64>,
    /// Gait phase, cycles, unwrapped; the first cell in the step order starts at each whole number.
    pub phase: Vec<f64>,
    /// The cell that steps, counted from 0.
    pub stepping_cell: Vec<usize>,
    /// Measured positions, m; `NaN` where not seen.
    pub measured_m: Vec<Vec<f64>>,
    /// Positions without noise, m.
    pub position_m: Vec<Vec<f64>>,
    /// Where each tip touches the canal (1 to 3), m.
    pub contact_m: Vec<Vec<f64>>,
    /// Tip deformation (4), m.
    pub deformation_m: Vec<Vec<f64>>,
    /// +1 where the tip slides forward, −1 backward, 0 where it sticks.
    pub sliding: Vec<Vec<i8>>,
    /// Force on the body by all contacts and the weight, kt Σ δᵢ + m g sin λ, N.
    pub total_force_n: Vec<f64>,
    /// Extension of the stepping cell in its step (10), m.
    pub extension_m: Vec<f64>,
    /// Force of its actuator (13), N.
    pub actuator_force_n: Vec<f64>,
    /// Energy by (11) since the series began, J.
    pub energy_loss_j: Vec<f64>,
    /// Net actuator work (13) since the series began, J.
    pub energy_actuator_net_j: Vec<f64>,
    /// Positions that theory gives the identified worm from the same start, m.
    pub theory_m: Vec<Vec<f64>>,
}
