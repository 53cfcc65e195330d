//! A run that was not made yet, under each rival: what each predicts, and how well data would separate the predictions.
//!
//! The distance between two rivals is the chi-squared of the data of the new run against the wrong one, which may adjust everything that
//! is free in it as far as the campaign allows (its own normal matrix is the prior), and the slope error of the new run.

use super::change::Change;
use crate::experiment::RecordedRun;
use crate::explain::search::bins::Bins;
use crate::explain::search::fit::Fit;
use crate::explain::search::parameter::What;
use crate::explain::worm::binning::bins;
use crate::explain::worm::noise::RunNoise;
use crate::explain::worm::nuisance::Nuisance;
use crate::explain::worm::observed::Observed;
use crate::explain::worm::pace::Pace;
use crate::explain::worm::predict::Scene;
use crate::explain::worm::predicted::Predicted;
use crate::explain::worm::recorded_worm::RecordedWorm;
use crate::explain::worm::residual::Residual;
use crate::least_squares::dot;
use crate::recording::Recording;
use nalgebra::{DMatrix, DVector};

/// Fastest sampling that is simulated, Hz, and most samples in a cycle: more add nothing.
const RATE_HZ: f64 = 120.0;
const SAMPLES_PER_CYCLE: f64 = 120.0;
/// Time at rest before the first step, s.
const REST_S: f64 = 0.3;
/// Cycles after which the advance counts.
const SETTLING_CYCLES: f64 = 2.0;
/// The slope error of the new run takes the place of the first run's.
const FRESH_SLOPE: Nuisance = Nuisance::SlopeOf(0);

/// The recording that a change would give, without positions, and how many samples of the camera there are for each of its own.
pub(super) fn empty_recording(worm: &RecordedWorm<'_>, change: &Change) -> (Recording, f64) {
    let base = &worm.scene.observed[change.base];
    let time_s = &base.run.recording.time_s;
    let own_hz = (time_s.len() - 1) as f64 / (time_s[time_s.len() - 1] - time_s[0]);
    let rate_hz = own_hz.min(RATE_HZ).min(SAMPLES_PER_CYCLE / change.cycle_s);
    let turn_s = change.cycle_s + change.dwell_s;
    let samples = ((REST_S + change.cycles * turn_s) * rate_hz).ceil() as usize + 1;
    let time_s: Vec<f64> = (0..samples).map(|sample| sample as f64 / rate_hz).collect();
    let phase = time_s.iter().map(|time_s| {
        let turns = ((time_s - REST_S) / turn_s).clamp(0.0, change.cycles);
        let within_s = turns.fract() * turn_s;
        turns.floor() + (within_s / change.cycle_s).min(1.0)
    });
    let recording = Recording {
        gait_phase: Some(phase.collect()),
        position_m: vec![vec![0.0; samples]; base.cells()],
        time_s,
        source: "the next run".into(),
        cell_names: Vec::new(),
        motor: None,
        warnings: Vec::new(),
        repairs: Vec::new(),
    };
    (recording, own_hz / rate_hz)
}

/// A run that may be made.
pub(super) struct Trial<'r> {
    scene: Scene<'r>,
    bins: Bins,
    noise: RunNoise,
}

/// What one rival predicts for it.
pub(super) struct RunOutcome {
    pub predicted: Predicted,
    /// Advance of a settled cycle, m.
    pub advance_m: f64,
    /// The predicted positions, whitened: noise has variance 1.
    whitened: Vec<f64>,
}

impl<'r> Trial<'r> {
    /// The run with a change; none where the slope is out of range.
    pub fn new(worm: &RecordedWorm<'_>, change: &Change, (recording, thinned): &'r (Recording, f64)) -> Option<Self> {
        let base = &worm.scene.observed[change.base];
        let mut physics = worm.scene.nominal[change.base].clone();
        physics.worm = physics.worm.with_slope_rad(change.slope_deg.to_radians()).ok()?;
        physics.worm.add_mass_kg(change.extra_kg);
        let mut observed = Observed {
            repairs: Vec::new(),
            run: RecordedRun {
                recording,
                slope_deg: change.slope_deg,
                payload_kg: base.run.payload_kg + change.extra_kg,
                cycle_s: Some(change.cycle_s),
            },
            phase: recording.gait_phase.clone()?,
            phase_recorded: base.phase_recorded,
            step_order: base.step_order.clone(),
            sees_positions: base.sees_positions,
            position_m: recording.position_m.clone(),
            first_m: base.first_m.iter().map(|at_m| at_m + change.shift_m).collect(),
            noise_m: base.noise_m,
            may_be_laid_down: true,
            laid_down: true,
            counts_from: 0,
            cycle_s: change.cycle_s,
            pauses: false,
            pace: Pace::default(),
            settled: None,
            torque: None,
        };
        observed.assume_laid_down(true);
        let bins = bins(&observed);
        Some(Self {
            noise: worm.noise[change.base].of_another(&observed, &bins, *thinned),
            bins,
            scene: Scene {
                observed: vec![observed],
                nominal: vec![physics],
            },
        })
    }

    /// The phases of its samples.
    pub fn phase(&self) -> &[f64] {
        &self.scene.observed[0].phase
    }

    /// Whether a rival's crawl is periodic, and so quick to simulate.
    pub fn is_periodic(&self, rival: &Fit) -> bool {
        self.scene.physics(0, &rival.hypothesis, &rival.at).0.is_periodic()
    }

