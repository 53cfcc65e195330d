//! What a process really has, read back from the kernel rather than taken from its requests.

use super::cpus;
use nix::sched::CpuSet;
use nix::unistd::Pid;
use serde::Serialize;
use std::fmt;
use std::io;
use worm_estimator::config::Realtime;

/// How the kernel chooses when a thread runs (man page sched(7)).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Policy {
    /// The ordinary scheduler.
    #[serde(rename = "SCHED_OTHER")]
    Other,
    /// Real time: runs before all ordinary threads until it sleeps.
    #[serde(rename = "SCHED_FIFO")]
    Fifo,
    /// Real time, with time slices among equal priorities.
    #[serde(rename = "SCHED_RR")]
    RoundRobin,
    /// The ordinary scheduler, for work that never hurries.
    #[serde(rename = "SCHED_BATCH")]
    Batch,
    /// Runs when nothing else would.
    #[serde(rename = "SCHED_IDLE")]
    Idle,
    /// Real time, with a budget for each period.
    #[serde(rename = "SCHED_DEADLINE")]
    Deadline,
    /// One that this program does not know.
    #[serde(rename = "unknown")]
    Unknown,
}

impl Policy {
    fn of(number: libc::c_int) -> Self {
        match number {
            libc::SCHED_OTHER => Self::Other,
            libc::SCHED_FIFO => Self::Fifo,
            libc::SCHED_RR => Self::RoundRobin,
            libc::SCHED_BATCH => Self::Batch,
            libc::SCHED_IDLE => Self::Idle,
            libc::SCHED_DEADLINE => Self::Deadline,
            _ => Self::Unknown,
        }
    }

    /// The kernel's name of it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Other => "SCHED_OTHER",
            Self::Fifo => "SCHED_FIFO",
            Self::RoundRobin => "SCHED_RR",
            Self::Batch => "SCHED_BATCH",
            Self::Idle => "SCHED_IDLE",
            Self::Deadline => "SCHED_DEADLINE",
            Self::Unknown => "unknown scheduler",
        }
    }
}

/// The effective scheduling of one thread and memory of its process.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectiveSettings {
    /// Scheduling policy, by sched_getscheduler(2).
    pub policy: Policy,
    /// Priority under SCHED_FIFO and SCHED_RR, 1 to 99; 0 under the others. By sched_getparam(2).
    pub priority: u8,
    /// CPUs that it may run on, ascending, by sched_getaffinity(2).
    pub cpus: Vec<usize>,
    /// Whether those are all CPUs that are on line.
    pub all_cpus: bool,
    /// Whether all that is resident is locked: `locked_bytes` counts what is reserved, so it exceeds what is resident.
    pub memory_locked: bool,
    /// Memory that cannot be swapped out, bytes: VmLck of /proc/PID/status (man page proc_pid_status(5)).
    pub locked_bytes: u64,
    /// Memory in use, bytes: VmRSS of the same.
    pub resident_bytes: u64,
    /// How late the kernel may fire a timer to save a wake, ns: /proc/PID/timerslack_ns. Real-time policies have none, and
    /// newer kernels then report 0. Absent: reading that of another process needs CAP_SYS_NICE.
    pub timer_slack_ns: Option<u64>,
}

