//! The `timing` topic: where each tick's time went.

use super::ZeroCopySend;
use super::json::Name;
use super::{coded_enum, message};

coded_enum! {
    /// What made a tick end after its deadline.
    Culprit, "culprit" {
        /// The tick was in time.
        None = 0 => "none",
        /// The timer woke the loop late, at its deadline or at the end of its wait for the devices, though a CPU was free for
        /// it: interrupts that were off, a deep idle state, or a host that does not tell what it takes.
        Wake = 1 => "wake",
        /// The devices were late with their answer.
        Bus = 2 => "bus",
        /// The tick's own computation took too long.
        Compute = 3 => "compute",
        /// Publishing, or waking who listens, took too long.
        Publish = 4 => "publish",
        /// The loop could have run, and the scheduler gave the CPU to somebody else.
        Scheduler = 5 => "scheduler",
        /// The loop touched memory that was not there.
        PageFault = 6 => "page-fault",
        /// The host took the CPU away from this virtual machine.
        Stolen = 7 => "stolen",
    }
}

message! {
    /// Where the time of one tick went, published every tick.
    Timing = "wormd_timing_v3", made: deadline_ns, cells: |_| 0, {
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
        /// Waking whoever sleeps until the next state, ns; next to nothing where nobody does.
        notify_ns: u64,
        /// How long the loop could have run and had no CPU, ns. Asked for in late ticks only; zero in others.
        waited_ns: u64,
        /// How long the host took the CPUs away, ns, in steps of the kernel's clock tick. In late ticks only.
        stolen_ns: u64,
        /// Ticks skipped since the controller started, because an earlier one ended after their deadline.
        overruns: u64,
        /// Time between deadlines, ns: the configured one, or a multiple of it on a computer that cannot hold the configured rate.
        period_ns: u64,
        /// How long the computer did not run the loop before or in this tick though it had to, ns; 0 below 10 ms, which is
        /// lateness, not a pause.
        host_paused_ns: u64,
        /// Such pauses since the controller started, this one included.
        host_pauses: u64,
        /// 1 when this tick ended after the next deadline.
        overrun: u32,
        /// [`Culprit`] as a code: what made an overrunning tick late.
        culprit: u32 as Name<Culprit>,
        /// Page faults in it that memory could serve. In late ticks only.
        minor_faults: u32,
        /// Page faults in it that waited for a disk. In late ticks only.
        major_faults: u32,
    }
}
