//! How long the worm may go on crawling: as long as somebody holds the lease, or for a time.
//!
//! A worm must not crawl on for ever after whoever made it crawl has gone. A crawl that is commanded while the supervisor's lease
//! is held ends with the lease. One that is commanded without it, by a script for example, ends after a time, which a renewal or a
//! further crawl command sets anew. Where a lease has lapsed the command must give that time itself. Times are of the loop's own clock.

use super::interface::Lease;
use super::loop_clock::seconds_to_ns;
use worm_estimator::message::{CommandOutcome, HoldReason};

/// What ends a crawl, apart from commands, alarms and faults.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct CrawlLimit {
    needs_lease: bool,
    until_ns: Option<u64>,
}

impl CrawlLimit {
    /// Before the first crawl.
    pub(super) const NONE: Self = Self {
        needs_lease: false,
        until_ns: None,
    };

    /// The limit of a crawl that is commanded now for `limit_s`, s; 0 is "as long as the lease lasts", or `usual_s` where there never was
    /// one.
    ///
    /// # Errors
    /// [`CommandOutcome::BadSpeed`] for a limit that is no time, [`CommandOutcome::NoLease`] for none where the lease has lapsed: the
    /// command may be the last one of a supervisor that is dead by now.
    pub(super) fn of_command(limit_s: f64, usual_s: f64, lease: Lease, now_ns: u64) -> Result<Self, CommandOutcome> {
        if !limit_s.is_finite() || limit_s < 0.0 {
            return Err(CommandOutcome::BadSpeed);
        }
        let limit_s = match (limit_s, lease) {
            (0.0, Lease::Held) => None,
            (0.0, Lease::None) => Some(usual_s),
            (0.0, Lease::Lapsed) => return Err(CommandOutcome::NoLease),
            _ => Some(limit_s),
        };
        Ok(Self {
            needs_lease: lease == Lease::Held,
            until_ns: limit_s.map(|limit_s| now_ns.saturating_add(seconds_to_ns(limit_s))),
        })
    }

    /// A lease that is held while the worm crawls is one that the crawl leans on, whenever it came.
    pub(super) fn lean_on(&mut self, lease: Lease) {
        self.needs_lease |= lease == Lease::Held;
    }

    /// Why the crawl has to end now, if it has to.
    pub(super) fn reached(&self, now_ns: u64, lease: Lease) -> Option<HoldReason> {
        if self.needs_lease && lease != Lease::Held {
            Some(HoldReason::LeaseLapsed)
        } else {
            let is_over = self.until_ns.is_some_and(|until_ns| now_ns >= until_ns);
            is_over.then_some(HoldReason::TimeLimit)
        }
    }
}