impl EffectiveSettings {
    /// Of the main thread of a process; of another thread, given its thread id.
    ///
    /// # Errors
    /// When there is no such process, or it may not be inspected.
    pub fn of_process(pid: u32) -> io::Result<Self> {
        let id = libc::pid_t::try_from(pid).map_err(|error| io::Error::new(io::ErrorKind::InvalidInput, error))?;
        let (policy, priority) = scheduler(id)?;
        let affinity = nix::sched::sched_getaffinity(Pid::from_raw(id))?;
        let cpus: Vec<usize> = (0..CpuSet::count())
            .filter(|&cpu| affinity.is_set(cpu) == Ok(true))
            .collect();
        let status = std::fs::read_to_string(format!("/proc/{pid}/status"))?;
        let locked_bytes = memory_bytes(&status, "VmLck:");
        let resident_bytes = memory_bytes(&status, "VmRSS:");
        let slack = std::fs::read_to_string(format!("/proc/{pid}/timerslack_ns"));
        Ok(Self {
            policy,
            priority,
            all_cpus: cpus::online().iter().all(|cpu| cpus.contains(cpu)),
            cpus,
            memory_locked: locked_bytes > 0 && locked_bytes >= resident_bytes,
            locked_bytes,
            resident_bytes,
            timer_slack_ns: slack.ok().and_then(|text| text.trim().parse().ok()),
        })
    }

    /// Of the calling thread.
    ///
    /// # Errors
    /// When /proc cannot be read.
    pub fn of_this_thread() -> io::Result<Self> {
        Self::of_process(nix::unistd::gettid().as_raw().unsigned_abs())
    }

    /// Policy and priority, such as `SCHED_FIFO 80` and `SCHED_OTHER`.
    pub fn scheduler_text(&self) -> String {
        match self.priority {
            0 => self.policy.name().to_owned(),
            priority => format!("{} {priority}", self.policy.name()),
        }
    }

    /// What is less than [`request`](super::request()) asks for with the same arguments, each in words.
    pub fn shortfalls(&self, wanted: &Realtime, priority_offset: u8) -> Vec<String> {
        let mut shortfalls = Vec::new();
        if let Some(priority) = super::request::fifo_priority(wanted, priority_offset)
            && (self.policy, self.priority) != (Policy::Fifo, priority)
        {
            shortfalls.push(format!("{} in place of SCHED_FIFO {priority}", self.scheduler_text()));
        }
        if let Some(cpu) = super::request::pinned_cpu(wanted, priority_offset)
            && self.cpus != [cpu]
        {
            shortfalls.push(format!("{} in place of CPU {cpu} alone", cpus::named(&self.cpus)));
        }
        if wanted.lock_memory && !self.memory_locked {
            shortfalls.push(format!("memory: {}", self.memory_text()));
        }
        shortfalls
    }

    fn memory_text(&self) -> String {
        let [locked_mb, resident_mb] = [self.locked_bytes, self.resident_bytes].map(|bytes| bytes as f64 / 1e6);
        if self.memory_locked {
            format!("all {resident_mb:.1} MB locked")
        } else {
            format!("only {locked_mb:.1} of {resident_mb:.1} MB locked")
        }
    }
}

impl fmt::Display for EffectiveSettings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all = if self.all_cpus { " (all)" } else { "" };
        write!(
            f,
            "{}, on {}{all}, memory: {}",
            self.scheduler_text(),
            cpus::named(&self.cpus),
            self.memory_text()
        )?;
        match self.timer_slack_ns {
            Some(slack_ns) => write!(f, ", timer slack {slack_ns} ns"),
            None => Ok(()),
        }
    }
}

fn scheduler(id: libc::pid_t) -> io::Result<(Policy, u8)> {
    // SAFETY: the call takes a number and returns one.
    let policy = unsafe { libc::sched_getscheduler(id) };
    if policy < 0 {
        return Err(io::Error::last_os_error());
    }
    let mut parameters = libc::sched_param { sched_priority: 0 };
    // SAFETY: the pointer is to a live sched_param.
    if unsafe { libc::sched_getparam(id, &raw mut parameters) } != 0 {
        return Err(io::Error::last_os_error());
    }
    // The flag says that children fall back to the ordinary scheduler, and is no part of the policy.
    let policy = Policy::of(policy & !libc::SCHED_RESET_ON_FORK);
    Ok((policy, u8::try_from(parameters.sched_priority).unwrap_or(0)))
}

