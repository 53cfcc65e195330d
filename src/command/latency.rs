//! `wormd latency`: the loop's own latency, end to end, against what this computer can do at best.

use super::progress::Progress;
use super::{Failure, WormArgs, end_on_signal, positive_seconds, print};
use crate::benchmark::{self, Benchmark, Options};
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
    /// How long to measure the loop; the start, busy subscribers and the search for the highest rate take additional time
    #[arg(long, value_name = "SECONDS", value_parser = positive_seconds, allow_negative_numbers = true, default_value = "20")]
    duration: Duration,
    /// Keep all CPUs, the memory and the disk busy meanwhile
    #[arg(long)]
    load: bool,
    /// Priority under SCHED_FIFO, instead of the configured one; 0 leaves the ordinary scheduler
    #[arg(long, value_name = "N")]
    priority: Option<u8>,
    /// CPU to pin loop and floor to, instead of the configured one
    #[arg(long, value_name = "N")]
    cpu: Option<usize>,
    /// Do not search for the highest sustained rate
    #[arg(long)]
    no_rate_search: bool,
    /// Also run `cyclictest` beside the loop, where it is installed (package rt-tests)
    #[arg(long)]
    cyclictest: bool,
    /// Print the result as one JSON object, and nothing else, on standard output
    #[arg(long)]
    json: bool,
    /// Write a page with the histograms and the worst ticks, and all numbers as JSON, into this directory
    #[cfg(feature = "analysis")]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl LatencyArgs {
    fn options(&self, verbose: u8) -> Options {
        Options {
            name: self.worm.name.clone(),
            rate_hz: self.rate,
            duration: self.duration,
            load: self.load,
            priority: self.priority,
            cpu: self.cpu,
            search_rates: !self.no_rate_search,
            cyclictest: self.cyclictest,
            verbose,
        }
    }
}

/// Runs `wormd latency`.
///
/// # Errors
/// [`Failure::Unusable`] for arguments, configuration or devices that cannot be used; [`Failure::Failed`] when something fails
/// during the measurement. What could be measured, at least the machine's own limit, is printed before.
pub fn run(args: &LatencyArgs, verbose: u8) -> Result<(), Failure> {
    let (config, text) = args.worm.load_with_text()?;
    let benchmark = Benchmark::new(config, text, args.options(verbose))?;
    #[cfg(feature = "analysis")]
    if let Some(dir) = &args.out {
        // A directory that cannot be written is reported now, not after the measurement.
        report::prepare(dir).map_err(Failure::unusable)?;
    }
    let end = end_on_signal()?;
    let mut bar = Progress::begin();
    let progress = move |stage: &str, fraction| bar.tell(stage, fraction);
    let (outcome, problem) = benchmark::run(&benchmark, &end, progress)?;
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
    problem.map_or(Ok(()), Err)
}
