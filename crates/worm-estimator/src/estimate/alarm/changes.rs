//! The alarms that one update raised or cleared.

use crate::message::{Alarm, AlarmKind};
use std::ops::Deref;

/// After a restart of the controller an update first clears what was raised, so a kind can change twice in it.
const CAPACITY: usize = 2 * AlarmKind::ALL.len();

/// The alarms raised or cleared in one update, in order, as a slice and without allocation.
#[derive(Debug, Clone, Copy)]
pub struct AlarmChanges {
    alarms: [Alarm; CAPACITY],
    count: usize, // ≤ CAPACITY: a latch changes at most once per pass, and an update makes at most two passes
}

impl AlarmChanges {
    pub(in crate::estimate) const fn none() -> Self {
        Self {
            alarms: [Alarm::NONE; CAPACITY],
            count: 0,
        }
    }

    /// Appends one change and gives it its number.
    pub(super) fn push(&mut self, alarm: Alarm, next_sequence: &mut u64) {
        if let Some(slot) = self.alarms.get_mut(self.count) {
            *slot = Alarm {
                sequence: *next_sequence,
                ..alarm
            };
            self.count += 1;
            *next_sequence += 1;
        }
    }
}

impl Deref for AlarmChanges {
    type Target = [Alarm];

    fn deref(&self) -> &[Alarm] {
        &self.alarms[..self.count]
    }
}

impl<'a> IntoIterator for &'a AlarmChanges {
    type Item = &'a Alarm;
    type IntoIter = std::slice::Iter<'a, Alarm>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}
