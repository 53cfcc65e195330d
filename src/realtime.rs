//! What a process asks of the operating system to be in time, and what it was given.
//!
//! Every request is answered with a [`Grant`] that says what was asked, what is in force, and what to do about a refusal.
//! A refusal never ends the process: the worm still runs, and its operator is told.

use crate::config::Realtime;
use nix::sys::mman::{MlockAllFlags, mlockall};
use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit};
use std::fmt;
use std::io;

/// One request to the operating system and its outcome.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Grant {
    /// What was asked for, for a person: `SCHED_FIFO priority 80`.
    pub request: String,
    /// Why it was refused; absent: granted.
    pub refusal: Option<Refusal>,
}

/// Why a request was refused, and the remedy.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// The operating system's words.
    pub reason: String,
    /// What to do about it.
    pub remedy: &'static str,
}

impl Grant {
    fn new(request: String, outcome: Result<(), io::Error>, remedy: &'static str) -> Self {
        Self {
            request,
            refusal: outcome.err().map(|error| Refusal {
                reason: error.to_string(),
                remedy,
            }),
        }
    }
}

impl fmt::Display for Grant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.refusal {
            None => write!(f, "{}: granted", self.request),
            Some(Refusal { reason, remedy }) => write!(f, "{}: REFUSED ({reason}): {remedy}", self.request),
        }
    }
}

/// Asks for everything that `wanted` names, for the calling thread (memory: for the process), `priority_offset` below
/// the configured priority: processes beside the loop must not get in its way.
///
/// Call it after all set-up, so that the locked memory is the memory in use.
pub fn request(wanted: &Realtime, priority_offset: u8) -> Vec<Grant> {
    let mut grants = Vec::new();
    if wanted.lock_memory {
        grants.push(Grant::new(
            "locked memory".to_owned(),
            lock_memory(),
            "allow it with `ulimit -l unlimited`, LimitMEMLOCK=infinity in the service, or CAP_IPC_LOCK",
        ));
    }
    if wanted.priority > 0 {
        let priority = wanted.priority.saturating_sub(priority_offset).max(1);
        grants.push(Grant::new(
            format!("SCHED_FIFO priority {priority}"),
            set_fifo(priority),
            "allow it with `ulimit -r 99`, LimitRTPRIO=99 in the service, or CAP_SYS_NICE",
        ));
    }
    if let (Some(cpu), 0) = (wanted.cpu, priority_offset) {
        grants.push(Grant::new(
            format!("pinned to CPU {cpu}"),
            pin(cpu),
            "name a CPU that this computer has and this process may use in realtime.cpu",
        ));
    }
    grants.push(Grant::new(
        "timer slack 1 ns".to_owned(),
        nix::sys::prctl::set_timerslack(1).map_err(io::Error::from),
        "timers may fire 50 µs late without SCHED_FIFO",
    ));
    grants
}

fn lock_memory() -> io::Result<()> {
    // With a finite limit, locking all future memory would make a later allocation fail, and with it the worm.
    let (soft, _) = getrlimit(Resource::RLIMIT_MEMLOCK)?;
    let future = soft == RLIM_INFINITY || nix::unistd::geteuid().is_root();
    let flags = if future {
        MlockAllFlags::MCL_CURRENT | MlockAllFlags::MCL_FUTURE
    } else {
        MlockAllFlags::MCL_CURRENT
    };
    mlockall(flags).map_err(io::Error::from)
}

fn set_fifo(priority: u8) -> io::Result<()> {
    let parameters = libc::sched_param {
        sched_priority: i32::from(priority),
    };
    // SAFETY: the pointer is to a live sched_param; pid 0 is the calling thread.
    let result = unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameters) };
    if result == 0 {
        Ok(())
    } else {
        Err(io::Error::last_os_error())
    }
}

fn pin(cpu: usize) -> io::Result<()> {
    let mut set = nix::sched::CpuSet::new();
    set.set(cpu)?;
    nix::sched::sched_setaffinity(nix::unistd::Pid::from_raw(0), &set).map_err(io::Error::from)
}

/// Time of `CLOCK_MONOTONIC`, ns: the clock of all deadlines and time stamps.
pub fn monotonic_ns() -> u64 {
    match nix::time::clock_gettime(nix::time::ClockId::CLOCK_MONOTONIC) {
        Ok(now) => now.tv_sec() as u64 * 1_000_000_000 + now.tv_nsec() as u64,
        // The clock exists on every Linux; the call has no other way to fail.
        Err(error) => unreachable!("CLOCK_MONOTONIC: {error}"),
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
