//! The bare sleeper as a process of its own, like the loop that it is compared with.

use super::floor::{FloorOutcome, FloorPlan};
use crate::failure::Failure;
use crate::supervisor::child_process::{Child, Log, START_TIMEOUT};
use nix::sched::{CpuSet, sched_setaffinity};
use nix::unistd::Pid;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// The running process.
pub(super) struct FloorProcess {
    child: Child,
    /// The CPU that it was last moved to.
    cpu: Option<usize>,
}

impl FloorProcess {
    /// Starts it, and waits until it is ready.
    pub(super) fn start(config: &Path, plan: &FloorPlan, log: &Log, end: &AtomicBool) -> Result<Self, Failure> {
        let mut arguments = vec!["latency-floor".into(), "--config".into(), config.into()];
        for (name, ns) in [
            ("--loop-deadline-ns", plan.loop_deadline_ns),
            ("--from-ns", plan.from_ns),
            ("--until-ns", plan.until_ns),
        ] {
            arguments.extend([name.into(), ns.to_string().into()]);
        }
        let mut child = Child::start_unsupervised("bare sleeper", &arguments, log)?;
        child.wait_until_ready(START_TIMEOUT, log, end)?;
        Ok(Self { child, cpu: None })
    }

    /// Process id.
    pub(super) fn id(&self) -> u32 {
        self.child.id()
    }

    /// Moves it to the CPU that another process last ran on. How long a CPU takes to wake depends on what else runs there, and a
    /// loop that is not pinned might otherwise stay on another CPU than the sleeper for the whole run.
    pub(super) fn follow(&mut self, pid: u32) {
        let cpu = last_cpu(pid);
        if cpu == self.cpu {
            return;
        }
        let mut only = CpuSet::new();
        let moved = cpu.is_some_and(|cpu| {
            only.set(cpu).is_ok() && sched_setaffinity(Pid::from_raw(self.id() as i32), &only).is_ok()
        });
        if moved {
            self.cpu = cpu;
        }
    }

    /// Ends it, and returns what it has measured.
    pub(super) fn finish(mut self) -> Result<FloorOutcome, Failure> {
        self.child.end();
        let text = self.child.last_line().unwrap_or_default();
        serde_json::from_str(&text)
            .map_err(|error| Failure::failed(format!("the bare sleeper's process did not report a result ({error})")))
    }
}

/// The CPU that the main thread of a process last ran on: the 39th field of `/proc/PID/stat`, proc(5).
fn last_cpu(pid: u32) -> Option<usize> {
    let text = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The second field, the name in parentheses, may contain spaces.
    let (_, after_name) = text.rsplit_once(')')?;
    after_name.split_whitespace().nth(36)?.parse().ok()
}
