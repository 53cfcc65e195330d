//! `wormd replay`: runs a log through the estimator again, and compares the results.

use super::{Failure, print, refuse_another_worm};
use clap::Args;
use std::path::PathBuf;
use worm_estimator::config::Config;
use worm_log::{Comparison, compare, messages, replay};

/// Arguments of `wormd replay`.
#[derive(Debug, Args)]
pub struct ReplayArgs {
    /// The log, as `wormd record` or `wormd up --record` wrote it
    #[arg(value_name = "FILE")]
    log: PathBuf,
    /// Configuration file, instead of the one in the log
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Print the comparison as one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs `wormd replay`.
///
/// # Errors
/// [`Failure::Unusable`] for a log or configuration that cannot be used; [`Failure::Failed`] when a log that is complete
/// does not reproduce the recorded results.
pub fn run(args: &ReplayArgs) -> Result<(), Failure> {
    let log = messages(&args.log).map_err(Failure::unusable)?;
    if log.states.is_empty() {
        let file = args.log.display();
        return Err(Failure::unusable(format!(
            "{file}: channel /state: holds no message: record the topic `state`"
        )));
    }
    let config = match &args.config {
        Some(file) => Config::load(file)?,
        None => log.config()?,
    };
    refuse_another_worm(&log, &args.log, &config, args.config.as_deref())?;
    let replayed = replay(&log, &config).map_err(Failure::unusable)?;
    let comparison = compare(&log, &replayed);
    if args.json {
        print::line(serde_json::to_string(&comparison).map_err(Failure::failed)?)?;
    } else {
        print::line(in_words(&comparison))?;
    }
    if comparison.complete && !comparison.is_identical() {
        return Err(Failure::failed(
            "the estimator did not reproduce the recorded results: was the log made by another version, or with another configuration?",
        ));
    }
    Ok(())
}

fn in_words(comparison: &Comparison) -> String {
    let mut text = format!(
        "{} states replayed from a log that is {}complete; identical to the last bit: {} of {} estimates, {} of {} cycles, {} of {} alarms",
        comparison.states,
        if comparison.complete { "" } else { "not " },
        comparison.estimates_identical,
        comparison.estimates_compared,
        comparison.cycles_identical,
        comparison.cycles_compared,
        comparison.alarms_identical,
        comparison.alarms_compared,
    );
    if comparison.ranges_compared > 0 {
        let (identical, compared) = (comparison.ranges_identical, comparison.ranges_compared);
        text += &format!(", {identical} of {compared} ranges");
    }
    if comparison.inferred_compared > 0 {
        let (identical, compared) = (comparison.inferred_identical, comparison.inferred_compared);
        text += &format!(", {identical} of {compared} messages of self-sensing");
    }
    for warning in &comparison.warnings {
        text += &format!("\nnote: {warning}");
    }
    text
}
