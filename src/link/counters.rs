//! What the link counts: the bus what passes along it, the exchange what becomes of its answers.

use super::BusCounters;
use core::fmt;

/// Counts of exchanges since the bus was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ExchangeCounters {
    /// Exchanges begun, one in each tick.
    pub exchanges: u64,
    /// Exchanges in which a late answer replaced one that did not come in time.
    pub late_answers: u64,
    /// Exchanges in which one device's data came and the other's did not.
    pub partial_answers: u64,
    /// Exchanges in which the servo reported another goal than the one that was sent.
    pub goals_not_taken: u64,
}

impl ExchangeCounters {
    /// Nothing so far.
    pub const NONE: Self = Self {
        exchanges: 0,
        late_answers: 0,
        partial_answers: 0,
        goals_not_taken: 0,
    };
}

/// All counts of a link. For the log it is one flat list.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct LinkCounters {
    /// Bytes, packets and errors.
    pub bus: BusCounters,
    /// Exchanges.
    pub exchange: ExchangeCounters,
}

impl fmt::Debug for LinkCounters {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { bus, exchange } = self;
        f.debug_struct("LinkCounters")
            .field("exchanges", &exchange.exchanges)
            .field("sent_bytes", &bus.sent_bytes)
            .field("received_bytes", &bus.received_bytes)
            .field("timeouts", &bus.timeouts)
            .field("crc_errors", &bus.crc_errors)
            .field("garbage_bytes", &bus.garbage_bytes)
            .field("stale_bytes", &bus.stale_bytes)
            .field("late_answers", &exchange.late_answers)
            .field("partial_answers", &exchange.partial_answers)
            .field("goals_not_taken", &exchange.goals_not_taken)
            .field("wrong_ids", &bus.wrong_ids)
            .field("malformed", &bus.malformed)
            .field("alerts", &bus.alerts)
            .field("disconnections", &bus.disconnections)
            .field("refusals", &bus.refusals)
            .finish()
    }
}
