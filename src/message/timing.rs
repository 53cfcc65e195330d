//! The `timing` topic: where each tick's time went.

use super::json::Name;
use super::{coded_enum, message};
use iceoryx2::prelude::ZeroCopySend;

coded_enum! {
    /// What made a tick end after its deadline.
    Culprit, "culprit" {
        /// The tick was in time.
        None = 0 => "none",
        /// The loop was woken late: scheduler, interrupts, or a machine stolen from under it.
        Wake = 1 => "wake",
        /// The bus exchange took too long.
        Bus = 2 => "bus",
        /// The tick's own computation took too long.
        Compute = 3 => "compute",
        /// Publishing took too long.
        Publish = 4 => "publish",
    }
}

message! {
    /// Where the time of one tick went, published every tick.
    Timing = "wormd_timing_v1", made: deadline_ns, cells: |_| 0, {
        /// The tick's number, as in [`super::State::sequence`].
        sequence: u64,
        /// The absolute deadline at which the loop asked to be woken, ns of `CLOCK_MONOTONIC`.
        deadline_ns: u64,
        /// How long after that deadline the loop really ran, ns.
        wake_lateness_ns: u64,
        /// From the first byte handed to the port to the last byte of the answer (or the end of the wait), ns.
        bus_ns: u64,
        /// The tick's own computation, ns.
        compute_ns: u64,
        /// Publishing of the *previous* tick's topics, ns (this tick's is not over when this is sent).
        publish_ns: u64,
        /// Ticks skipped since the controller started, because an earlier one ended after their deadline.
        overruns: u64,
        /// 1 when this tick ended after the next deadline.
        overrun: u32,
        /// [`Culprit`] as a code: what took the largest part of an overrunning tick.
        culprit: u32 as Name<Culprit>,
    }
}
