//! Recordings for tests: simulated, changed, and with the gait that is found in them.

use super::gait::{IdentifiedGait, Prior, find};
use crate::experiment::{Simulation, simulate};
use crate::recording::Recording;
use worm_estimator::config::Config;

/// The configured worm, simulated, after a change.
pub(super) fn crawl(simulation: &Simulation, change: impl FnOnce(&mut Recording)) -> (Recording, IdentifiedGait) {
    let mut recording = simulate(&Config::default(), simulation).expect("it crawls");
    change(&mut recording);
    let prior = Prior {
        step_order: &[0, 1, 2, 3],
        phase: recording.gait_phase.as_deref(),
    };
    let gait = find(&recording.time_s, &recording.position_m, &recording.filled(), prior).expect("a gait");
    (recording, gait)
}
