//! Rate-limited logging of recurring events: the first at once, then a sum once a minute, and one at the end.

/// Time over which occurrences are summed, ns.
const PERIOD_NS: u64 = 60_000_000_000;

/// Sums the occurrences of an event, so that they do not flood the log.
#[derive(Debug, Clone, Default)]
pub struct Summed<T> {
    sum: Option<T>,
    logged_ns: Option<u64>,
}

impl<T: Default> Summed<T> {
    /// Adds one occurrence.
    pub fn add(&mut self, add: impl FnOnce(&mut T)) {
        add(self.sum.get_or_insert_default());
    }

    /// The sum since the last log entry, if an entry is due at `now_ns`.
    pub fn take_due(&mut self, now_ns: u64, is_over: bool) -> Option<T> {
        let is_due = self
            .logged_ns
            .is_none_or(|logged_ns| is_over || now_ns.saturating_sub(logged_ns) >= PERIOD_NS);
        let due = self.sum.take_if(|_| is_due)?;
        self.logged_ns = Some(now_ns);
        Some(due)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_at_once_then_every_minute_then_at_the_end() {
        let mut summed = Summed::<u32>::default();
        let mut logged = Vec::new();
        for second in 0..=150_u64 {
            if second >= 10 {
                summed.add(|count| *count += 1);
            }
            let due = summed.take_due(second * 1_000_000_000, second == 150);
            logged.extend(due.map(|count| (second, count)));
        }
        assert_eq!(logged, [(10, 1), (70, 60), (130, 60), (150, 20)]);
        assert_eq!(summed.take_due(151_000_000_000, true), None, "nothing is logged twice");
    }
}