/// A line of /proc/PID/status in bytes; 0 where it has none, as for threads of the kernel.
fn memory_bytes(status: &str, key: &str) -> u64 {
    let line = status.lines().find_map(|line| line.strip_prefix(key));
    let kib = line.and_then(|value| value.trim().strip_suffix(" kB")?.parse::<u64>().ok());
    kib.unwrap_or(0) * 1024
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_back() -> EffectiveSettings {
        EffectiveSettings::of_this_thread().expect("/proc shows this thread")
    }

    /// A thread of its own, since requests stay in effect until its end.
    #[test]
    fn what_a_thread_asked_for_is_read_back() {
        let thread = std::thread::spawn(|| {
            let before = read_back();
            let last = *before.cpus.last().expect("it runs somewhere");
            let mut one = CpuSet::new();
            one.set(last).expect("a CPU of the set");
            nix::sched::sched_setaffinity(Pid::from_raw(0), &one).expect("fewer CPUs are always granted");
            nix::sys::prctl::set_timerslack(12_345).expect("a slack is always granted");
            (last, read_back())
        });
        let (last, after) = thread.join().expect("the thread ends well");
        assert_eq!(after.cpus, [last]);
        assert_eq!(after.all_cpus, cpus::online() == [last]);
        if after.policy == Policy::Other {
            assert_eq!(after.timer_slack_ns, Some(12_345));
            assert_eq!(after.scheduler_text(), "SCHED_OTHER");
        }
        assert!(after.resident_bytes > 0);
    }

    #[test]
    fn a_process_that_is_gone_is_an_error() {
        // Beyond the largest process id that Linux has.
        assert!(EffectiveSettings::of_process(1 << 23).is_err());
        assert!(EffectiveSettings::of_process(u32::MAX).is_err());
    }

    #[test]
    fn memory_is_found_among_the_lines_of_the_status() {
        let status = "Name:\twormd\nVmPeak:\t  90000 kB\nVmLck:\t   81240 kB\nVmRSS:\t    9000 kB\nThreads:\t3\n";
        assert_eq!(memory_bytes(status, "VmLck:"), 81_240 * 1024);
        assert_eq!(memory_bytes(status, "VmRSS:"), 9_000 * 1024);
        assert_eq!(memory_bytes("Name:\tkthreadd\n", "VmLck:"), 0);
    }

    #[test]
    fn what_falls_short_of_the_wish_is_told() {
        let wanted = Realtime {
            priority: 80,
            cpu: Some(3),
            lock_memory: true,
        };
        let given = EffectiveSettings {
            policy: Policy::Fifo,
            priority: 80,
            cpus: vec![3],
            all_cpus: false,
            memory_locked: true,
            locked_bytes: 80_000_000,
            resident_bytes: 9_000_000,
            timer_slack_ns: Some(0),
        };
        assert_eq!(given.shortfalls(&wanted, 0), Vec::<String>::new());
        assert_eq!(
            given.to_string(),
            "SCHED_FIFO 80, on CPU 3, memory: all 9.0 MB locked, timer slack 0 ns"
        );
        // Beside the loop nothing is pinned, and the priority is lower.
        assert_eq!(
            given.shortfalls(&wanted, 10),
            ["SCHED_FIFO 80 in place of SCHED_FIFO 70"]
        );
        let refused = EffectiveSettings {
            policy: Policy::Other,
            priority: 0,
            cpus: vec![0, 1, 2, 3],
            all_cpus: true,
            memory_locked: false,
            locked_bytes: 0,
            timer_slack_ns: None,
            ..given
        };
        assert_eq!(
            refused.shortfalls(&wanted, 0),
            [
                "SCHED_OTHER in place of SCHED_FIFO 80",
                "CPUs 0-3 in place of CPU 3 alone",
                "memory: only 0.0 of 9.0 MB locked"
            ]
        );
        assert_eq!(
            refused.to_string(),
            "SCHED_OTHER, on CPUs 0-3 (all), memory: only 0.0 of 9.0 MB locked"
        );
    }
}
