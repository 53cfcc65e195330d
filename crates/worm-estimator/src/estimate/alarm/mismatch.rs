//! Model mismatch: the worm makes a displacement, in some part of the gait or in the whole cycle, that the model does not explain.
//!
//! The estimator keeps the residual map (see [`crate::estimate::mismatch`], which also lists what is allowed for); this detector evaluates it
//! whenever it has changed. The alarm is raised when something in the map exceeds `threshold`, in metres a cycle, with the confidence of
//! the whole family, and cleared when nothing exceeds it any more; to it is added what identified bounds leave uncertain. It is armed while the map has enough cycles; new bounds, a reversal or a
//! restart leave it unarmed until there are enough again.
//!
//! The value is the unexplained displacement, measured less modelled, along the crawl. The cell is the one that shows it best, and the
//! alarm's phase is the last one at which the gait passed the place where it shows: with the step order that tells whose step it was.

use super::cam_motion::Tick;
use super::latch::{DetectorOutput, Reading, ReadingState};
use crate::config::Config;
use crate::estimate::mismatch::ResidualMap;
use crate::message::Severity;

#[derive(Debug, Clone)]
pub(super) struct ModelMismatch {
    threshold_m: f64,
    revision: u64,
    place: Option<f64>, // gait phase of the last mismatch, 0 to 1
    since_ns: u64,
    finding: DetectorOutput,
}

impl ModelMismatch {
    pub(super) fn new(config: &Config) -> Self {
        Self {
            threshold_m: config.alarms.model_mismatch.threshold,
            revision: 0,
            place: None,
            since_ns: 0,
            finding: DetectorOutput::Unknown,
        }
    }

    pub(super) fn update(&mut self, tick: &Tick, map: Option<&ResidualMap>) -> DetectorOutput {
        if let Some(map) = map.filter(|map| map.revision() != self.revision) {
            self.revision = map.revision();
            self.finding = self.evaluate(tick, map);
        }
        self.finding
    }

    /// The last gait phase, at or before this one, at which the gait passed the place of the mismatch.
    pub(super) fn phase_before(&self, phase: f64) -> f64 {
        self.place.map_or(phase, |place| (phase - place).floor() + place)
    }

    fn evaluate(&mut self, tick: &Tick, map: &ResidualMap) -> DetectorOutput {
        let Some(found) = map.unexplained(self.threshold_m) else {
            self.since_ns = tick.now_ns;
            return DetectorOutput::Unknown;
        };
        let verdict = if found.is_significant {
            ReadingState::Bad
        } else if found.is_within {
            self.since_ns = tick.now_ns;
            ReadingState::Good
        } else {
            ReadingState::Between
        };
        self.place = Some(found.at.phase);
        DetectorOutput::Measured(Reading {
            value: found.excess_m,
            threshold: found.allowed_m,
            verdict,
            since_ns: self.since_ns,
            cell: Some(found.at.cell),
            severity: Severity::Warning,
        })
    }
}
