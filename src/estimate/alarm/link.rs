//! Link fault: the servo does not answer, or answers badly.
//!
//! Failed exchanges over a sliding half second, as a share of the exchanges that fit into it. Counters are compared, so
//! states that the estimator did not receive are counted all the same. The controller's own verdict, link lost,
//! raises the alarm at once.

use super::latch::{Finding, Reading, Verdict};
use super::motion::Moment;
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
    part_began_ns: u64,
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
            part_began_ns: 0,
            last: None,
            since_ns: 0,
        }
    }

    pub(super) fn update(&mut self, moment: &Moment, state: &State) -> Finding {
        let part_ns = (WINDOW_S * 1e9) as u64 / PARTS as u64;
        let passed = moment.now_ns.saturating_sub(self.part_began_ns) / part_ns;
        for _ in 0..passed.min(PARTS as u64) {
            self.part = (self.part + 1) % PARTS;
            self.parts[self.part] = (0, 0);
        }
        self.part_began_ns += passed * part_ns;
        let failed_now = u64::from(state.motor_is_new == 0);
        let (ticks, failures) = match self.last {
            Some((sequence, failures)) => (
                state.sequence.saturating_sub(sequence),
                state.link_failures.saturating_sub(failures).max(failed_now),
            ),
            None => (1, failed_now),
        };
        self.last = Some((state.sequence, state.link_failures));
        let part = &mut self.parts[self.part];
        part.0 = part.0.saturating_add(ticks);
        part.1 = part.1.saturating_add(failures.min(ticks));
        let ticks: f64 = self.parts.iter().map(|part| part.0 as f64).sum();
        let failures: f64 = self.parts.iter().map(|part| part.1 as f64).sum();
        let share = failures / ticks.max(self.exchanges_in_window);
        if failures == 0.0 {
            self.since_ns = moment.now_ns;
        }
        let lost = state.fault == Fault::LinkLost.code();
        let verdict = if lost || share > self.threshold {
            Verdict::Bad
        } else if share <= 0.5 * self.threshold {
            Verdict::Good
        } else {
            Verdict::Between
        };
        Finding::Seen(Reading {
            value: share,
            threshold: self.threshold,
            verdict,
            since_ns: self.since_ns,
            cell: None,
            severity: if lost { Severity::Critical } else { Severity::Warning },
        })
    }
}
