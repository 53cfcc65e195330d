//! Each message once, though frames repeat the newest, and histories what frames have said. Pure.

use crate::topics::Topic;
use std::collections::BTreeSet;
use worm_log::Logged;

/// Messages of a topic that are remembered: more than any history holds.
const REMEMBERED: usize = 4096;

/// The messages of one topic that were taken, by time and number.
#[derive(Debug, Default)]
pub(super) struct Once {
    /// What was made before belongs to no recording, ns.
    since_ns: u64,
    /// What is not later than this was taken, or is forgotten.
    forgotten: Option<(u64, u64)>,
    taken: BTreeSet<(u64, u64)>,
}

impl Once {
    /// Of messages that were made at this time, ns, or later.
    pub(super) fn since(since_ns: u64) -> Self {
        Self {
            since_ns,
            ..Self::default()
        }
    }

    /// Whether a message is taken for the first time. One without a time of its own is none.
    pub(super) fn takes<T: Topic + Logged>(&mut self, message: &T) -> bool {
        self.takes_key((message.made_ns(), message.number().unwrap_or(0)))
    }

    /// The same by time and number; for messages whose topic does not number them.
    pub(super) fn takes_key(&mut self, key: (u64, u64)) -> bool {
        let is_of_the_recording = key.0 != 0 && key.0 >= self.since_ns;
        if !is_of_the_recording || self.forgotten.is_some_and(|forgotten| key <= forgotten) {
            return false;
        }
        let is_new = self.taken.insert(key);
        if self.taken.len() > REMEMBERED {
            self.forgotten = self.taken.pop_first();
        }
        is_new
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_told_again_is_not_taken_again_and_memory_is_bounded() {
        let mut once = Once::since(10);
        assert!(!once.takes_key((9, 99)), "before the recording");
        assert!(!Once::since(0).takes_key((0, 0)), "without a time");
        // Two of one moment, and one that comes late.
        for (key, is_new) in [
            ((10, 0), true),
            ((10, 1), true),
            ((10, 1), false),
            ((30, 3), true),
            ((20, 2), true),
        ] {
            assert_eq!(once.takes_key(key), is_new, "{key:?}");
        }
        let many = 3 * REMEMBERED as u64;
        for number in 0..many {
            assert!(once.takes_key((100 + number, 0)));
        }
        assert_eq!(once.taken.len(), REMEMBERED);
        for told_again in [(10, 0), (20, 2), (100, 0), (99 + many, 0)] {
            assert!(!once.takes_key(told_again), "{told_again:?}");
        }
    }
}
