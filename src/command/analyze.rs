//! `wormd analyze`: section 3 of the paper on a recording, or on a campaign of several.

use super::dataset::{Dataset, READING, SourceArgs, has_extension};
use super::progress::Progress;
use super::{Failure, log_line, print};
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use worm_analysis::experiment::{Analysis, TorqueProfile, analyze, analyze_by_current};
use worm_analysis::recording::Wanted;
use worm_analysis::report::{self, ReportError, Written};
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
    /// Go by the motor's current, as where nobody saw the worm: the positions of a log are not looked at. For logs whose tracker died on the way
    #[arg(long, value_name = "EVIDENCE", value_enum, require_equals = true)]
    current: Option<Current>,
    /// Folder for report.html and a CSV of every series
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object instead of tables
    #[arg(long)]
    json: bool,
}

/// How the motor's current is evidence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Current {
    /// Instead of positions
    Alone,
}

/// Runs `wormd analyze`.
///
/// # Errors
/// [`Failure::Unusable`] for a recording, campaign or configuration that cannot be used; [`Failure::Failed`] when the report
/// cannot be written.
pub fn run(args: &AnalyzeArgs) -> Result<(), Failure> {
    let mut progress = Progress::begin();
    let wanted = match args.current {
        None => Wanted::PositionsOrMotor { window_s: 0.0 },
        Some(Current::Alone) => Wanted::Motor { window_s: 0.0 },
    };
    let dataset = args.source.read(&args.recording, wanted, &mut progress)?;
    if let Some(dir) = &args.out {
        report::prepare(dir).map_err(Failure::unusable)?;
    }
    let unseen: Vec<bool> = dataset
        .runs()
        .iter()
        .map(|run| args.current.is_some() || !run.recording.has_positions())
        .collect();
    if unseen.iter().all(|is_unseen| *is_unseen) {
        return args.analyze_unseen(&dataset, progress);
    }
    if let Some(unseen) = unseen.iter().position(|is_unseen| *is_unseen) {
        return Err(Failure::unusable(format!(
            "{}: nobody saw the worm in this one, and in others somebody did: analyse them separately",
            dataset.runs()[unseen].recording.source.display()
        )));
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
    let written = args.write(&mut progress, |dir, name| report::write(dir, name, &analyses));
    drop(progress);
    let of_each = |analysis: &Analysis| (analysis.recording.clone(), analysis.warnings.clone());
    let told: Vec<_> = analyses.iter().map(of_each).collect();
    args.tell(&notes(&told), written)?;
    if args.json {
        let deformations = analyses.first().map(|first| {
            json!({
                "max_deformation_m": first.max_deformation_m,
                "max_deformation_sigma_m": first.max_deformation_sigma_m,
            })
        });
        let runs = serde_json::to_value(&analyses).map_err(Failure::failed)?;
        return print::line(args.as_json(deformations, runs, dataset.is_campaign));
    }
    print::line(report::text(&analyses))
}

impl AnalyzeArgs {
    /// The same for recordings in which nobody saw the worm, by the motor's current.
    fn analyze_unseen(&self, dataset: &Dataset, mut progress: Progress) -> Result<(), Failure> {
        progress.tell("torque", READING);
        let analyses = analyze_by_current(&dataset.runs(), &dataset.config).map_err(Failure::unusable)?;
        let written = self.write(&mut progress, |dir, name| {
            report::by_current::write(dir, name, &analyses)
        });
        drop(progress);
        let told: Vec<_> = analyses
            .iter()
            .map(|analysis| (analysis.recording.clone(), analysis.warnings.clone()))
            .collect();
        self.tell(&notes(&told), written)?;
        if self.json {
            let runs = serde_json::to_value(&analyses).map_err(Failure::failed)?;
            return print::line(self.as_json(None, runs, dataset.is_campaign));
        }
        print::line(report::by_current::text(&analyses))
    }

    /// Writes the report, if one is wanted.
    fn write(
        &self,
        progress: &mut Progress,
        write: impl FnOnce(&Path, &str) -> Result<Written, ReportError>,
    ) -> Option<Result<Written, ReportError>> {
        let dir = self.out.as_deref()?;
        progress.tell("report", 1.0);
        let stem = self.recording.file_stem();
        let name = stem.map_or("recording".into(), |stem| stem.to_string_lossy());
        Some(write(dir, &name))
    }

    /// Says what is to be known, and where the report is.
    fn tell(&self, notes: &[String], written: Option<Result<Written, ReportError>>) -> Result<(), Failure> {
        for note in notes {
            log_line(format_args!("note: {note}"));
        }
        if let Some(written) = written {
            let page = written.map_err(Failure::failed)?.page;
            log_line(format_args!("{}: look at it in a browser", page.display()));
        }
        Ok(())
    }

    /// One run as it is, or those of a campaign with what they have in common.
    fn as_json(&self, common: Option<Value>, mut runs: Value, is_campaign: bool) -> Value {
        if !is_campaign {
            return runs[0].take();
        }
        let mut campaign = common.unwrap_or_else(|| json!({}));
        campaign["campaign"] = self.recording.display().to_string().into();
        campaign["runs"] = runs;
        campaign
    }
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

/// All warnings of recordings, each once: with its recording, unless all share it.
fn notes(told: &[(String, Vec<String>)]) -> Vec<String> {
    let mut notes = Vec::new();
    for (recording, warnings) in told {
        for warning in warnings {
            let note = if told.iter().all(|(_, others)| others.contains(warning)) {
                warning.clone()
            } else {
                format!("{recording}: {warning}")
            };
            if !notes.contains(&note) {
                notes.push(note);
            }
        }
    }
    notes
}
