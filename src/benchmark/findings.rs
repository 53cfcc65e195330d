//! What the parts of a benchmark have measured.

use super::floor::FloorOutcome;
use crate::latency::outcome::{Cyclictest, RateTrial};
use crate::latency::{Durations, TickStats};
use crate::realtime::InForce;

/// A rate counts as sustained when at most this fraction of its deadlines is missed, and at most this fraction of its exchanges
/// fails.
pub(super) const MAX_MISSED_FRACTION: f64 = 0.01;

/// Everything that was measured; what was not is empty.
#[derive(Default)]
pub(super) struct Findings {
    /// The loop's ticks.
    pub(super) ticks: TickStats,
    /// The bare sleeper beside it.
    pub(super) floor: FloorOutcome,
    /// States until the woken estimator has them, and the same of the bare pair.
    pub(super) delivery: Durations,
    pub(super) floor_delivery: Durations,
    /// The same to subscribers that never sleep.
    pub(super) polled_delivery: Durations,
    pub(super) floor_polled_delivery: Durations,
    /// From the block of the cam to the alarm.
    pub(super) alarm: Durations,
    /// How long the loop was measured, s.
    pub(super) measured_s: f64,
    /// Share of one CPU, 0 to 1.
    pub(super) controller_cpu_share: f64,
    pub(super) estimator_cpu_share: f64,
    /// What the operating system really gave the loop.
    pub(super) in_force: Option<InForce>,
    /// The rates that were tried.
    pub(super) rates: Vec<RateTrial>,
    pub(super) cyclictest: Option<Cyclictest>,
    pub(super) warnings: Vec<String>,
}
