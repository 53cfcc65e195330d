//! What a process requests from the operating system, and the outcome of each request.

use super::{EffectiveSettings, cpus};
use nix::sys::mman::{MlockAllFlags, mlockall};
use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit};
use std::fmt;
use std::io;
use worm_estimator::config::Realtime;

/// One request to the operating system and its outcome.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Grant {
    /// The request in words: `SCHED_FIFO priority 80`.
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
    pub remedy: String,
}

impl Grant {
    fn new(request: String, outcome: io::Result<()>, remedy: &str) -> Self {
        Self {
            request,
            refusal: outcome.err().map(|error| Refusal {
                reason: error.to_string(),
                remedy: remedy.to_owned(),
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
    if let Some(priority) = fifo_priority(wanted, priority_offset) {
        grants.push(Grant::new(
            format!("SCHED_FIFO priority {priority}"),
            set_fifo(priority),
            "allow it with `ulimit -r 99`, LimitRTPRIO=99 in the service, or CAP_SYS_NICE",
        ));
    }
    if let Some(cpu) = pinned_cpu(wanted, priority_offset) {
        grants.push(Grant {
            request: format!("pinned to CPU {cpu}"),
            refusal: pin(cpu).err().map(|error| {
                let allowed = EffectiveSettings::of_this_thread().map(|effective| effective.cpus);
                pin_refusal(cpu, &cpus::online(), &allowed.unwrap_or_default(), &error)
            }),
        });
    }
    grants.push(Grant::new(
        "timer slack 1 ns".to_owned(),
        nix::sys::prctl::set_timerslack(1).map_err(io::Error::from),
        "timers may fire 50 µs late without SCHED_FIFO",
    ));
    grants
}

/// Priority that [`request`] asks for; absent: none.
pub(super) fn fifo_priority(wanted: &Realtime, priority_offset: u8) -> Option<u8> {
    (wanted.priority > 0).then(|| wanted.priority.saturating_sub(priority_offset).max(1))
}

/// CPU that [`request`] asks for; absent: none. Only the loop has one for itself.
pub(super) fn pinned_cpu(wanted: &Realtime, priority_offset: u8) -> Option<usize> {
    wanted.cpu.filter(|_| priority_offset == 0)
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

pub(crate) fn set_fifo(priority: u8) -> io::Result<()> {
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

/// Why `cpu` is refused on a computer with CPUs `online` to a process that may use those `allowed`; `words` are the
/// operating system's, which names no CPU.
fn pin_refusal(cpu: usize, online: &[usize], allowed: &[usize], words: &io::Error) -> Refusal {
    let usable = if allowed.is_empty() { online } else { allowed };
    let one_of = if usable.len() == 1 { "" } else { "one of " };
    let name = format!("name {one_of}{} in realtime.cpu", cpus::named(usable));
    if usable.is_empty() || usable.contains(&cpu) {
        Refusal {
            reason: words.to_string(),
            remedy: "name another CPU in realtime.cpu, or none".to_owned(),
        }
    } else if online.contains(&cpu) {
        Refusal {
            reason: format!("this process may use {} only", cpus::named(usable)),
            remedy: format!("{name}, or allow CPU {cpu} with AllowedCPUs= in the service and its slice"),
        }
    } else {
        Refusal {
            reason: format!("this computer has {}", cpus::named(online)),
            remedy: name,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refused_cpu_is_answered_with_those_that_may_be_used() {
        for (cpu, online, allowed, reason, remedy) in [
            (
                7,
                &[0, 1][..],
                &[0, 1][..],
                "this computer has CPUs 0-1",
                "name one of CPUs 0-1 in",
            ),
            (1, &[0], &[0], "this computer has CPU 0", "name CPU 0 in"),
            (
                3,
                &[0, 1, 2, 3],
                &[0, 1],
                "this process may use CPUs 0-1 only",
                "AllowedCPUs=",
            ),
            (1, &[0, 1], &[0, 1], "the kernel's words", "name another CPU"),
            (1, &[], &[], "the kernel's words", "name another CPU"),
        ] {
            let refusal = pin_refusal(cpu, online, allowed, &io::Error::other("the kernel's words"));
            assert_eq!(refusal.reason, reason);
            assert!(refusal.remedy.contains(remedy), "{}", refusal.remedy);
        }
    }
}
