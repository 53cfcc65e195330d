//! Sliding down: the worm moves down the canal.
//!
//! "Down" is where gravity pulls; on the level it is against the crawling direction. The excess over the baseline is compared with
//! `threshold`, in metres, in one of three ways:
//!
//! - **at rest** (cam still, in any mode, with or without torque): median displacement of the cells since rest began;
//! - **crawling up or on the level**: how far the worm is below its highest point, less the baseline of the retraction at this gait phase
//!   (calibrated; before that, half a stroke). With a cell out of sight, and for a cycle after, half a stroke again: while that cell steps,
//!   only those are seen that it pushes back;
//! - **crawling down**: displacement down in the last cycle (see [`super::stride`]) less the baseline per cycle; before that is calibrated,
//!   and just after a reversal, a whole stroke, which is the most that a gait can gain.
//!
//! It clears when the worm has not sunk further for a while, and then monitors from there. A rest before that ends the cycle in which it
//! slid: no later advance over a cycle reaches back into it.

use super::cam_motion::Tick;
use super::latch::{DetectorOutput, Reading, ReadingState};
use super::sample::{Positions, TRUSTED_SAMPLES};
use super::stride::{BINS, Strides};
use crate::config::Config;
use crate::message::Severity;
use worm_physics::MAX_CELLS;

/// Slopes flatter than this count as level, degrees.
const LEVEL_DEG: f64 = 0.5;
/// Weight of the newest sample in the smoothed positions: five samples, some 40 ms.
const SMOOTHING: f64 = 0.2;
/// Samples in a row beyond the threshold.
const CONFIRMATIONS: u32 = 4;
/// A displacement within this many standard deviations of the mean position is noise.
const NOISE_SIGMAS: f64 = 4.0;
/// The worm is as high as before, whatever was not seen, after this many cycles.
const REGAINED_CYCLES: f64 = 1.0;
/// Part of the threshold by which the worm must sink further to count as still sliding.
const FURTHER_FRACTION: f64 = 0.25;
/// The slide is over after this long without sinking further, s …
const OVER_S: f64 = 2.0;
/// … and, while crawling, after this many cycles.
const OVER_CYCLES: f64 = 1.2;

/// Baseline of the retraction at each phase of a cycle, m below the highest point.
#[derive(Debug, Clone, Copy)]
struct Retraction {
    sum_m: [f64; BINS],
    count: [u32; BINS],
    /// The cells that were seen in all of it, as a mask.
    cells: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum CrawlState {
    Resting,
    Climbing,
    Descending,
}

#[derive(Debug, Clone)]
pub(super) struct SlidingDown {
    threshold_m: f64,
    stroke_m: f64,
    slope_sign: f64, // +1 uphill along the canal, −1 downhill, 0 level
    calibration_cycles: u32,
    smoothed: Positions,
    smoothed_ns: u64,    // when a sample last went into them
    longest_gap_ns: u64, // after which smoothing begins anew, for the worm has moved meanwhile
    crawl_state: Option<CrawlState>,
    reversals: u32,
    anchor: Positions, // where the present state of the crawl began
    anchor_phase: f64,
    height_m: f64, // displacement upward since then, summed sample by sample
    highest_m: f64,
    last: Positions,
    retraction: Retraction,
    blind_phase: f64, // where a cell was last out of sight that the baseline has
    beyond: u32,
    lowest_excess_m: f64, // the largest excess while the alarm's condition holds
    sunk_ns: u64,         // when it last grew
    since_ns: u64,
    sliding: bool,
}

impl SlidingDown {
    pub(super) fn new(config: &Config) -> Self {
        let slope_deg = config.canal.slope_deg;
        let noise_m = NOISE_SIGMAS * config.tracker.noise_m / (config.worm.cells as f64).sqrt();
        Self {
            threshold_m: config.alarms.sliding_down.threshold.max(noise_m),
            stroke_m: config.worm.stroke_m,
            slope_sign: if slope_deg.abs() < LEVEL_DEG {
                0.0
            } else {
                slope_deg.signum()
            },
            calibration_cycles: config.estimator.calibration_cycles,
            smoothed: Positions::NONE,
            smoothed_ns: 0,
            longest_gap_ns: (f64::from(TRUSTED_SAMPLES) / config.tracker.rate_hz * 1e9) as u64,
            crawl_state: None,
            reversals: 0,
            anchor: Positions::NONE,
            anchor_phase: 0.0,
            height_m: 0.0,
            highest_m: 0.0,
            last: Positions::NONE,
            retraction: Retraction {
                sum_m: [0.0; BINS],
                count: [0; BINS],
                cells: u32::MAX,
            },
            blind_phase: f64::NEG_INFINITY,
            beyond: 0,
            lowest_excess_m: 0.0,
            sunk_ns: 0,
            since_ns: 0,
            sliding: false,
        }
    }

