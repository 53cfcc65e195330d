//! Model mismatch: the worm makes a way, in some part of the gait or in the whole cycle, that the model does not explain.
//!
//! The residual map is kept by the estimator (see [`crate::estimate::mismatch`], which also tells what is allowed for); this
//! looks at it whenever it has changed. It is raised when something in the map is beyond `threshold`, in metres of way a cycle,
//! with the confidence of the whole family, and cleared when nothing is beyond it any more. It watches while the map rests on
//! enough cycles; bounds found anew, a reversal and a restart leave it blind until there are some again.
//!
//! Value is the unexplained way, measured less modelled along the crawl. The cell is the one whose way shows it best, and the
//! alarm's phase is the last at which the gait was where it shows: with the step order that tells whose step it was.

use super::cam_motion::Tick;
use super::latch::{DetectorOutput, Reading, ReadingState};
use crate::config::Config;
use crate::estimate::mismatch::ResidualMap;
use crate::message::Severity;

#[derive(Debug, Clone)]
pub(super) struct ModelMismatch {
    threshold_m: f64,
    revision: u64,
    place: Option<f64>, // gait phase of what was found last, 0 to 1
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

    /// The last gait phase, at or before this one, at which the gait was where the mismatch shows.
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
            threshold: self.threshold_m,
            verdict,
            since_ns: self.since_ns,
            cell: Some(found.at.cell),
            severity: Severity::Warning,
        })
    }
}
