//! Runs of worms that crawl.

use super::body::Worm;
use super::effect_size::advances_m;
use super::scene::{CrawlFailed, Scene, SimulatedRun};

/// Smallest advance of a worm that counts as crawling, m: mean over the cycles of a run.
const MIN_ADVANCE_M: f64 = 0.5e-3;
/// Smallest advance of any of its cycles after the first, m.
const MIN_IN_A_CYCLE_M: f64 = 0.2e-3;
/// Least difference between the slopes of two runs, degrees.
const MIN_STEP_DEG: f64 = 5.0;

/// Slopes in degrees, and the runs with what is hidden and without.
pub type SteepestRuns = (Vec<f64>, Vec<SimulatedRun>, Vec<SimulatedRun>);

/// Simulates every run on the steepest of its slopes on which the worm crawls with what is hidden in it and without.
pub fn crawl_steepest(
    worm: &Worm,
    baseline: &Worm,
    is_hidden: bool,
    scenes: &mut [Scene],
    slopes_deg: &[Vec<f64>],
) -> Option<SteepestRuns> {
    let mut all = SteepestRuns::default();
    for (scene, choices) in scenes.iter_mut().zip(slopes_deg) {
        let error_deg = scene.placement.slope_deg;
        let gentlest_deg = all.0.last().map_or(0.0, |&before_deg| before_deg + MIN_STEP_DEG);
        let mut able = choices.iter().copied().filter(|&deg| deg == 0.0 || deg >= gentlest_deg);
        let (slope_deg, simulated, without) = able.find_map(|slope_deg| {
            scene.placement.slope_deg = slope_deg + error_deg;
            let simulated = crawl(worm, scene).ok()?;
            let without = if is_hidden {
                crawl(baseline, scene).ok()?
            } else {
                simulated.clone()
            };
            Some((slope_deg, simulated, without))
        })?;
        all.0.push(slope_deg);
        all.1.push(simulated);
        all.2.push(without);
    }
    Some(all)
}

/// Simulates a run.
///
/// # Errors
/// [`CrawlFailed`] when the worm slides down or hardly advances.
pub fn crawl(worm: &Worm, scene: &Scene) -> Result<SimulatedRun, CrawlFailed> {
    let simulated = scene.simulate(worm)?;
    let advances_m = advances_m(&simulated);
    let mean_m = advances_m.iter().sum::<f64>() / advances_m.len() as f64;
    let min_m = advances_m.iter().skip(1).copied().fold(f64::INFINITY, f64::min);
    if mean_m >= MIN_ADVANCE_M && min_m >= MIN_IN_A_CYCLE_M {
        Ok(simulated)
    } else {
        Err(CrawlFailed)
    }
}