    /// Whether the worm rests and a slide is not over yet.
    pub(super) const fn rests_after_slide(&self, tick: &Tick) -> bool {
        (tick.still || !tick.torque) && self.sliding
    }

    /// Processes a sample. `baseline_m` is the calibrated advance per cycle in the present direction; `fault_free` says that nothing else is
    /// wrong, so that the cycle may be used for calibration.
    pub(super) fn update(
        &mut self,
        tick: &Tick,
        positions: &Positions,
        strides: &Strides,
        baseline_m: Option<f64>,
        fault_free: bool,
    ) -> DetectorOutput {
        self.smooth(positions, tick.now_ns);
        let up = if self.slope_sign == 0.0 {
            tick.direction
        } else {
            self.slope_sign
        };
        let crawl_state = if tick.still || tick.phase.is_none() {
            CrawlState::Resting
        } else if up == tick.direction {
            CrawlState::Climbing
        } else {
            CrawlState::Descending
        };
        if self.crawl_state != Some(crawl_state) || self.reversals != tick.reversals {
            self.crawl_state = Some(crawl_state);
            self.reversals = tick.reversals;
            self.start_here(tick);
        }
        self.height_m += positions.moved_since(&self.last).unwrap_or(0.0) * up;
        self.last = *positions;
        if self.height_m > self.highest_m {
            self.highest_m = self.height_m;
        }
        let excess_m = match crawl_state {
            CrawlState::Resting => self.rested(up),
            CrawlState::Climbing => Some(self.climbed(tick, positions.mask, strides, baseline_m.is_some(), fault_free)),
            CrawlState::Descending => self.descended(tick, positions, strides, baseline_m),
        };
        match excess_m {
            Some(excess_m) if positions.mask != 0 => DetectorOutput::Measured(self.evaluate(tick, excess_m)),
            _ => DetectorOutput::Unknown,
        }
    }

    fn smooth(&mut self, positions: &Positions, now_ns: u64) {
        if now_ns.saturating_sub(std::mem::replace(&mut self.smoothed_ns, now_ns)) > self.longest_gap_ns {
            self.smoothed = Positions::NONE;
        }
        for cell in 0..MAX_CELLS {
            let weight = if self.smoothed.has(cell) { SMOOTHING } else { 1.0 };
            let before = if self.smoothed.has(cell) {
                self.smoothed.metres[cell]
            } else {
                0.0
            };
            if positions.has(cell) {
                self.smoothed.metres[cell] = before + weight * (positions.metres[cell] - before);
            }
        }
        self.smoothed.mask = positions.mask;
    }

    fn start_here(&mut self, tick: &Tick) {
        self.anchor = self.smoothed;
        self.anchor_phase = tick.phase.unwrap_or(0.0);
        self.height_m = 0.0;
        self.highest_m = 0.0;
        self.beyond = 0;
        self.lowest_excess_m = 0.0;
        self.sunk_ns = tick.now_ns;
    }

