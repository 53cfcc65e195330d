//! A run that was not made yet, under each rival: what each says of it, and how far apart they would be seen to be.
//!
//! The distance between two rivals is what the data of the new run would say against the wrong one, which may turn everything
//! that is free in it as far as the campaign so far allows (its own normal matrix is the prior), and the error of the new run's slope.

use super::super::fit::{Fit, FitProblem};
use super::super::noise::RunNoise;
use super::super::observed::Observed;
use super::super::parameter::{Nuisance, What};
use super::super::predict::{Predicted, Scene};
use super::super::residual::Residual;
use super::change::Change;
use crate::experiment::RecordedRun;
use crate::least_squares::dot;
use crate::recording::Recording;
use nalgebra::{DMatrix, DVector};

/// Fastest sampling that is simulated, Hz, and most samples in a cycle: more only repeat each other.
const RATE_HZ: f64 = 120.0;
const SAMPLES_PER_CYCLE: f64 = 120.0;
/// Time at rest before the first step, s.
const REST_S: f64 = 0.3;
/// Cycles after which the advance counts.
const SETTLING_CYCLES: f64 = 2.0;
/// The slope error of the new run stands in the place of the first run's.
const FRESH_SLOPE: What = What::Nuisance(Nuisance::SlopeOf(0));

/// The recording that a change would give, without positions, and which share of the camera's samples it has, as one in so many.
pub(super) fn blank(problem: &FitProblem<'_, '_>, change: &Change) -> (Recording, f64) {
    let base = &problem.scene.observed[change.base];
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
    };
    (recording, own_hz / rate_hz)
}

/// A run to come.
pub(super) struct Trial<'r> {
    scene: Scene<'r>,
    noise: RunNoise,
}

/// What one rival says of it.
pub(super) struct Said {
    pub predicted: Predicted,
    /// Advance of a settled cycle, m.
    pub advance_m: f64,
    /// Everything in units of what noise would do, of variance 1.
    whitened: Vec<f64>,
}

