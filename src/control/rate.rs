//! Adapts the rate to what the computer and its link sustain: a loop that keeps missing deadlines continues at a steady fraction of
//! its rate.
//!
//! An occasional missed deadline costs only its sample, and an occasional late answer is used one tick later. But a loop that misses
//! every third deadline runs in bursts; at half the rate it is steady again. So a fraction beyond [`MAX_MISSED`] of deadlines that
//! were missed, or whose answer was late, within [`WINDOW_TICKS`] doubles the period. Pauses of the computer do not count: a slower
//! loop would not help. After a time with almost no misses the next faster rate is tried; each failed trial doubles that time.

/// Ticks and missed deadlines in one window.
const WINDOW_TICKS: u64 = 5_000;
/// Fraction of deadlines that may be missed.
const MAX_MISSED: f64 = 0.2;
/// Fraction that counts as almost none.
const NEARLY_NONE: f64 = 0.02;
/// Consecutive windows with almost no misses before a faster rate is tried.
const FIRST_WAIT: u32 = 8;
/// Longest such wait, windows.
const MAX_WAIT: u32 = 512;
/// Slowest rate, as a divider of the configured one.
const LARGEST_DIVIDER: u64 = 8;

/// The divider of the configured rate.
#[derive(Debug, Clone)]
pub(super) struct RateKeeper {
    divider: u64,
    largest: u64,
    deadlines: u64, // in the open window
    missed: u64,
    quiet_windows: u32,
    timeout: u32,
    is_trial: bool, // this rate is being tried after a slower one
}

impl RateKeeper {
    /// Starts at `rate_hz`, and never falls below `min_hz`; stays at `rate_hz` if `adapts` is false.
    pub(super) fn new(rate_hz: f64, min_hz: f64, adapts: bool) -> Self {
        let mut largest = 1;
        while adapts && largest < LARGEST_DIVIDER && rate_hz / (2 * largest) as f64 >= min_hz {
            largest *= 2;
        }
        Self {
            divider: 1,
            largest,
            deadlines: 0,
            missed: 0,
            quiet_windows: 0,
            timeout: FIRST_WAIT,
            is_trial: false,
        }
    }

    /// Takes a tick that cost `skipped` further deadlines, and whether its answer came late. Returns the divider when it changes.
    pub(super) fn take(&mut self, skipped: u64, is_late: bool) -> Option<u64> {
        self.deadlines += 1 + skipped;
        self.missed += skipped + u64::from(is_late);
        if self.deadlines * self.divider < WINDOW_TICKS {
            return None;
        }
        let fraction = self.missed as f64 / self.deadlines as f64;
        (self.deadlines, self.missed) = (0, 0);
        if fraction > MAX_MISSED {
            self.quiet_windows = 0;
            if std::mem::take(&mut self.is_trial) {
                self.timeout = (2 * self.timeout).min(MAX_WAIT);
            }
            return self.change(2 * self.divider);
        }
        self.quiet_windows = if fraction < NEARLY_NONE {
            self.quiet_windows + 1
        } else {
            0
        };
        if self.divider == 1 || self.quiet_windows < self.timeout {
            return None;
        }
        self.quiet_windows = 0;
        self.is_trial = true;
        self.change(self.divider / 2)
    }

    fn change(&mut self, divider: u64) -> Option<u64> {
        let divider = divider.clamp(1, self.largest);
        (std::mem::replace(&mut self.divider, divider) != divider).then_some(divider)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs so many windows, or up to the first change, in which every n-th tick costs a deadline (0: none).
    fn run(keeper: &mut RateKeeper, windows: u32, every: u64) -> Option<u64> {
        let mut tick = 0;
        let mut closed = 0;
        while closed < windows {
            tick += 1;
            let change = keeper.take(u64::from(every != 0 && tick % every == 0), false);
            if change.is_some() {
                return change;
            }
            closed += u32::from(keeper.deadlines == 0);
        }
        None
    }

    #[test]
    fn a_rate_that_is_not_held_is_halved_until_it_is() {
        let mut keeper = RateKeeper::new(1000.0, 240.0, true);
        assert_eq!(run(&mut keeper, 10, 10), None, "one in ten is not too many");
        assert_eq!(run(&mut keeper, 1, 2), Some(2), "every third deadline");
        assert_eq!(run(&mut keeper, 1, 2), Some(4));
        assert_eq!(run(&mut keeper, 3, 2), None, "no slower than 240 Hz");
    }

    #[test]
    fn a_faster_rate_is_tried_again_and_each_time_later() {
        let mut keeper = RateKeeper::new(1000.0, 240.0, true);
        assert_eq!(run(&mut keeper, 1, 2), Some(2));
        for timeout in [8, 16, 32] {
            assert_eq!(run(&mut keeper, timeout - 1, 0), None);
            assert_eq!(run(&mut keeper, 1, 0), Some(1));
            assert_eq!(run(&mut keeper, 1, 2), Some(2));
        }
    }

    #[test]
    fn late_answers_count_and_a_fixed_rate_stays() {
        let mut keeper = RateKeeper::new(1000.0, 10.0, true);
        let changes = (0..WINDOW_TICKS).filter_map(|tick| keeper.take(0, tick % 3 == 0));
        assert_eq!(changes.collect::<Vec<_>>(), [2]);
        let mut fixed = RateKeeper::new(1000.0, 10.0, false);
        assert_eq!(run(&mut fixed, 4, 1), None);
    }
}
