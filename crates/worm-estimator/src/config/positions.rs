//! Whether the worm has positions, and whether it may go on without.

use super::{Config, OnStaleTracker};

/// Where the positions of the cells come from, and what it means when they do not come. Whatever depends on positions is put together
/// by this.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PositionSource {
    /// The tracker, and the worm crawls only while it gives samples.
    Tracker,
    /// The tracker, while it gives samples; the worm goes on without them.
    TrackerWhileItLasts,
    /// None: the worm has no tracker.
    Nothing,
}

impl PositionSource {
    /// Whether the worm may crawl though no positions come.
    pub const fn may_be_missing(self) -> bool {
        !matches!(self, Self::Tracker)
    }
}

impl Config {
    /// Where this worm's positions come from.
    pub const fn position_source(&self) -> PositionSource {
        match (self.tracker.present, self.control.on_stale_tracker) {
            (false, _) => PositionSource::Nothing,
            (true, OnStaleTracker::Stop) => PositionSource::Tracker,
            (true, OnStaleTracker::Continue) => PositionSource::TrackerWhileItLasts,
        }
    }

    /// Samples per second of the tracker; none without one.
    pub fn tracker_rate_hz(&self) -> Option<f64> {
        self.tracker.present.then_some(self.tracker.rate_hz)
    }
}
