//! The newest values of a stream that may go on for weeks.

use std::collections::VecDeque;

/// The newest values, up to a fixed number. It knows how many older ones it has dropped.
#[derive(Debug, Clone)]
pub struct Recent<T> {
    values: VecDeque<T>,
    limit: usize,
    dropped: u64,
}

impl<T> Recent<T> {
    /// An empty list that keeps `limit` values.
    pub const fn with_limit(limit: usize) -> Self {
        Self {
            values: VecDeque::new(),
            limit,
            dropped: 0,
        }
    }

    /// Appends a value, and drops the oldest where there are too many.
    pub fn push(&mut self, value: T) {
        if self.values.len() >= self.limit {
            self.values.pop_front();
            self.dropped += 1;
        }
        self.values.push_back(value);
    }

    /// Forgets everything.
    pub(crate) fn clear(&mut self) {
        self.values.clear();
        self.dropped = 0;
    }

    /// The values that are kept, the oldest first.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = &T> + ExactSizeIterator {
        self.values.iter()
    }

    /// The newest value.
    pub fn last(&self) -> Option<&T> {
        self.values.back()
    }

    /// Older values that are not kept any more.
    pub const fn dropped(&self) -> u64 {
        self.dropped
    }

    /// All values that were ever appended.
    pub fn total(&self) -> u64 {
        self.dropped + self.values.len() as u64
    }

    /// What was appended since there were `seen` values in all, as far as it is kept.
    pub fn since(&self, seen: u64) -> impl Iterator<Item = &T> {
        let skipped = seen.saturating_sub(self.dropped);
        self.values.iter().skip(usize::try_from(skipped).unwrap_or(usize::MAX))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_are_kept_and_a_reader_sees_each_once() {
        let mut recent = Recent::with_limit(3);
        let mut seen = 0;
        let mut read = Vec::new();
        for value in 0..10 {
            recent.push(value);
            if value % 2 == 1 || value > 7 {
                read.extend(recent.since(seen).copied());
                seen = recent.total();
            }
        }
        assert!(read.into_iter().eq(0..10));
        assert!(recent.iter().copied().eq(7..10));
        assert_eq!((recent.last(), recent.dropped(), recent.total()), (Some(&9), 7, 10));
        assert!(recent.since(2).copied().eq(7..10), "what was dropped is gone");
    }
}