    /// Prediction of a rival; none where its worm does not hold.
    pub fn predict(&self, rival: &Fit) -> Option<RunOutcome> {
        self.predict_at(rival, &on_new_run(rival))
    }

    fn predict_at(&self, rival: &Fit, at: &[f64]) -> Option<RunOutcome> {
        let observed = &self.scene.observed[0];
        let (physics, _) = self.scene.physics(0, &rival.hypothesis, at);
        physics.clamped_worm().check_hold().ok()?;
        let predicted = self.scene.predict(0, &rival.hypothesis, at)?;
        let mut whitened = Vec::new();
        let residual = Residual::binned(observed, &self.bins, &predicted);
        self.noise.whiten(&residual, &mut whitened);
        let cells = observed.cells();
        let mean_m = |sample: usize| {
            let cells_m = &predicted.position_m[sample * cells..(sample + 1) * cells];
            cells_m.iter().sum::<f64>() / cells as f64
        };
        let last = observed.samples() - 1;
        let from = observed
            .phase
            .partition_point(|&phase| phase < SETTLING_CYCLES)
            .min(last);
        Some(RunOutcome {
            advance_m: (mean_m(last) - mean_m(from)) / (observed.phase[last] - observed.phase[from]),
            predicted,
            whitened,
        })
    }

    /// Which quantities of a rival matter in the new run.
    pub fn relevant_quantities(rival: &Fit) -> Vec<usize> {
        let of_old_run = |what: What| matches!(Nuisance::of(what), Some(Nuisance::SlopeOf(run)) if run != 0);
        let free = rival.hypothesis.free.iter().enumerate();
        free.filter(|(_, free)| !of_old_run(free.what))
            .map(|(quantity, _)| quantity)
            .collect()
    }

    /// Derivative of a rival's prediction with respect to one of its quantities.
    pub fn derivative(&self, rival: &Fit, outcome: &RunOutcome, quantity: usize) -> Vec<f64> {
        let free = &rival.hypothesis.free[quantity];
        let mut at = on_new_run(rival);
        let step = free.quantity.inward_step(at[quantity]);
        at[quantity] += step;
        match self.predict_at(rival, &at) {
            Some(beside) => {
                let pairs = beside.whitened.iter().zip(&outcome.whitened);
                pairs.map(|(beside, here)| (beside - here) / step).collect()
            }
            // No derivative where the worm would not hold.
            None => vec![0.0; outcome.whitened.len()],
        }
    }
}

/// A rival's values with the slope of the new run as stated.
fn on_new_run(rival: &Fit) -> Vec<f64> {
    let free = rival.hypothesis.free.iter().zip(&rival.at);
    free.map(|(free, &at)| {
        if Nuisance::of(free.what) == Some(FRESH_SLOPE) {
            free.quantity.centre
        } else {
            at
        }
    })
    .collect()
}

/// Distance between two predictions without any adjustment, in standard deviations.
pub(super) fn plain_distance(a: &RunOutcome, b: &RunOutcome) -> f64 {
    difference(a, b).iter().map(|off| off * off).sum::<f64>().sqrt()
}

fn difference(a: &RunOutcome, b: &RunOutcome) -> Vec<f64> {
    a.whitened.iter().zip(&b.whitened).map(|(a, b)| a - b).collect()
}

/// What a rival may adjust to come nearer to the data.
pub(super) struct Adjustment {
    columns: Vec<Vec<f64>>,
    inverse: DMatrix<f64>,
}

impl Adjustment {
    /// From the derivatives of the relevant quantities; none where the normal matrix is singular.
    pub fn new(rival: &Fit, columns: Vec<Vec<f64>>) -> Option<Self> {
        let relevant_quantities = Trial::relevant_quantities(rival);
        let count = rival.at.len();
        let normal = rival.normal(None);
        // The first run's slope error keeps its place, and the new run's is one more quantity at the end.
        let place = |quantity: usize| {
            if Nuisance::of(rival.hypothesis.free[quantity].what) == Some(FRESH_SLOPE) {
                count
            } else {
                quantity
            }
        };
        let mut matrix = DMatrix::identity(count + 1, count + 1);
        matrix.view_mut((0, 0), (count, count)).copy_from(&normal);
        for (&quantity, column) in relevant_quantities.iter().zip(&columns) {
            if place(quantity) == count {
                matrix[(count, count)] = rival.hypothesis.free[quantity].quantity.sigma.powi(-2);
            }
            for (&other, other_column) in relevant_quantities.iter().zip(&columns) {
                matrix[(place(quantity), place(other))] += dot(column, other_column, None);
            }
        }
        for quantity in 0..=count {
            matrix[(quantity, quantity)] *= 1.0 + 1e-9;
        }
        let inverse = matrix.cholesky()?.inverse();
        let inverse = DMatrix::from_fn(relevant_quantities.len(), relevant_quantities.len(), |row, column| {
            inverse[(place(relevant_quantities[row]), place(relevant_quantities[column]))]
        });
        Some(Self { columns, inverse })
    }

    /// Distance between two predictions after the rival of this adjustment has adjusted what it can, in standard deviations.
    pub fn distance(&self, a: &RunOutcome, b: &RunOutcome) -> f64 {
        let difference = difference(a, b);
        let products = DVector::from_iterator(
            self.columns.len(),
            self.columns.iter().map(|column| dot(column, &difference, None)),
        );
        let turned = products.dot(&(&self.inverse * &products));
        (dot(&difference, &difference, None) - turned).max(0.0).sqrt()
    }
}