impl<'r> Trial<'r> {
    /// The run of a change; none where the canal cannot lie like that.
    pub fn new(
        problem: &FitProblem<'_, '_>,
        change: &Change,
        (recording, thinned): &'r (Recording, f64),
    ) -> Option<Self> {
        let base = &problem.scene.observed[change.base];
        let mut physics = problem.scene.nominal[change.base].clone();
        physics.worm = physics.worm.with_slope_rad(change.slope_deg.to_radians()).ok()?;
        physics.worm.add_mass_kg(change.extra_kg);
        let mut observed = Observed {
            run: RecordedRun {
                recording,
                slope_deg: change.slope_deg,
                payload_kg: base.run.payload_kg + change.extra_kg,
                cycle_s: Some(change.cycle_s),
            },
            phase: recording.gait_phase.clone()?,
            phase_recorded: base.phase_recorded,
            step_order: base.step_order.clone(),
            position_m: recording.position_m.clone(),
            first_m: base.first_m.iter().map(|at_m| at_m + change.shift_m).collect(),
            noise_m: base.noise_m,
            may_be_laid_down: true,
            laid_down: true,
            counts_from: 0,
            cycle_s: change.cycle_s,
        };
        observed.assume_laid_down(true);
        Some(Self {
            noise: problem.noise[change.base].of_another(&observed, *thinned),
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

    /// Whether a rival's crawl repeats itself, and so is simulated quickly.
    pub fn is_periodic(&self, rival: &Fit) -> bool {
        self.scene.physics(0, &rival.hypothesis, &rival.at).0.is_periodic()
    }

    /// What a rival says; none where its worm does not hold.
    pub fn ask(&self, rival: &Fit) -> Option<Said> {
        self.ask_at(rival, &as_new(rival))
    }

    fn ask_at(&self, rival: &Fit, at: &[f64]) -> Option<Said> {
        let observed = &self.scene.observed[0];
        let (physics, _) = self.scene.physics(0, &rival.hypothesis, at);
        physics.clamped_worm().check_hold().ok()?;
        let predicted = self.scene.predict(0, &rival.hypothesis, at)?;
        let mut whitened = Vec::new();
        self.noise
            .whiten(observed, &Residual::new(observed, &predicted), &mut whitened);
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
        Some(Said {
            advance_m: (mean_m(last) - mean_m(from)) / (observed.phase[last] - observed.phase[from]),
            predicted,
            whitened,
        })
    }

    /// Which quantities of a rival matter in the new run.
    pub fn matter(rival: &Fit) -> Vec<usize> {
        let of_old_run = |what: What| matches!(what, What::Nuisance(Nuisance::SlopeOf(run)) if run != 0);
        let free = rival.hypothesis.free.iter().enumerate();
        free.filter(|(_, free)| !of_old_run(free.what))
            .map(|(quantity, _)| quantity)
            .collect()
    }

    /// How what a rival says changes with one of its quantities.
    pub fn derivative(&self, rival: &Fit, said: &Said, quantity: usize) -> Vec<f64> {
        let free = &rival.hypothesis.free[quantity];
        let mut at = as_new(rival);
        let step = free.quantity.inward_step(at[quantity]);
        at[quantity] += step;
        match self.ask_at(rival, &at) {
            Some(beside) => {
                let pairs = beside.whitened.iter().zip(&said.whitened);
                pairs.map(|(beside, here)| (beside - here) / step).collect()
            }
            // A worm that would not hold tells nothing of how little it takes.
            None => vec![0.0; said.whitened.len()],
        }
    }
}

/// A rival's values with the slope of the new run as stated.
fn as_new(rival: &Fit) -> Vec<f64> {
    let free = rival.hypothesis.free.iter().zip(&rival.at);
    free.map(|(free, &at)| {
        if free.what == FRESH_SLOPE {
            free.quantity.centre
        } else {
            at
        }
    })
    .collect()
}

/// Distance between what two rivals say, in standard deviations, nothing turned.
pub(super) fn plain_distance(a: &Said, b: &Said) -> f64 {
    difference(a, b).iter().map(|off| off * off).sum::<f64>().sqrt()
}

fn difference(a: &Said, b: &Said) -> Vec<f64> {
    a.whitened.iter().zip(&b.whitened).map(|(a, b)| a - b).collect()
}

/// What a rival may turn to come nearer to what is seen.
pub(super) struct Reach {
    columns: Vec<Vec<f64>>,
    inverse: DMatrix<f64>,
}

impl Reach {
    /// From the derivatives of the quantities that matter; none where nothing is known of one.
    pub fn new(rival: &Fit, columns: Vec<Vec<f64>>) -> Option<Self> {
        let matter = Trial::matter(rival);
        let count = rival.at.len();
        let normal = rival.normal(None);
        // The first run's slope error stays what the campaign says of it, and the new run's is one more quantity behind all.
        let place = |quantity: usize| {
            if rival.hypothesis.free[quantity].what == FRESH_SLOPE {
                count
            } else {
                quantity
            }
        };
        let mut matrix = DMatrix::identity(count + 1, count + 1);
        matrix.view_mut((0, 0), (count, count)).copy_from(&normal);
        for (&quantity, column) in matter.iter().zip(&columns) {
            if place(quantity) == count {
                matrix[(count, count)] = rival.hypothesis.free[quantity].quantity.sigma.powi(-2);
            }
            for (&other, other_column) in matter.iter().zip(&columns) {
                matrix[(place(quantity), place(other))] += dot(column, other_column, None);
            }
        }
        for quantity in 0..=count {
            matrix[(quantity, quantity)] *= 1.0 + 1e-9;
        }
        let inverse = matrix.cholesky()?.inverse();
        let inverse = DMatrix::from_fn(matter.len(), matter.len(), |row, column| {
            inverse[(place(matter[row]), place(matter[column]))]
        });
        Some(Self { columns, inverse })
    }

    /// What is left of the distance between two rivals when the one of this reach turns what it can, in standard deviations.
    pub fn distance(&self, a: &Said, b: &Said) -> f64 {
        let difference = difference(a, b);
        let shadow = DVector::from_iterator(
            self.columns.len(),
            self.columns.iter().map(|column| dot(column, &difference, None)),
        );
        let turned = shadow.dot(&(&self.inverse * &shadow));
        (dot(&difference, &difference, None) - turned).max(0.0).sqrt()
    }
}
