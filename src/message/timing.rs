//! The `timing` topic: where each tick's time went.

use super::coded_enum;
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

/// Where the time of one tick went, published every tick.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend)]
#[type_name("wormd_timing_v1")]
#[repr(C)]
pub struct Timing {
    /// The tick's number, as in [`super::State::sequence`].
    pub sequence: u64,
    /// The absolute deadline at which the loop asked to be woken, ns of `CLOCK_MONOTONIC`.
    pub deadline_ns: u64,
    /// How long after that deadline the loop really ran, ns.
    pub wake_lateness_ns: u64,
    /// From the first byte handed to the port to the last byte of the answer (or the end of the wait), ns.
    pub bus_ns: u64,
    /// The tick's own computation, ns.
    pub compute_ns: u64,
    /// Publishing of the *previous* tick's topics, ns (this tick's is not over when this is sent).
    pub publish_ns: u64,
    /// Ticks skipped since the controller started, because an earlier one ended after their deadline.
    pub overruns: u64,
    /// 1 when this tick ended after the next deadline.
    pub overrun: u32,
    /// [`Culprit`] as a code: what took the largest part of an overrunning tick.
    pub culprit: u32,
}
