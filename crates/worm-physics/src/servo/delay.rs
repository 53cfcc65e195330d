//! A value as it was some time ago.

use std::collections::VecDeque;

/// Values of the last steps with their ages at the newest, s.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DelayLine {
    seen: VecDeque<(f64, f64)>,
}

impl DelayLine {
    /// Takes the value of now, `dt_s` after the one before, and gives that of `delay_s` ago; the oldest there is where there is none that old.
    pub fn pass(&mut self, now: f64, delay_s: f64, dt_s: f64) -> f64 {
        if delay_s <= 0.0 {
            return now;
        }
        for (_, age_s) in &mut self.seen {
            *age_s += dt_s;
        }
        self.seen.push_back((now, 0.0));
        // All but one that is old enough may go; between that and the next the value is a straight line.
        while self.seen.len() > 1 && self.seen[1].1 >= delay_s {
            self.seen.pop_front();
        }
        let (older, older_s) = self.seen[0];
        match self.seen.get(1) {
            Some(&(newer, newer_s)) if older_s > delay_s => {
                older + (newer - older) * (older_s - delay_s) / (older_s - newer_s)
            }
            _ => older,
        }
    }
}
