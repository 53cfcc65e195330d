//! `wormd why`: why a worm stopped, from a box or any other log.

use super::black_box::PlaceArgs;
#[cfg(feature = "analysis")]
use super::progress::Progress;
use super::{Failure, log_line, print};
use crate::black_box::trigger;
use crate::why::{Explanation, explain_stop, newest_stop, text};
use clap::Args;
use std::path::{Path, PathBuf};
use worm_estimator::config::Config;
use worm_log::{Log, messages};

/// Arguments of `wormd why`.
#[derive(Debug, Args)]
pub struct WhyArgs {
    /// A box of the black box or another log (MCAP), complete or not; without it, the newest box with a stop
    #[arg(value_name = "LOG")]
    log: Option<PathBuf>,
    /// Folder for why.html and why.json
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
    /// The stop with this number in the log, from 1; without it, that of the box's event, or else the last
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    stop: Option<u32>,
    /// Do not search in the gait cycles before it for what the model misses, which may take a minute
    #[arg(long)]
    no_explain: bool,
    #[command(flatten)]
    place: PlaceArgs,
}

/// Runs `wormd why`.
///
/// # Errors
/// [`Failure::Unusable`] for a log, configuration or folder that cannot be used; [`Failure::Failed`] when a file cannot be written.
pub fn run(args: &WhyArgs) -> Result<(), Failure> {
    let path = match &args.log {
        Some(log) => log.clone(),
        None => stop_box(&args.place)?,
    };
    let log = messages(&path).map_err(Failure::unusable)?;
    if log.states.is_empty() {
        let file = path.display();
        return Err(Failure::unusable(format!(
            "{file}: channel /state: holds no message: record the topic `state`"
        )));
    }
    let config = match &args.place.worm.config {
        Some(file) if args.log.is_some() => Config::load(file)?,
        _ => log.config()?,
    };
    let stop = args.stop.map(|number| number as usize);
    let mut explanation = explain_stop(&log, &config, trigger(&path).as_ref(), stop);
    if let Some(wanted) = stop
        && explanation.stop != wanted
    {
        return Err(Failure::unusable(format!(
            "{}: there is no stop {wanted}: it holds {}",
            path.display(),
            explanation.stops
        )));
    }
    // Before the search, which takes its time.
    if let Some(dir) = &args.out {
        prepare(dir)?;
    }
    explain_last_cycles(args, &log, &config, &mut explanation);
    let written = args.out.as_deref().map(|dir| write(dir, &explanation, &log, &config));
    for warning in &explanation.warnings {
        log_line(format_args!("note: {warning}"));
    }
    if args.json {
        print::line(serde_json::to_string(&explanation).map_err(Failure::failed)?)?;
    } else {
        print::line(text::text(&explanation))?;
    }
    if let Some(page) = written.transpose()? {
        log_line(format_args!("{}: look at it in a browser", page.display()));
    }
    Ok(())
}

/// The newest box with a stop, or else the newest. Later ones are named.
fn stop_box(place: &PlaceArgs) -> Result<PathBuf, Failure> {
    let folder = place.folder()?;
    let found = newest_stop::newest_stop(&folder).map_err(Failure::unusable)?;
    let found = found.ok_or_else(|| place.no_box(&folder))?;
    place.tell_what_is_missing(&folder);
    for later in &found.later {
        let reason = later.reason.as_deref().unwrap_or("its beginning is not known");
        log_line(format_args!(
            "note: a later box, in which nothing stopped: {} ({reason}): `wormd why {}` says more",
            later.name,
            folder.path().join(&later.name).display()
        ));
    }
    Ok(folder.path().join(&found.entry.name))
}

#[cfg(feature = "analysis")]
fn explain_last_cycles(args: &WhyArgs, log: &Log, config: &Config, explanation: &mut Explanation) {
    if args.no_explain {
        explanation.last_cycles.why_not = Some("--no-explain was given".to_owned());
        return;
    }
    // Before the trouble began: what it does is known.
    let since_s = explanation.reason.since_s.unwrap_or(0.0).min(0.0);
    let until_ns = explanation.time_ns.saturating_sub((-since_s * 1e9) as u64);
    let mut progress = Progress::begin();
    explanation.last_cycles = crate::why::last_cycles::search(log, config, until_ns, &mut |fraction| {
        progress.tell("gait cycles before it", fraction);
    });
}

#[cfg(not(feature = "analysis"))]
fn explain_last_cycles(args: &WhyArgs, _log: &Log, _config: &Config, explanation: &mut Explanation) {
    let why_not = if args.no_explain {
        "--no-explain was given"
    } else {
        "this wormd was built without the feature `analysis`"
    };
    explanation.last_cycles.why_not = Some(why_not.to_owned());
}

/// Makes the folder, if need be, and sees whether it can be written in.
#[cfg(feature = "analysis")]
fn prepare(dir: &Path) -> Result<(), Failure> {
    worm_analysis::report::prepare(dir).map_err(Failure::unusable)
}

#[cfg(not(feature = "analysis"))]
fn prepare(dir: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(dir).map_err(|error| {
        Failure::unusable(format!(
            "{}: the folder cannot be made: {error}: name another one with --out",
            dir.display()
        ))
    })
}

#[cfg(feature = "analysis")]
fn write(dir: &Path, explanation: &Explanation, log: &Log, config: &Config) -> Result<PathBuf, Failure> {
    crate::why::page::write(dir, explanation, log, config).map_err(Failure::failed)
}

#[cfg(not(feature = "analysis"))]
fn write(dir: &Path, explanation: &Explanation, _log: &Log, _config: &Config) -> Result<PathBuf, Failure> {
    let failed = |error: std::io::Error| Failure::failed(format!("{}: cannot be written: {error}", dir.display()));
    let path = dir.join("why.json");
    let text = serde_json::to_string_pretty(explanation).map_err(Failure::failed)?;
    std::fs::write(&path, text + "\n").map_err(failed)?;
    Ok(path)
}
