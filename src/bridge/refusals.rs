//! Which refusals the worms' records get: of each certificate, worm and reason one a second, however often is asked.

use crate::relay::wire::NetworkRefusal;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// How long the same is not recorded again: a program that asks on and on must not fill the records.
const SAME: Duration = Duration::from_secs(1);

/// When each was recorded last. No more than certificates with a rule, worms and reasons.
#[derive(Debug, Default)]
pub(crate) struct Refusals(BTreeMap<(String, String, NetworkRefusal), Instant>);

impl Refusals {
    /// Whether a refusal is to be recorded at this time; if so, it counts as recorded.
    pub(crate) fn is_due(&mut self, certificate: &str, worm: &str, why: NetworkRefusal, now: Instant) -> bool {
        let key = (certificate.to_owned(), worm.to_owned(), why);
        let is_same = |since: &Instant| now.saturating_duration_since(*since) < SAME;
        if self.0.get(&key).is_some_and(is_same) {
            return false;
        }
        self.0.insert(key, now);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use NetworkRefusal::{NotPermitted, Stale};

    #[test]
    fn who_asks_on_and_on_is_recorded_once_a_second_and_not_at_the_cost_of_others() {
        let mut refusals = Refusals::default();
        let begun = Instant::now();
        for (ms, certificate, worm, why, is_due) in [
            (0, "hall", "w", NotPermitted, true),
            (999, "hall", "w", NotPermitted, false),
            (999, "hall", "w", Stale, true),
            (999, "hall", "v", NotPermitted, true),
            (999, "door", "w", NotPermitted, true),
            (1000, "hall", "w", NotPermitted, true),
            (1001, "hall", "w", NotPermitted, false),
        ] {
            let now = begun + Duration::from_millis(ms);
            let found = refusals.is_due(certificate, worm, why, now);
            assert_eq!(found, is_due, "{certificate} {worm} {why:?} at {ms} ms");
        }
    }
}
