//! How often something that recurs is logged: at once when it first happens, then summed once a minute, and at the end.

/// Time over which what recurs is summed, ns.
const PERIOD_NS: u64 = 60_000_000_000;

/// Sums something that recurs, so that it does not push everything else out of the log.
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

    /// What is to be logged at `now_ns`, if anything: everything since it was logged last.
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
        assert_eq!(summed.take_due(151_000_000_000, true), None, "nothing is told twice");
    }
}
