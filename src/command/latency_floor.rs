//! `wormd latency-floor`: the bare sleeper as a process. Hidden from the help: only `wormd latency` runs it.

use super::{Failure, end_on_signal, print};
use crate::benchmark::floor::{self, FloorPlan};
use crate::benchmark::ipc_baseline::IpcBaseline;
use crate::topics::Instance;
use clap::Args;
use std::path::PathBuf;
use worm_estimator::config::Config;

/// Arguments of the hidden subcommand `wormd latency-floor`.
#[derive(Debug, Args)]
pub struct LatencyFloorArgs {
    #[arg(long)]
    config: PathBuf,
    #[arg(long)]
    loop_deadline_ns: u64,
    #[arg(long)]
    from_ns: u64,
    #[arg(long)]
    until_ns: u64,
}

/// Runs the bare sleeper until a signal ends it. Prints the line "ready", and at the end what it has measured as one line of JSON.
///
/// # Errors
/// [`Failure::Failed`] when iceoryx2 refuses, or nobody reads the result.
pub fn run(args: &LatencyFloorArgs) -> Result<(), Failure> {
    let config = Config::load(&args.config)?;
    let end = end_on_signal()?;
    let instance = Instance::of(&config).map_err(Failure::unusable)?;
    let baseline = IpcBaseline::open(&instance).map_err(Failure::failed)?;
    let plan = FloorPlan {
        rate_hz: config.control.rate_hz,
        loop_deadline_ns: args.loop_deadline_ns,
        from_ns: args.from_ns,
        until_ns: args.until_ns,
    };
    let outcome = floor::run(&baseline, &plan, &config.realtime, &end, print::ready).map_err(Failure::failed)?;
    print::line(serde_json::to_string(&outcome).map_err(Failure::failed)?)
}
