//! No progress: the cam turns and the worm does not advance.
//!
//! The advance over the last whole cycle (see [`super::stride`]) is compared, 32 times a cycle, with `threshold` × the baseline for this
//! direction. Until that is calibrated, half of `threshold` × the model's prediction is used; where that is missing or near zero, 5 % of the
//! stroke is the baseline: a worm that gains less than a fraction of that per cycle does not progress, whatever the model says. When a
//! worm starts to slip suddenly, the advance over the last cycle falls along a straight line, so the default of 0.3 raises the alarm
//! after 0.7 of a cycle.

use super::cam_motion::Tick;
use super::latch::{DetectorOutput, Reading, ReadingState};
use super::stride::{Baseline, Stride, Strides};
use crate::config::Config;
use crate::message::{Cycle, Severity};

/// Lowest baseline of the advance per cycle, as a fraction of the stroke.
const MIN_BASELINE_FRACTION: f64 = 0.05;
/// Factor on the threshold when it is applied to the model's prediction.
const TRUST_IN_MODEL: f64 = 0.5;
/// Strides in a row below the limit.
const CONFIRMATIONS: u32 = 2;
/// A shortfall within this many standard deviations of the baseline is scatter.
const SCATTER_SIGMAS: f64 = 5.0;
/// The condition began when the advance was last above this fraction of the baseline.
const ONSET_FRACTION: f64 = 0.9;
/// To clear, the advance must be above the limit by this fraction of the distance to the baseline.
const CLEAR_FRACTION: f64 = 0.25;

#[derive(Debug, Clone)]
pub(super) struct NoProgress {
    fraction: f64,
    min_baseline_m: f64,
    calibration_cycles: u32,
    baseline: [Baseline; 2],       // backward, forward
    predicted_m: [Option<f64>; 2], // by the model, distance in the crawling direction
    below: u32,
    since_ns: u64,
    reading: Option<Reading>,
}

impl NoProgress {
    pub(super) fn new(config: &Config) -> Self {
        Self {
            fraction: config.alarms.no_progress.threshold,
            min_baseline_m: MIN_BASELINE_FRACTION * config.worm.stroke_m,
            calibration_cycles: config.estimator.calibration_cycles,
            baseline: [Baseline::default(); 2],
            predicted_m: [None; 2],
            below: 0,
            since_ns: 0,
            reading: None,
        }
    }

    /// Stores the model's prediction.
    pub(super) fn note_cycle(&mut self, cycle: &Cycle) {
        let predicted_m = cycle.predicted_advance_m.abs();
        self.predicted_m[usize::from(cycle.direction > 0)] = Some(predicted_m).filter(|metres| metres.is_finite());
    }

    /// The baseline of a direction, m, once it is calibrated.
    pub(super) fn baseline_m(&self, direction: f64) -> Option<f64> {
        let baseline = &self.baseline[usize::from(direction > 0.0)];
        baseline.is_known(self.calibration_cycles).then(|| baseline.mean_m())
    }

    /// Whether the last stride before a rest was one without progress.
    pub(super) fn rests_after_no_progress(&self, tick: &Tick) -> bool {
        let was_bad = self
            .reading
            .is_some_and(|reading| matches!(reading.verdict, ReadingState::Bad));
        (tick.still || !tick.torque) && was_bad
    }

    /// Processes a stride; `fault_free` says that nothing else is wrong, so that it may be used for calibration.
    pub(super) fn update(
        &mut self,
        tick: &Tick,
        strides: &Strides,
        stride: Option<&Stride>,
        fault_free: bool,
    ) -> DetectorOutput {
        let idle = tick.still || !tick.torque;
        if idle || !strides.is_settled() {
            self.below = 0;
            self.reading = None;
            if !idle {
                return DetectorOutput::Unknown;
            }
            self.since_ns = tick.now_ns;
            return DetectorOutput::Idle;
        }
        if let Some(stride) = stride {
            self.reading = Some(self.evaluate(tick, strides, stride.advance_m, fault_free));
        }
        self.reading.map_or(DetectorOutput::Unknown, DetectorOutput::Measured)
    }

    fn evaluate(&mut self, tick: &Tick, strides: &Strides, advance_m: f64, fault_free: bool) -> Reading {
        let side = usize::from(tick.direction > 0.0);
        let known = self.baseline[side].is_known(self.calibration_cycles);
        let (baseline_m, fraction, scatter_m) = if known {
            let baseline = &self.baseline[side];
            (baseline.mean_m(), self.fraction, SCATTER_SIGMAS * baseline.sigma_m())
        } else {
            let predicted_m = self.predicted_m[side].unwrap_or(0.0);
            (predicted_m, TRUST_IN_MODEL * self.fraction, 0.0)
        };
        let baseline_m = baseline_m.max(self.min_baseline_m);
        let limit_m = fraction * baseline_m;
        let below = advance_m < limit_m && baseline_m - advance_m > scatter_m;
        if below {
            self.below += 1;
        } else {
            self.below = 0;
            if !known && fault_free && strides.can_calibrate() {
                self.baseline[side].add(advance_m);
            }
        }
        if advance_m >= ONSET_FRACTION * baseline_m - scatter_m {
            self.since_ns = tick.now_ns;
        }
        let verdict = if self.below >= CONFIRMATIONS {
            ReadingState::Bad
        } else if advance_m > limit_m + CLEAR_FRACTION * (baseline_m - limit_m) {
            ReadingState::Good
        } else {
            ReadingState::Between
        };
        Reading {
            value: advance_m,
            threshold: limit_m,
            verdict,
            since_ns: self.since_ns,
            cell: None,
            severity: Severity::Critical,
        }
    }
}
