//! One run as the fit sees it: which samples count, and the displacement by theory.

use super::PositionRun;
use crate::identify::drift::Drift;
use crate::identify::theory::TheoryBody;
use worm_physics::{Motion, Worm, WormError, steady_cycle};

/// Distance from the beginning of a step up to which a run counts as beginning with it, cycles.
const AT_BEGIN: f64 = 0.02;
/// Phase after which the worm counts as moving, cycles; how much of the rest before is used, s; and the time for which a worm just laid
/// down settles on its tips, s.
const MOVES: f64 = 0.005;
const REST_S: f64 = 0.1;
const SINKING_S: f64 = 0.05;
/// Initial drift, as the standard deviation after one cycle, m.
const FIRST_DRIFT_M: f64 = 5e-5;

/// One run.
pub(super) struct RunData<'a> {
    pub run: PositionRun<'a>,
    pub worm: Worm, // order, stroke and slope of the run
    pub variance_m2: Vec<f64>,
    pub drift: Drift,
    pub at_begin: bool,
    pub laid_down: bool,
}

impl<'a> RunData<'a> {
    pub(super) fn new(base: &Worm, run: PositionRun<'a>) -> Result<Self, WormError> {
        let gait = run.gait;
        let worm = base
            .clone()
            .with_step_order(&gait.step_order)?
            .with_stroke_m(gait.stroke_m)?
            .with_slope_rad(run.slope_rad)?;
        let noise_m2 = gait.noise_m * gait.noise_m;
        let counts_from_s = settled_from_s(run.time_s, &gait.phase);
        let variance_m2: Vec<f64> = gait
            .seen
            .iter()
            .zip(run.time_s)
            .map(|(&seen, &time_s)| {
                if seen == 0 || time_s < counts_from_s {
                    f64::INFINITY
                } else {
                    noise_m2.max(1e-14) / seen as f64
                }
            })
            .collect();
        let steps = gait.phase.first().map_or(0.0, |phase| phase * base.cells() as f64);
        Ok(Self {
            drift: Drift::new(&gait.phase, &variance_m2, FIRST_DRIFT_M * FIRST_DRIFT_M),
            variance_m2,
            worm,
            at_begin: (steps - steps.round()).abs() < AT_BEGIN * base.cells() as f64,
            laid_down: false,
            run,
        })
    }

    /// Deformations that a worm probably has at the start of the run: laid down where it begins with a step, else those of
    /// the steady crawl.
    pub(super) fn likely_start_m(&self, worm: &Worm) -> Vec<f64> {
        let laid_down_m = vec![common_deformation_m(worm); worm.cells()];
        let phase = self.run.gait.phase[0];
        if self.at_begin || steady_cycle(worm).cycle().is_none() {
            return laid_down_m;
        }
        let mut motion = Motion::at_rest(worm, &vec![0.0; worm.cells()]);
        match motion.advance_to(worm, phase.rem_euclid(1.0) + 4.0) {
            Ok(()) => motion.deformations_m().to_vec(),
            Err(_) => laid_down_m,
        }
    }

    /// Displacement of the body at every sample, m: the mean of the cells' positions less what the stroke alone would have made.
    pub(super) fn displacement_m(&self, worm: &Worm, start_m: &[f64], damping_ratio: f64) -> Option<Vec<f64>> {
        let PositionRun { time_s, gait, .. } = self.run;
        let mut body = TheoryBody::at_rest(worm, gait.phase[0], start_m, damping_ratio);
        let mut displacement_m = Vec::with_capacity(time_s.len());
        for sample in 0..time_s.len() {
            let step_s = time_s[sample] - time_s[sample.saturating_sub(1)];
            displacement_m.push(body.go_to(gait.phase[sample], step_s).ok()?);
        }
        Some(displacement_m)
    }
}

/// Time from which the positions show the crawl, s: a worm that was just laid down first settles on its tips.
fn settled_from_s(time_s: &[f64], phase: &[f64]) -> f64 {
    let moves = phase
        .partition_point(|&phase_here| phase_here < phase[0] + MOVES)
        .min(phase.len() - 1);
    (time_s[moves] - REST_S).max(time_s[0] + SINKING_S)
}

/// Common deformation of all tips that balances the pull, m.
pub(super) fn common_deformation_m(worm: &Worm) -> f64 {
    let stiffness_n_per_m: f64 = worm.contacts().iter().map(|contact| contact.stiffness_n_per_m).sum();
    -worm.pull_n() / stiffness_n_per_m
}
