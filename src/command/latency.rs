//! `wormd latency`: the loop's own latency, end to end, against what this computer can do at best.

mod bench;
mod busy_poll;
mod cyclictest;
mod floor;
mod measure;
mod rates;
mod testbed;
mod text;
mod verdict;

pub use floor::{FloorArgs, run as run_floor};

use super::{Failure, WormArgs, end_on_signal, positive_seconds, print};
use bench::Bench;
use clap::Args;
#[cfg(feature = "analysis")]
use std::path::PathBuf;
use std::time::Duration;
#[cfg(feature = "analysis")]
use worm_analysis::report;

/// Arguments of `wormd latency`.
#[derive(Debug, Args)]
pub struct LatencyArgs {
    #[command(flatten)]
    worm: WormArgs,
    /// Ticks per second, instead of the configured ones
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// How long to measure the loop; the whole takes longer by the start, a look at busy subscribers, and the trial of rates
    #[arg(long, value_name = "SECONDS", value_parser = positive_seconds, default_value = "20")]
    duration: Duration,
    /// Have all CPUs, the memory and the disk busy meanwhile
    #[arg(long)]
    load: bool,
    /// Priority under SCHED_FIFO, instead of the configured one; 0 leaves the ordinary scheduler
    #[arg(long, value_name = "N")]
    priority: Option<u8>,
    /// CPU to pin loop and floor to, instead of the configured one
    #[arg(long, value_name = "N")]
    cpu: Option<usize>,
    /// Do not look for the highest rate that can be kept
    #[arg(long)]
    no_rate_search: bool,
    /// Run `cyclictest` beside the loop, too, where it is installed (package rt-tests)
    #[arg(long)]
    cyclictest: bool,
    /// Print one JSON object on standard output, and nothing else there
    #[arg(long)]
    json: bool,
    /// Write a page with the histograms and the latest ticks, and all numbers as JSON, into this directory
    #[cfg(feature = "analysis")]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Runs `wormd latency`.
///
/// # Errors
/// [`Failure::Unusable`] for arguments, configuration or devices that cannot be used; [`Failure::Failed`] when something fails
/// while it measures. What could be measured all the same, the machine's own limit at least, is told before.
pub fn run(args: &LatencyArgs, verbose: u8) -> Result<(), Failure> {
    let bench = Bench::new(args, verbose)?;
    #[cfg(feature = "analysis")]
    if let Some(dir) = &args.out {
        // A directory that cannot be written is told now, not after the measurement.
        report::prepare(dir).map_err(Failure::unusable)?;
    }
    let end = end_on_signal()?;
    let (outcome, trouble) = measure::run(&bench, &end)?;
    #[cfg(feature = "analysis")]
    if let Some(dir) = &args.out {
        crate::latency::page::write(dir, &outcome).map_err(Failure::failed)?;
    }
    if args.json {
        print::line(serde_json::to_string(&outcome).map_err(Failure::failed)?)?;
    } else {
        print::line(outcome.to_string().trim_end())?;
        #[cfg(feature = "analysis")]
        if let Some(dir) = &args.out {
            print::line(format_args!("\n{}", dir.join("latency.html").display()))?;
        }
    }
    trouble.map_or(Ok(()), Err)
}
