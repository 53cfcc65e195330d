//! `wormd soak`: many hours in virtual time with drawn worms and drawn faults.

use super::progress::Progress;
use super::{Failure, end_on_signal, print};
use crate::soak::{self, RunProgress, SoakOptions};
use clap::Args;
use std::io::IsTerminal;
use std::sync::Mutex;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// How often a run says how far it has come, where there is no terminal for a progress bar.
const SAY_EVERY: Duration = Duration::from_secs(60);

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
    /// Go on with this segment of the run, as a run that was stopped says
    #[arg(long, value_name = "K", conflicts_with = "segment", default_value_t = 0)]
    from_segment: u64,
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
        (None, hours) => SoakOptions::hours(args.seed, hours.unwrap_or_default()).from_segment(args.from_segment),
    };
    if options.segments == 0 {
        return Err(Failure::failed(format!(
            "there is no segment {} in a run of this length: give a smaller --from-segment or more --hours",
            args.from_segment
        )));
    }
    let end = end_on_signal()?;
    let witness = Mutex::new(Witness::new(&options));
    let report = soak::run(&options, |progress| {
        if let Ok(mut witness) = witness.lock() {
            witness.see(progress);
        }
        !end.load(Ordering::Relaxed)
    });
    drop(witness);
    if args.json {
        print::line(serde_json::to_string(&report).map_err(Failure::failed)?)?;
    } else {
        print::line(report.to_string().trim_end())?;
    }
    if report.passed() && report.segments < options.segments {
        Err(Failure::failed(format!(
            "stopped before the end; until then nothing was wrong. Go on with --from-segment {}",
            options.first + report.segments
        )))
    } else if report.passed() {
        Ok(())
    } else {
        Err(Failure::failed(format!(
            "{} false alarms, {} faults missed, {} late, {} invariants broken",
            report.alarms_false, report.missed, report.late, report.broken
        )))
    }
}

/// Says on standard error what is found, when it is found, and how far the run has come: a run of many hours may be killed.
struct Witness {
    seed: u64,
    segments: u64,
    bar: Progress,
    has_terminal: bool,
    began: Instant,
    said: Instant,
    hours: f64,
    findings: usize,
}

impl Witness {
    fn new(options: &SoakOptions) -> Self {
        let now = Instant::now();
        Self {
            seed: options.seed,
            segments: options.segments,
            bar: Progress::begin(),
            has_terminal: std::io::stderr().is_terminal(),
            began: now,
            said: now,
            hours: 0.0,
            findings: 0,
        }
    }

    fn see(&mut self, progress: &RunProgress<'_>) {
        self.hours += progress.newest.time_s / 3600.0;
        // The report lists what a single segment found.
        if self.segments > 1 {
            for finding in progress.newest.findings_of(self.seed) {
                self.findings += 1;
                self.bar.say(&finding);
            }
        }
        self.bar.tell("segments", progress.done as f64 / self.segments as f64);
        if !self.has_terminal && self.said.elapsed() >= SAY_EVERY {
            self.said = Instant::now();
            print::log_line(format!(
                "{} of {} segments, {:.1} h ({:.1} h per minute), {} findings; go on with --from-segment {}",
                progress.done,
                self.segments,
                self.hours,
                self.hours / (self.began.elapsed().as_secs_f64() / 60.0),
                self.findings,
                progress.continue_with
            ));
        }
    }
}
