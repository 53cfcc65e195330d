//! Energy per cycle (11): by a model's own motion, and by its contacts on a path that was measured.

use super::observed::Observed;
use super::predict::Scene;
use super::settled_cycles::{at_boundaries, settled_cycles};
use super::start::{LEAD_CYCLES, start};
use crate::explain::search::fit::Fit;
use crate::explain::search::hypothesis::Hypothesis;
use worm_physics::Mechanics;

/// A run under a fit.
pub(in crate::explain) struct Walk {
    /// Energy by (11) since the first sample, J.
    loss_j: Vec<f64>,
    /// Mean position of the cells, m.
    mean_m: Vec<f64>,
}

impl Walk {
    /// Energy of each whole settled cycle, J.
    pub fn energy_j(&self, observed: &Observed<'_>) -> Vec<f64> {
        of_cycles(observed, &self.loss_j)
    }
}

/// What a cumulative energy grows by in each whole settled cycle, J.
pub(in crate::explain) fn of_cycles(observed: &Observed<'_>, cumulative_j: &[f64]) -> Vec<f64> {
    let at_j = at_boundaries(observed, &settled_cycles(observed), cumulative_j);
    at_j.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

/// A hypothesis, and values of what is free in it.
type Under<'h> = (&'h Hypothesis, &'h [f64]);

/// Mean energy of a settled cycle of a run under a hypothesis, J; none where the worm slides down.
pub(in crate::explain) fn energy_per_cycle_j(scene: &Scene<'_>, run: usize, under: Under<'_>) -> Option<f64> {
    let energy_j = own(scene, run, under)?.energy_j(&scene.observed[run]);
    Some(energy_j.iter().sum::<f64>() / energy_j.len() as f64)
}

/// The worm of a hypothesis through a run by its own motion; none where it slides down.
pub(in crate::explain) fn own(scene: &Scene<'_>, run: usize, under: Under<'_>) -> Option<Walk> {
    walk(scene, run, under, None)
}

/// The worm of a fit carried through a run along its own way with `beyond_m`, as seen, on it; none where it slides down.
///
/// Its tips slide where the laws of its contacts have them slide on that path, so that what they take is the energy of a motion
/// that was measured, by contacts whose forces were not measured.
pub(in crate::explain) fn carried(scene: &Scene<'_>, run: usize, fit: &Fit, beyond_m: &[f64]) -> Option<Walk> {
    let under = (&fit.hypothesis, &fit.at[..]);
    let own = own(scene, run, under)?;
    let (physics, _) = scene.physics(run, under.0, under.1);
    let path_m: Vec<f64> = own
        .mean_m
        .iter()
        .zip(beyond_m)
        .map(|(mean_m, beyond_m)| mean_m + beyond_m / physics.view.scale)
        .collect();
    walk(scene, run, under, Some(&path_m))
}

fn walk(scene: &Scene<'_>, run: usize, (hypothesis, at): Under<'_>, path_m: Option<&[f64]>) -> Option<Walk> {
    let observed = &scene.observed[run];
    let (physics, damping) = scene.physics(run, hypothesis, at);
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
