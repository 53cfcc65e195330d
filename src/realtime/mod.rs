//! What a process requests from the operating system to meet deadlines, what it really gets, and how the computer is set up for it.
//!
//! 1. [`request()`] makes the configured requests. Each returns a [`Grant`] with the request and, if it was refused, the remedy. A
//!    refusal never ends the process: the worm still runs, and its operator is warned.
//! 2. [`EffectiveSettings`] are read back from the kernel, for this thread or any process: what it has, whoever requested it.
//! 3. [`CpuWitness`] checks whether all CPUs run: the host of a virtual machine can take each of them away.
//! 4. [`machine`] checks what no process can request: the kernel, the CPUs, and what else runs on them.
//!
//! [`monotonic_ns`] and [`sleep_until`] are the clock of all deadlines.

mod cpus;
mod effective;
pub mod machine;
mod request;
mod suspended;
mod witness;

pub use effective::{EffectiveSettings, Policy};
pub(crate) use request::set_fifo;
pub use request::{Grant, Refusal, request};
pub(crate) use suspended::is_suspended;
pub use witness::{CpuWitness, visit_every_cpu};

use nix::sys::time::TimeSpec;
use nix::time::{ClockId, ClockNanosleepFlags, clock_nanosleep};

/// Time of `CLOCK_MONOTONIC`, ns: the clock of all deadlines and time stamps.
pub fn monotonic_ns() -> u64 {
    clock_ns(ClockId::CLOCK_MONOTONIC)
}

/// CPU time that the calling thread has used, ns.
pub fn thread_cpu_ns() -> u64 {
    clock_ns(ClockId::CLOCK_THREAD_CPUTIME_ID)
}

fn clock_ns(clock: ClockId) -> u64 {
    match nix::time::clock_gettime(clock) {
        Ok(now) => now.tv_sec() as u64 * 1_000_000_000 + now.tv_nsec() as u64,
        // These clocks exist on every Linux; the call has no other way to fail.
        Err(error) => unreachable!("{clock}: {error}"),
    }
}

/// Sleeps until `deadline_ns` of `CLOCK_MONOTONIC`; a signal ends the sleep early.
pub fn sleep_until(deadline_ns: u64) {
    let seconds = (deadline_ns / 1_000_000_000) as libc::time_t;
    let deadline = TimeSpec::new(seconds, (deadline_ns % 1_000_000_000) as libc::c_long);
    // The only failure of this clock with a valid time is a signal.
    let _interrupted = clock_nanosleep(ClockId::CLOCK_MONOTONIC, ClockNanosleepFlags::TIMER_ABSTIME, &deadline);
}
