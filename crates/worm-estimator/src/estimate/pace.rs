//! When an estimate is made although no tracker sample came.
//!
//! Where the worm crawls only with positions, never: each estimate is that of a sample. Where it goes on without, the controller and the
//! watchers still need estimates, for they carry the alarms, the phase and the electrical energy. These come at the rate that samples
//! have or would have, as soon as samples are missing.

use crate::config::{Config, PositionSource};

/// Periods of the tracker without a sample that are not silence yet: one that is late or lost gets no estimate in its place.
const SILENCE_PERIODS: f64 = 2.5;

/// Decides by the times of the states.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pace {
    source: PositionSource,
    period_s: f64,
    /// Age from which positions are not those of the worm any more, s.
    stale_s: f64,
    /// When the next estimate is due if no sample comes; none before the first state.
    due_s: Option<f64>,
    /// When the last sample came, or the first state.
    seen_s: f64,
}

impl Pace {
    pub(super) fn new(config: &Config) -> Self {
        Self {
            source: config.position_source(),
            period_s: 1.0 / config.tracker.rate_hz,
            stale_s: config.control.tracker_timeout_s,
            due_s: None,
            seen_s: f64::NEG_INFINITY,
        }
    }

    /// Begins anew with the next state.
    pub(super) fn forget(&mut self) {
        (self.due_s, self.seen_s) = (None, f64::NEG_INFINITY);
    }

    /// A sample came.
    pub(super) fn note_sample(&mut self, time_s: f64) {
        self.seen_s = time_s;
        self.due_s = Some(time_s + SILENCE_PERIODS * self.period_s);
    }

    /// Whether an estimate is due at a state without a sample.
    pub(super) fn is_due(&mut self, time_s: f64) -> bool {
        let first_s = match self.source {
            PositionSource::Tracker => return false,
            PositionSource::TrackerWhileItLasts => time_s + SILENCE_PERIODS * self.period_s,
            PositionSource::Nothing => time_s,
        };
        let is_due = time_s >= *self.due_s.get_or_insert(first_s);
        if is_due {
            self.due_s = Some(time_s + self.period_s);
        }
        is_due
    }

    /// Whether the last positions are too old to be those of the worm, or there are none.
    pub(super) fn is_stale(&self, time_s: f64) -> bool {
        time_s - self.seen_s > self.stale_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Times of the estimates in the first second at 1 kHz, ms, with samples at 100 Hz until `last_sample_ms`.
    fn estimates_ms(toml: &str, last_sample_ms: u32) -> Vec<u32> {
        let toml = format!("{toml}\n[control]\non_stale_tracker = \"continue\"\n");
        let config = Config::from_toml(&toml, "test".as_ref()).expect("a valid configuration");
        let mut pace = Pace::new(&config);
        let mut found = Vec::new();
        for ms in 0..1000 {
            let time_s = f64::from(ms) * 1e-3;
            if ms <= last_sample_ms && ms % 10 == 0 {
                pace.note_sample(time_s);
            } else if pace.is_due(time_s) {
                found.push(ms);
            }
        }
        found
    }

    #[test]
    fn estimates_come_as_often_as_samples_would() {
        let without = estimates_ms("[tracker]\npresent = false\nrate_hz = 100.0", 0);
        // A due time that lies on a tick may round to the next one.
        assert!((89..=98).contains(&without.len()), "{without:?}");
        let dies = estimates_ms("[tracker]\nrate_hz = 100.0", 500);
        assert!(matches!(dies.first(), Some(525 | 526)), "{dies:?}");
        assert!((43..=48).contains(&dies.len()), "{dies:?}");
        assert!(estimates_ms("[tracker]\nrate_hz = 100.0", 999).is_empty());
    }
}
