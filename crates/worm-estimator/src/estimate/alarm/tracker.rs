//! Tracker fault: no samples, many lost, or a cell that is not seen.
//!
//! Over a sliding two seconds in which the controller asked (it does not while the computer pauses or a service takes its time): the fraction of samples that did not arrive (missed between two reads, or
//! never sent), and for each cell the fraction of arrived samples in which it was not seen; the largest of them is monitored. A cell is named
//! when all others are below half the threshold. No sample at all for the controller's tracker timeout raises the alarm at once, and so
//! does the controller's own fault "tracker stale".

use super::cam_motion::Tick;
use super::latch::{DetectorOutput, Reading, ReadingState};
use crate::config::Config;
use crate::message::{Fault, Severity, State};
use worm_physics::MAX_CELLS;

/// Length of the window, s.
const WINDOW_S: f64 = 2.0;
/// Parts of the window; the oldest part falls out as a whole.
const PARTS: usize = 20;
/// Fraction of the configured rate that counts as complete: a free-running tracker's clock differs, and parts are uneven.
const COMPLETE_FRACTION: f64 = 0.95;

/// Counts in one part of the window, or in all of them.
#[derive(Debug, Clone, Copy, Default)]
struct Counts {
    arrived: u64,
    looked_at: u64, // arrived samples whose validity was read
    unseen: [u32; MAX_CELLS],
}

#[derive(Debug, Clone)]
pub(super) struct TrackerFault {
    threshold: f64,
    timeout_s: f64,
    rate_hz: f64,
    cells: usize,
    parts: [Counts; PARTS],
    part: usize,
    unanswered_s: f64, // since the last motor reading
    part_ns: u64,      // length of the present part so far
    whole: Counts,     // sum of the parts
    filled_s: f64,
    silent_s: f64,
    last_sample: Option<u64>,
    since_ns: u64,
}

impl TrackerFault {
    pub(super) fn new(config: &Config) -> Self {
        Self {
            threshold: config.alarms.tracker_fault.threshold,
            timeout_s: config.control.tracker_timeout_s,
            rate_hz: config.tracker.rate_hz.min(config.control.rate_hz),
            cells: config.worm.cells.min(MAX_CELLS),
            parts: [Counts::default(); PARTS],
            part: 0,
            unanswered_s: 0.0,
            part_ns: 0,
            whole: Counts::default(),
            filled_s: 0.0,
            silent_s: 0.0,
            last_sample: None,
            since_ns: 0,
        }
    }

    pub(super) fn update(&mut self, tick: &Tick, state: &State) -> DetectorOutput {
        self.advance_window(tick);
        self.count(state);
        let silent = self.silent_s > self.timeout_s || state.fault == Fault::TrackerStale.code();
        let (fraction, cell) = self.worst();
        let verdict = if silent || fraction > self.threshold {
            ReadingState::Bad
        } else if fraction <= 0.5 * self.threshold {
            ReadingState::Good
        } else {
            ReadingState::Between
        };
        if verdict == ReadingState::Good {
            self.since_ns = tick.now_ns;
        }
        DetectorOutput::Measured(Reading {
            // A silent one gives nothing, whatever the window still holds.
            value: if silent { 1.0 } else { fraction },
            threshold: self.threshold,
            verdict,
            since_ns: self.since_ns,
            cell: cell.filter(|_| !silent),
            severity: if silent { Severity::Critical } else { Severity::Warning },
        })
    }

    fn advance_window(&mut self, tick: &Tick) {
        let part_ns = (WINDOW_S * 1e9) as u64 / PARTS as u64;
        let due_s = self.due_s(tick);
        self.part_ns += (due_s * 1e9) as u64;
        let passed = self.part_ns / part_ns;
        for _ in 0..passed.min(PARTS as u64) {
            self.part = (self.part + 1) % PARTS;
            let gone = std::mem::take(&mut self.parts[self.part]);
            self.whole.arrived -= gone.arrived;
            self.whole.looked_at -= gone.looked_at;
            for cell in 0..self.cells {
                self.whole.unseen[cell] -= gone.unseen[cell];
            }
        }
        self.part_ns -= passed * part_ns;
        self.filled_s += due_s;
        self.silent_s += tick.present_s;
    }

    /// Time in which samples were due, as far as this tick shows, s. While the servo does not answer it is not known whether its line
    /// is silent or a simulated device stands still; no sample is due from a device that stood still.
    fn due_s(&mut self, tick: &Tick) -> f64 {
        self.unanswered_s += tick.present_s;
        if !tick.phase_is_new {
            return 0.0;
        }
        std::mem::take(&mut self.unanswered_s).min(tick.motor_s)
    }

    fn count(&mut self, state: &State) {
        let before = self.last_sample.unwrap_or(state.sample);
        // No tracker sends more than this between two states; a larger jump is a counter that was reset.
        let arrived = state.sample.saturating_sub(before).min(10_000);
        self.last_sample = Some(state.sample);
        if arrived == 0 && state.sample_is_new == 0 {
            return;
        }
        let arrived = arrived.max(u64::from(state.sample_is_new != 0));
        self.silent_s = 0.0;
        let part = &mut self.parts[self.part];
        part.arrived += arrived;
        self.whole.arrived += arrived;
        if state.sample_is_new == 0 {
            return;
        }
        part.looked_at += 1;
        self.whole.looked_at += 1;
        for cell in 0..self.cells {
            if state.position_of(cell).is_none() {
                part.unseen[cell] += 1;
                self.whole.unseen[cell] += 1;
            }
        }
    }

    /// The largest fraction, and the cell if only one cell is affected.
    fn worst(&self) -> (f64, Option<usize>) {
        let window_s = self.filled_s.min(WINDOW_S);
        let due = COMPLETE_FRACTION * self.rate_hz * window_s;
        let full = self.rate_hz * WINDOW_S;
        // Fractions are of a full window, so that the first samples have no more weight than later ones.
        let absent = (due - self.whole.arrived as f64).max(0.0) / full;
        let mut worst = 0.0;
        let mut named = None;
        let mut affected = 0;
        for cell in 0..self.cells {
            let looked_at = (self.whole.looked_at as f64).max(0.5 * full);
            let fraction = f64::from(self.whole.unseen[cell]) / looked_at;
            affected += u32::from(fraction > 0.5 * self.threshold);
            if fraction > worst {
                worst = fraction;
                named = Some(cell);
            }
        }
        if absent > worst {
            (absent, None)
        } else {
            (worst, named.filter(|_| affected == 1))
        }
    }
}
