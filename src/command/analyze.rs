//! `wormd analyze`: section 3 of the paper on a recording, or on a campaign of several.

use super::dataset::{READING, SourceArgs, has_extension};
use super::progress::Progress;
use super::{Failure, log_line, print};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use worm_analysis::experiment::{Analysis, TorqueProfile, analyze};
use worm_analysis::report;
use worm_estimator::config::Config;
use worm_estimator::estimate::Inference;
use worm_log::{Channel, scan};

/// Arguments of `wormd analyze`.
#[derive(Debug, Args)]
pub struct AnalyzeArgs {
    /// A recording (CSV, Vicon Nexus CSV, C3D, MCAP), or a campaign (TOML) of several
    #[arg(value_name = "RECORDING")]
    recording: PathBuf,
    #[command(flatten)]
    source: SourceArgs,
    /// Folder for report.html and a CSV of every series
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object instead of tables
    #[arg(long)]
    json: bool,
}

/// Runs `wormd analyze`.
///
/// # Errors
/// [`Failure::Unusable`] for a recording, campaign or configuration that cannot be used; [`Failure::Failed`] when the report
/// cannot be written.
pub fn run(args: &AnalyzeArgs) -> Result<(), Failure> {
    let mut progress = Progress::begin();
    let dataset = args.source.read(&args.recording, &mut progress)?;
    if let Some(dir) = &args.out {
        report::prepare(dir).map_err(Failure::unusable)?;
    }
    let mut analyses = analyze(&dataset.runs(), &dataset.config, &mut |step| {
        progress.tell(step.stage, READING + (1.0 - READING) * step.fraction);
    })
    .map_err(Failure::unusable)?;
    for analysis in &mut analyses {
        let recording = Path::new(&analysis.recording);
        if has_extension(recording, "mcap") {
            analysis.torque_profile = torque_profile(recording, &dataset.config)?;
        }
    }
    let written = args.out.as_deref().map(|dir| {
        progress.tell("report", 1.0);
        let name = args
            .recording
            .file_stem()
            .map_or("recording".into(), |stem| stem.to_string_lossy());
        report::write(dir, &name, &analyses)
    });
    drop(progress);
    for note in notes(&analyses) {
        log_line(format_args!("note: {note}"));
    }
    if let Some(written) = written {
        let page = written.map_err(Failure::failed)?.page;
        log_line(format_args!("{}: look at it in a browser", page.display()));
    }
    if args.json {
        return print::line(as_json(&args.recording, &analyses, dataset.is_campaign)?);
    }
    print::line(report::text(&analyses))
}

/// What the motor's current in a log says; none where the log has no whole gait cycle with it.
fn torque_profile(log: &Path, config: &Config) -> Result<Option<TorqueProfile>, Failure> {
    let mut inference = Inference::by_current_alone(config).map_err(Failure::unusable)?;
    scan(log, |channel, payload| {
        if channel == Channel::State {
            inference.update(&payload.read()?);
        }
        Ok(())
    })
    .map_err(Failure::unusable)?;
    inference.finish();
    Ok(TorqueProfile::of(inference.sensing()))
}

/// All warnings, each once: with its recording, unless all recordings share it.
fn notes(analyses: &[Analysis]) -> Vec<String> {
    let mut notes = Vec::new();
    for analysis in analyses {
        for warning in &analysis.warnings {
            let note = if analyses.iter().all(|other| other.warnings.contains(warning)) {
                warning.clone()
            } else {
                format!("{}: {warning}", analysis.recording)
            };
            if !notes.contains(&note) {
                notes.push(note);
            }
        }
    }
    notes
}

fn as_json(source: &Path, analyses: &[Analysis], is_campaign: bool) -> Result<serde_json::Value, Failure> {
    let runs = serde_json::to_value(analyses).map_err(Failure::failed)?;
    Ok(match (is_campaign, analyses.first(), runs) {
        (true, Some(first), runs) => json!({
            "campaign": source.display().to_string(),
            "max_deformation_m": first.max_deformation_m,
            "max_deformation_sigma_m": first.max_deformation_sigma_m,
            "runs": runs,
        }),
        (_, _, mut runs) => runs[0].take(),
    })
}
