//! `wormd soak`: many hours in virtual time with drawn worms and drawn faults.

use super::progress::Progress;
use super::{Failure, end_on_signal, print};
use crate::soak::{self, SoakOptions};
use clap::Args;
use std::sync::Mutex;
use std::sync::atomic::Ordering;

/// Arguments of `wormd soak`.
#[derive(Debug, Args)]
pub struct SoakArgs {
    /// Simulated hours
    #[arg(long, value_name = "H", value_parser = hours, required_unless_present = "segment")]
    hours: Option<f64>,
    /// Seed of everything that is drawn
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Run only this segment of half an hour, as a finding names it
    #[arg(long, value_name = "K", conflicts_with = "hours")]
    segment: Option<u64>,
    /// Print the report as one JSON object
    #[arg(long)]
    json: bool,
}

fn hours(text: &str) -> Result<f64, String> {
    let hours = text
        .parse()
        .ok()
        .filter(|hours| (0.0..=1e6).contains(hours) && *hours > 0.0);
    hours.ok_or_else(|| "must be a number of hours above 0, at most 1000000".to_owned())
}

/// Runs `wormd soak`.
///
/// # Errors
/// [`Failure::Failed`] when an alarm was false, a fault missed or noticed late, or an invariant broken.
pub fn run(args: &SoakArgs) -> Result<(), Failure> {
    let options = match (args.segment, args.hours) {
        (Some(segment), _) => SoakOptions {
            seed: args.seed,
            first: segment,
            segments: 1,
        },
        (None, hours) => SoakOptions::hours(args.seed, hours.unwrap_or_default()),
    };
    let end = end_on_signal()?;
    let progress = Mutex::new(Progress::begin());
    let report = soak::run(&options, |done| {
        // A progress bar is not worth waiting for.
        if let Ok(mut progress) = progress.try_lock() {
            progress.tell("segments", done as f64 / options.segments as f64);
        }
        !end.load(Ordering::Relaxed)
    });
    drop(progress);
    if args.json {
        print::line(serde_json::to_string(&report).map_err(Failure::failed)?)?;
    } else {
        print::line(report.to_string().trim_end())?;
    }
    if report.passed() && report.segments < options.segments {
        Err(Failure::failed("stopped before the end; until then nothing was wrong"))
    } else if report.passed() {
        Ok(())
    } else {
        Err(Failure::failed(format!(
            "{} false alarms, {} faults missed, {} late, {} invariants broken",
            report.alarms_false, report.missed, report.late, report.broken
        )))
    }
}
