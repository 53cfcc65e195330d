//! Energy per cycle (11): by a model's own motion, and by its contacts on a path that was measured.

use super::{at_boundaries, settled_cycles};
use crate::explain::fit::{Fit, FitProblem};
use crate::explain::observed::Observed;
use crate::explain::start::{LEAD_CYCLES, start};
use worm_physics::Mechanics;

/// A run under a fit.
pub(super) struct Walk {
    /// Energy by (11) since the first sample, J.
    loss_j: Vec<f64>,
    /// Mean position of the cells, m.
    mean_m: Vec<f64>,
}

impl Walk {
    /// Energy of each whole settled cycle, J.
    pub fn energy_j(&self, observed: &Observed<'_>) -> Vec<f64> {
        let at_j = at_boundaries(observed, &settled_cycles(observed), &self.loss_j);
        at_j.windows(2).map(|pair| pair[1] - pair[0]).collect()
    }
}

/// The worm of a fit through a run by its own motion; none where it slides down.
pub(super) fn own(problem: &FitProblem<'_, '_>, run: usize, fit: &Fit) -> Option<Walk> {
    walk(problem, run, fit, None)
}

/// The worm of a fit carried through a run along its own way with `beyond_m`, as seen, on it; none where it slides down.
///
/// Its tips slide where the laws of its contacts have them slide on that path, so that what they take is the energy of a motion
/// that was measured, by contacts whose forces were not measured.
pub(super) fn carried(problem: &FitProblem<'_, '_>, run: usize, fit: &Fit, beyond_m: &[f64]) -> Option<Walk> {
    let own = own(problem, run, fit)?;
    let (physics, _) = problem.scene.physics(run, &fit.hypothesis, &fit.at);
    let path_m: Vec<f64> = own
        .mean_m
        .iter()
        .zip(beyond_m)
        .map(|(mean_m, beyond_m)| mean_m + beyond_m / physics.view.scale)
        .collect();
    walk(problem, run, fit, Some(&path_m))
}

fn walk(problem: &FitProblem<'_, '_>, run: usize, fit: &Fit, path_m: Option<&[f64]>) -> Option<Walk> {
    let observed = &problem.scene.observed[run];
    let (physics, damping) = problem.scene.physics(run, &fit.hypothesis, &fit.at);
    let mechanics = Mechanics::new(&physics);
    let mut crawl = start(observed, &mechanics, observed.phase[0], damping, LEAD_CYCLES)?;
    let first_m = crawl.mean_position_m();
    let time_s = &observed.run.recording.time_s;
    let mut walk = Walk {
        loss_j: Vec::with_capacity(observed.samples()),
        mean_m: Vec::with_capacity(observed.samples()),
    };
    for (sample, &phase) in observed.phase.iter().enumerate() {
        let step_s = time_s[sample] - time_s[sample.saturating_sub(1)];
        match path_m {
            None => crawl.advance_to(&mechanics, phase, step_s).ok()?,
            Some(path_m) => crawl.carry_to(&mechanics, phase, step_s, first_m + path_m[sample] - path_m[0]),
        }
        walk.loss_j.push(crawl.ledger().loss_j());
        walk.mean_m.push(crawl.mean_position_m());
    }
    Some(walk)
}
