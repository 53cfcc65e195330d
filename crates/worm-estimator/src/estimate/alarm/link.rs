//! Link fault: the servo does not answer, or answers badly.
//!
//! Failed exchanges over a sliding half second in which the computer did not pause, as a fraction of all exchanges in it. Counters are
//! compared, so states that the estimator did not receive are counted, too. A late answer is not a failure: it comes from a busy computer,
//! and `timing` shows that. The controller's own fault "link lost" raises the alarm at once.

use super::cam_motion::{MIN_RATE_FRACTION, Tick};
use super::latch::{DetectorOutput, Reading, ReadingState};
use crate::config::Config;
use crate::message::{Fault, Severity, State};

/// Length of the window, s.
const WINDOW_S: f64 = 0.5;
/// Parts of the window; the oldest part falls out as a whole.
const PARTS: usize = 10;

#[derive(Debug, Clone)]
pub(super) struct LinkFault {
    threshold: f64,
    exchanges_in_window: f64,
    parts: [(u64, u64); PARTS], // ticks and failures
    part: usize,
    part_s: f64,              // length of the present part so far
    filled_s: f64,            // since the first state, up to the window
    last: Option<(u64, u64)>, // sequence and failures of the last state
    since_ns: u64,
}

impl LinkFault {
    pub(super) fn new(config: &Config) -> Self {
        Self {
            threshold: config.alarms.link_fault.threshold,
            exchanges_in_window: (config.control.rate_hz * WINDOW_S).max(1.0),
            parts: [(0, 0); PARTS],
            part: 0,
            part_s: 0.0,
            filled_s: 0.0,
            last: None,
            since_ns: 0,
        }
    }

    pub(super) fn update(&mut self, tick: &Tick, state: &State) -> DetectorOutput {
        self.advance_window(tick.present_s);
        let (ticks, failures) = match self.last {
            Some((sequence, failures)) => (
                state.sequence.saturating_sub(sequence),
                state.link_failures.saturating_sub(failures),
            ),
            None => (1, 0),
        };
        self.last = Some((state.sequence, state.link_failures));
        let part = &mut self.parts[self.part];
        part.0 = part.0.saturating_add(ticks);
        part.1 = part.1.saturating_add(failures);
        let ticks: f64 = self.parts.iter().map(|part| part.0 as f64).sum();
        let failures: f64 = self.parts.iter().map(|part| part.1 as f64).sum();
        let min_ticks = if self.filled_s < WINDOW_S {
            1.0
        } else {
            MIN_RATE_FRACTION
        } * self.exchanges_in_window;
        let fraction = failures / ticks.max(min_ticks);
        if failures == 0.0 {
            self.since_ns = tick.now_ns;
        }
        let lost = state.fault == Fault::LinkLost.code();
        let verdict = if lost || fraction > self.threshold {
            ReadingState::Bad
        } else if fraction <= 0.5 * self.threshold {
            ReadingState::Good
        } else {
            ReadingState::Between
        };
        DetectorOutput::Measured(Reading {
            // One that is lost failed altogether, whatever the window still holds.
            value: if lost { 1.0 } else { fraction },
            threshold: self.threshold,
            verdict,
            since_ns: self.since_ns,
            cell: None,
            severity: if lost { Severity::Critical } else { Severity::Warning },
        })
    }

    fn advance_window(&mut self, present_s: f64) {
        let longest_part_s = WINDOW_S / PARTS as f64;
        self.filled_s = (self.filled_s + present_s).min(WINDOW_S);
        self.part_s += present_s;
        for _ in 0..PARTS {
            if self.part_s < longest_part_s {
                return;
            }
            self.part_s -= longest_part_s;
            self.part = (self.part + 1) % PARTS;
            self.parts[self.part] = (0, 0);
        }
        self.part_s = 0.0;
    }
}
