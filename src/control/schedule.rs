//! Absolute deadlines: when the next tick is due, and which deadlines a late tick has cost.

/// Even a tick that was woken late gives the bus this fraction of a period to answer.
const MIN_BUS_SHARE: f64 = 0.3;

/// How long the devices may take for their answer in a tick that was woken late by this much, ns; `wait_fraction` of the period in
/// a tick in time.
pub fn bus_allowed_ns(wait_fraction: f64, period_ns: u64, wake_lateness_ns: u64) -> u64 {
    let period = period_ns as f64;
    let min_ns = (MIN_BUS_SHARE * period) as u64;
    ((wait_fraction * period) as u64)
        .saturating_sub(wake_lateness_ns)
        .max(min_ns)
}

/// Deadlines on a fixed grid. A tick that ends after the next deadline costs the deadlines that it missed; they
/// are counted and never made up for, so ticks never bunch.
#[derive(Debug, Clone, Copy)]
pub struct Schedule {
    configured_ns: u64,
    period_ns: u64, // a multiple of it
    deadline_ns: u64,
    skipped: u64,
}

impl Schedule {
    /// A schedule whose first deadline is one period after `now_ns`.
    pub fn new(rate_hz: f64, now_ns: u64) -> Self {
        let period_ns = (1e9 / rate_hz).round() as u64;
        Self {
            configured_ns: period_ns,
            period_ns,
            deadline_ns: now_ns + period_ns,
            skipped: 0,
        }
    }

    /// Time between deadlines, ns.
    pub fn period_ns(&self) -> u64 {
        self.period_ns
    }

    /// The deadline at which the present tick is, or was, due.
    pub fn deadline_ns(&self) -> u64 {
        self.deadline_ns
    }

    /// Deadlines that passed without a tick since the start.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// From the next deadline on, time between deadlines is the configured one times `divider`.
    pub fn slow_down(&mut self, divider: u64) {
        self.period_ns = self.configured_ns * divider.max(1);
    }

    /// Ends a tick at `now_ns` and returns the number of deadlines that it cost. The next deadline is then the first one of
    /// the grid that has not passed.
    pub fn finish(&mut self, now_ns: u64) -> u64 {
        let late_ns = now_ns.saturating_sub(self.deadline_ns);
        // A tick that ends exactly on the next deadline is in time for it.
        let cost = late_ns.saturating_sub(1) / self.period_ns;
        self.skipped += cost;
        self.deadline_ns += (cost + 1) * self.period_ns;
        cost
    }

    /// Ends a tick that paused on purpose at `now_ns`: as [`finish`](Self::finish), but the deadlines that passed meanwhile
    /// count as no cost.
    pub fn finish_pause(&mut self, now_ns: u64) {
        self.skipped -= self.finish(now_ns);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn late_ticks_are_skipped_counted_and_never_bunched() {
        let mut schedule = Schedule::new(1000.0, 0);
        // (end of tick, its cost, next deadline), all in µs
        let table = [
            (1_100, 0, 2_000),
            (3_000, 0, 3_000),
            (4_001, 1, 5_000),
            (5_050, 0, 6_000),
            (16_500, 10, 17_000),
        ];
        for (end_us, cost, next_us) in table {
            assert_eq!(schedule.finish(end_us * 1000), cost, "tick ending at {end_us} µs");
            assert_eq!(
                schedule.deadline_ns(),
                next_us * 1000,
                "after the tick ending at {end_us} µs"
            );
        }
        assert_eq!(schedule.skipped(), 11);
        schedule.finish_pause(60_200_000);
        assert_eq!(
            (schedule.skipped(), schedule.deadline_ns()),
            (11, 61_000_000),
            "a pause costs nothing"
        );
        schedule.slow_down(4);
        assert_eq!((schedule.finish(61_100_000), schedule.deadline_ns()), (0, 65_000_000));
        schedule.slow_down(1);
        assert_eq!((schedule.finish(65_100_000), schedule.deadline_ns()), (0, 66_000_000));
    }
}
