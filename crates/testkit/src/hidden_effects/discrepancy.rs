//! A discrepancy in the law of all pads, scaled until what recalibration leaves of it has the requested size.
//!
//! How much of a wave in the pads' law recalibration takes up differs from worm to worm, so the wave is scaled by what is left of it,
//! and what is left after that is measured.

use super::body::Worm;
use super::crawling::crawl;
use super::scene::{CrawlFailed, Scene, SimulatedRun};
use super::true_campaign::RunPairs;

/// Largest wave, m: beyond it a pad's law is no longer nearly that of a spring.
const MAX_WAVE_M: f64 = 0.2e-3;
/// Scalings: what is left is not quite proportional to the wave.
const SCALINGS: usize = 2;
/// Smallest fraction of the requested size that must be left.
const LEAST_LEFT: f64 = 0.9;

/// The runs of a worm whose discrepancy has been scaled.
pub struct Scaled {
    pub simulated: Vec<SimulatedRun>,
    /// Root mean square that is left after recalibration, m.
    pub remaining_m: f64,
}

/// Scales the wave in the pads of `worm` so that recalibration leaves about `asked_m` of it, from runs with it and without it.
///
/// # Errors
/// [`CrawlFailed`] when the worm no longer crawls, or recalibration takes up even the largest wave: another one is to be drawn.
pub fn scale(
    worm: &mut Worm,
    asked_m: f64,
    scenes: &[Scene],
    simulated: &[SimulatedRun],
    baseline: &[SimulatedRun],
) -> Result<Scaled, CrawlFailed> {
    let remaining_m = |worm: &Worm, simulated: &[SimulatedRun]| {
        let pairs = RunPairs {
            parameters: &worm.parameters,
            scenes,
            slopes_deg: &[],
            simulated,
            baseline,
            by_time: false,
        };
        pairs.detector().remaining_m(&pairs.differences_m(simulated))
    };
    let mut scaled = Scaled {
        remaining_m: remaining_m(worm, simulated),
        simulated: simulated.to_vec(),
    };
    for _ in 0..SCALINGS {
        let wave_m = worm.deviations.discrepancy_m * asked_m / scaled.remaining_m;
        worm.deviations.discrepancy_m = wave_m.min(MAX_WAVE_M);
        scaled.simulated = scenes
            .iter()
            .map(|scene| crawl(worm, scene))
            .collect::<Result<_, _>>()?;
        scaled.remaining_m = remaining_m(worm, &scaled.simulated);
    }
    if scaled.remaining_m < LEAST_LEFT * asked_m {
        return Err(CrawlFailed);
    }
    Ok(scaled)
}
