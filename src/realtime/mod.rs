//! What a process asks of the operating system to be in time, what it really has, and how the computer is set for it.
//!
//! 1. [`request()`] asks for what the configuration names. Every request is answered with a [`Grant`] that says what was
//!    asked, and what to do about a refusal. A refusal never ends the process: the worm still runs, and its operator is told.
//! 2. [`EffectiveSettings`] is read back from the kernel, of this thread or of any process: what it has, whoever asked for it.
//! 3. [`CpuWitness`] goes and sees whether all CPUs run: a host can take each of them away by itself.
//! 4. [`machine`] looks at what no process can ask for: the kernel, the CPUs, and what else runs on them.
//!
//! [`monotonic_ns`] and [`sleep_until`] are the clock that all of it is for.

mod cpus;
mod effective;
pub mod machine;
mod request;
mod witness;

pub use effective::{EffectiveSettings, Policy};
pub use request::{Grant, Refusal, request};
pub use witness::{CpuWitness, visit_every_cpu};

use nix::time::ClockId;

/// Time of `CLOCK_MONOTONIC`, ns: the clock of all deadlines and time stamps.
pub fn monotonic_ns() -> u64 {
    clock_ns(ClockId::CLOCK_MONOTONIC)
}

/// CPU time that the calling thread has taken, ns.
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
    let deadline = libc::timespec {
        tv_sec: (deadline_ns / 1_000_000_000) as libc::time_t,
        tv_nsec: (deadline_ns % 1_000_000_000) as libc::c_long,
    };
    // SAFETY: the pointer is to a live timespec; with TIMER_ABSTIME the remaining time is not written.
    unsafe {
        libc::clock_nanosleep(
            libc::CLOCK_MONOTONIC,
            libc::TIMER_ABSTIME,
            &raw const deadline,
            std::ptr::null_mut(),
        );
    }
}