    fn rested(&mut self, up: f64) -> Option<f64> {
        // Cells that become visible during the rest count from where they are first seen.
        let moved_m = self.smoothed.median_moved_since(&self.anchor);
        if moved_m.is_none() {
            self.anchor = self.smoothed;
        }
        moved_m.map(|metres| -metres * up)
    }

    fn climbed(&mut self, tick: &Tick, seen: u32, strides: &Strides, baseline_is_known: bool, fault_free: bool) -> f64 {
        let below_m = self.highest_m - self.height_m;
        let phase = tick.phase.unwrap_or(0.0);
        let bin = ((phase.rem_euclid(1.0) * BINS as f64) as usize).min(BINS - 1);
        let Retraction { sum_m, count, cells } = &mut self.retraction;
        let calibrates = !baseline_is_known || count[bin] < self.calibration_cycles;
        if fault_free && calibrates && strides.can_calibrate() && below_m < 0.5 * self.stroke_m {
            sum_m[bin] += below_m;
            count[bin] += 1;
            *cells &= seen;
        }
        if count[bin] > 0 && seen & *cells != *cells {
            self.blind_phase = phase;
        }
        let is_blind = (phase - self.blind_phase).abs() < REGAINED_CYCLES;
        let baseline_m = if baseline_is_known && count[bin] > 0 && !is_blind {
            sum_m[bin] / f64::from(count[bin])
        } else {
            0.5 * self.stroke_m
        };
        below_m - baseline_m
    }

    fn descended(
        &mut self,
        tick: &Tick,
        positions: &Positions,
        strides: &Strides,
        baseline_m: Option<f64>,
    ) -> Option<f64> {
        let phase = tick.phase?;
        if let Some(displacement_m) = strides.advance_until(tick, positions) {
            let baseline_m = baseline_m.filter(|_| strides.is_settled());
            return Some(displacement_m - baseline_m.unwrap_or(self.stroke_m));
        }
        // No sample of one cycle ago: the displacement since the descent began, if that is less than a cycle ago.
        if (phase - self.anchor_phase).abs() > 1.0 {
            self.start_here(tick);
        }
        Some(-self.height_m - self.stroke_m)
    }

    fn evaluate(&mut self, tick: &Tick, excess_m: f64) -> Reading {
        if excess_m > self.threshold_m {
            self.beyond += 1;
        } else {
            self.beyond = 0;
            if excess_m < FURTHER_FRACTION * self.threshold_m && !self.sliding {
                self.since_ns = tick.now_ns;
            }
        }
        if self.beyond >= CONFIRMATIONS && !self.sliding {
            self.sliding = true;
            self.lowest_excess_m = excess_m;
            self.sunk_ns = tick.now_ns;
        }
        let mut verdict = if self.sliding {
            ReadingState::Bad
        } else {
            ReadingState::Good
        };
        if self.sliding {
            if excess_m > self.lowest_excess_m + FURTHER_FRACTION * self.threshold_m {
                self.lowest_excess_m = excess_m;
                self.sunk_ns = tick.now_ns;
            }
            let cycle_s = match self.crawl_state {
                Some(CrawlState::Resting) | None => 0.0,
                Some(_) => (OVER_CYCLES / tick.regime_cycles_per_s.abs().max(1e-3)).min(600.0),
            };
            let quiet_s = tick.now_ns.saturating_sub(self.sunk_ns) as f64 * 1e-9;
            let falls_on = self.crawl_state == Some(CrawlState::Descending) && self.beyond > 0;
            if quiet_s > OVER_S.max(cycle_s) && !falls_on {
                self.sliding = false;
                self.start_here(tick);
                self.since_ns = tick.now_ns;
                verdict = ReadingState::Good;
            }
        }
        Reading {
            value: excess_m,
            threshold: self.threshold_m,
            verdict,
            since_ns: self.since_ns,
            cell: None,
            severity: Severity::Critical,
        }
    }
}
