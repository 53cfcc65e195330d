//! The bare sleeper as a process: a subcommand that is for `wormd latency` alone, and not shown in the help.

use crate::command::child_process::{Child, Log, START_PATIENCE};
use crate::command::{Failure, end_on_signal, print};
use crate::latency::floor::{self, FloorOutcome, FloorPlan};
use crate::latency::ipc_baseline::Bare;
use crate::topics::Instance;
use clap::Args;
use nix::sched::{CpuSet, sched_setaffinity};
use nix::unistd::Pid;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use worm_estimator::config::Config;

/// Arguments of the hidden subcommand `wormd latency-floor`.
#[derive(Debug, Args)]
pub struct FloorArgs {
    #[arg(long)]
    config: PathBuf,
    #[arg(long)]
    loop_deadline_ns: u64,
    #[arg(long)]
    from_ns: u64,
    #[arg(long)]
    until_ns: u64,
}

/// Runs the bare sleeper until a signal ends it: a line when it is ready, and one with what it has measured, as JSON.
///
/// # Errors
/// [`Failure::Failed`] when iceoryx2 refuses, or nobody reads the result.
pub fn run(args: &FloorArgs) -> Result<(), Failure> {
    let config = Config::load(&args.config)?;
    let end = end_on_signal()?;
    let instance = Instance::of(&config).map_err(Failure::unusable)?;
    let bare = Bare::open(&instance).map_err(Failure::failed)?;
    let plan = FloorPlan {
        rate_hz: config.control.rate_hz,
        loop_deadline_ns: args.loop_deadline_ns,
        from_ns: args.from_ns,
        until_ns: args.until_ns,
    };
    let ready = || {
        // A parent that has gone ends this process by a signal.
        let _ = print::line("ready");
    };
    let outcome = floor::sleep(&bare, &plan, &config.realtime, &end, ready).map_err(Failure::failed)?;
    print::line(serde_json::to_string(&outcome).map_err(Failure::failed)?)
}

/// The process of the bare sleeper, as its parent has it.
pub(super) struct Floor {
    child: Child,
    /// The CPU that it was last sent to.
    cpu: Option<usize>,
}

impl Floor {
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
        let mut child = Child::start("bare sleeper", &arguments, log)?;
        child.wait_until_ready(START_PATIENCE, log, end)?;
        Ok(Self { child, cpu: None })
    }

    /// Process id.
    pub(super) fn id(&self) -> u32 {
        self.child.id()
    }

    /// Sends it to the CPU that another process was last on. CPUs are not alike: how long one takes to wake depends on what else
    /// runs there, and a loop that is not pinned may stay on another one than the sleeper for the whole run.
    pub(super) fn follow(&mut self, pid: u32) {
        let cpu = last_cpu(pid);
        if cpu == self.cpu {
            return;
        }
        let mut only = CpuSet::new();
        let sent = cpu.is_some_and(|cpu| {
            only.set(cpu).is_ok() && sched_setaffinity(Pid::from_raw(self.id() as i32), &only).is_ok()
        });
        if sent {
            self.cpu = cpu;
        }
    }

    /// Ends it, and gives what it has measured.
    pub(super) fn finish(mut self) -> Result<FloorOutcome, Failure> {
        self.child.end();
        let text = self.child.last_line().unwrap_or_default();
        serde_json::from_str(&text)
            .map_err(|error| Failure::failed(format!("the bare sleeper's process did not tell its result ({error})")))
    }
}

/// The CPU that the main thread of a process was last on: the 39th field of `/proc/PID/stat`, proc(5).
fn last_cpu(pid: u32) -> Option<usize> {
    let text = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The name, in parentheses, is the second field, and may hold spaces.
    let (_, behind_name) = text.rsplit_once(')')?;
    behind_name.split_whitespace().nth(36)?.parse().ok()
}
