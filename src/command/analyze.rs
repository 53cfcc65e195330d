//! `wormd analyze`: section 3 of the paper on a recording, or on a campaign of several.

mod text;

use super::progress::Progress;
use super::{Failure, log_line, print};
use crate::config::Config;
use crate::experiment::{Analysis, Run, analyze};
use crate::recording::{Axis, Campaign, OpenOptions, PAYLOADS_KG, Recording, mcap, open_with_progress};
use crate::report;
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Share of the progress bar that reading takes.
const READING: f64 = 0.3;

/// Arguments of `wormd analyze`.
#[derive(Debug, Args)]
pub struct AnalyzeArgs {
    /// A recording (CSV, Vicon Nexus CSV, C3D, MCAP), or a campaign (TOML) of several
    #[arg(value_name = "RECORDING")]
    recording: PathBuf,
    /// Slope of the canal, in degrees, positive uphill; a campaign has its own
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    slope: Option<f64>,
    /// Known extra mass that the worm carried, in kg; a campaign has its own
    #[arg(long, value_name = "KG", default_value_t = 0.0, allow_negative_numbers = true, value_parser = payload_kg)]
    payload: f64,
    /// Configuration of the worm; without it, the one stored in the recording, or the worm of the paper
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Folder for report.html and a CSV of every series
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Leave out what lies before this time, in seconds
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    from: Option<f64>,
    /// Leave out what lies after this time, in seconds
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    to: Option<f64>,
    /// Longest time for which a cell may be out of sight, in seconds
    #[arg(long, value_name = "S", default_value_t = 0.2, allow_negative_numbers = true)]
    max_gap: f64,
    /// Direction up the canal in the space of the markers: x, -x, y, -y, z, -z or "dx,dy,dz"; without it, found from the data
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true)]
    axis: Option<Axis>,
    /// Print one JSON object instead of tables
    #[arg(long)]
    json: bool,
}

/// A mass as an argument.
fn payload_kg(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(kg) if PAYLOADS_KG.contains(&kg) => Ok(kg),
        _ => Err(format!(
            "'{text}' is no mass that a worm carries: give {} to {} kg",
            PAYLOADS_KG.start(),
            PAYLOADS_KG.end()
        )),
    }
}

/// What is to be analysed, read and checked.
struct Material {
    config: Config,
    recordings: Vec<Recording>,
    conditions: Vec<Conditions>,
    is_campaign: bool,
}

struct Conditions {
    slope_deg: f64,
    payload_kg: f64,
    cycle_s: Option<f64>,
}

/// Runs `wormd analyze`.
///
/// # Errors
/// [`Failure::Unusable`] for a recording, campaign or configuration that cannot be used; [`Failure::Failed`] when the report
/// cannot be written.
pub fn run(args: &AnalyzeArgs) -> Result<(), Failure> {
    let mut progress = Progress::begin();
    let material = args.read(&mut progress)?;
    if let Some(dir) = &args.out {
        report::prepare(dir).map_err(Failure::unusable)?;
    }
    let runs: Vec<Run<'_>> = material
        .recordings
        .iter()
        .zip(&material.conditions)
        .map(|(recording, conditions)| Run {
            recording,
            slope_deg: conditions.slope_deg,
            payload_kg: conditions.payload_kg,
            cycle_s: conditions.cycle_s,
        })
        .collect();
    let analyses = analyze(&runs, &material.config, &mut |step| {
        progress.tell(step.stage, READING + (1.0 - READING) * step.share);
    })
    .map_err(Failure::unusable)?;
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
        return print::line(as_json(&args.recording, &analyses, material.is_campaign)?);
    }
    print::line(text::text(&analyses))
}

impl AnalyzeArgs {
    fn read(&self, progress: &mut Progress) -> Result<Material, Failure> {
        if self
            .recording
            .extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
        {
            self.read_campaign(progress)
        } else {
            self.read_recording(progress)
        }
    }

    fn options(&self) -> OpenOptions {
        OpenOptions {
            from_s: self.from,
            to_s: self.to,
            max_gap_s: self.max_gap,
            axis: self.axis,
        }
    }

    fn read_campaign(&self, progress: &mut Progress) -> Result<Material, Failure> {
        if self.slope.is_some() || self.payload != 0.0 || self.config.is_some() {
            return Err(Failure::unusable(format!(
                "{}: a campaign says slopes, payloads and worm itself: leave out --slope, --payload and --config",
                self.recording.display()
            )));
        }
        let campaign = Campaign::load(&self.recording).map_err(Failure::unusable)?;
        Ok(Material {
            recordings: campaign
                .open_all(&self.options(), &mut |share| progress.tell("reading", READING * share))
                .map_err(Failure::unusable)?,
            conditions: campaign
                .runs
                .iter()
                .map(|run| Conditions {
                    slope_deg: run.slope_deg,
                    payload_kg: run.payload_kg,
                    cycle_s: run.cycle_s,
                })
                .collect(),
            config: campaign.config,
            is_campaign: true,
        })
    }

    fn read_recording(&self, progress: &mut Progress) -> Result<Material, Failure> {
        let Some(slope_deg) = self.slope else {
            return Err(Failure::unusable(format!(
                "{}: at which slope was it made? Give --slope DEG, 0 for a level canal",
                self.recording.display()
            )));
        };
        let recording = open_with_progress(&self.recording, &self.options(), &mut |share| {
            progress.tell("reading", READING * share);
        })
        .map_err(Failure::unusable)?;
        let config = match &self.config {
            Some(file) => Config::load(file)?,
            None => stored_config(&self.recording)?,
        };
        Ok(Material {
            config,
            recordings: vec![recording],
            conditions: vec![Conditions {
                slope_deg,
                payload_kg: self.payload,
                cycle_s: None,
            }],
            is_campaign: false,
        })
    }
}

/// The configuration that a log of the worm carries; the worm of the paper elsewhere.
fn stored_config(recording: &Path) -> Result<Config, Failure> {
    if !recording
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("mcap"))
    {
        return Ok(Config::default());
    }
    let log = mcap::without_messages(recording).map_err(Failure::unusable)?;
    Ok(log.config()?)
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
