//! `wormd check`: what stands between this computer, this configuration and a crawling worm.

use super::{Failure, WormArgs, end_on_signal, print, suspend_on_signal};
use crate::preflight::{CheckReport, Level, Trials};
use clap::Args;

/// Arguments of `wormd check`.
#[derive(Debug, Args)]
pub struct CheckArgs {
    #[command(flatten)]
    worm: WormArgs,
    /// Turn the cam slowly, fall silent, and measure how long the servo's watchdog lets it turn on; needs a real port
    #[arg(long)]
    try_watchdog: bool,
    /// Turn the cam a little there and back with little torque: direction, position, home; needs a real port
    #[arg(long)]
    try_motion: bool,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

/// Runs `wormd check`.
///
/// # Errors
/// [`Failure::Unusable`] for a configuration that cannot be used, [`Failure::Failed`] when something keeps the worm from running.
pub fn run(args: &CheckArgs) -> Result<(), Failure> {
    let config = args.worm.load()?;
    let source = match &args.worm.config {
        Some(file) => file.display().to_string(),
        None => "the built-in defaults".to_owned(),
    };
    let mut trials = Trials {
        watchdog: args.try_watchdog,
        motion: args.try_motion,
        signals: Vec::new(),
    };
    if trials.is_any() && config.port.is_none() {
        return Err(Failure::unusable(
            "a trial needs a serial port: name one in the section [port] or with --port",
        ));
    }
    if trials.is_any() {
        // Nobody leaves, or is suspended, while the motor turns.
        trials.signals = vec![end_on_signal()?, suspend_on_signal()?];
    }
    let report = CheckReport::new(&config, &source, &trials);
    if args.json {
        print::line(serde_json::to_string_pretty(&report).map_err(Failure::failed)?)?;
    } else {
        print_text(&report)?;
    }
    match report.errors() {
        0 => Ok(()),
        errors => Err(Failure::failed(format!(
            "{errors} finding(s) keep {} from running",
            config.worm.name
        ))),
    }
}

fn print_text(report: &CheckReport) -> Result<(), Failure> {
    for finding in &report.findings {
        let mark = match finding.level {
            Level::Good => "ok     ",
            Level::Warning => "WARNING",
            Level::Error => "ERROR  ",
        };
        print::line(format_args!("{mark}  {}: {}", finding.subject, finding.found))?;
        if let Some(remedy) = &finding.remedy {
            print::line(format_args!("         -> {remedy}"))?;
        }
    }
    Ok(())
}
