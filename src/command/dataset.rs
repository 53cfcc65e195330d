//! What `wormd analyze` and `wormd explain` work on: a recording or a campaign of several, read and checked.

use super::Failure;
use super::progress::Progress;
use clap::Args;
use std::path::{Path, PathBuf};
use worm_analysis::bench::{self, Plant};
use worm_analysis::experiment::RecordedRun;
use worm_analysis::recording::{
    Advance, Axis, Campaign, OpenOptions, PAYLOADS_KG, Recording, Wanted, open_with_progress,
};
use worm_estimator::config::Config;

/// Fraction of the progress bar for reading.
pub(super) const READING: f64 = 0.3;

/// How to read a recording, and what is known about it.
#[derive(Debug, Args)]
pub struct SourceArgs {
    /// Slope of the canal, in degrees, positive uphill; a campaign has its own
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    pub(super) slope: Option<f64>,
    /// Known extra mass that the worm carried, in kg; a campaign has its own
    #[arg(long, value_name = "KG", default_value_t = 0.0, allow_negative_numbers = true, value_parser = payload_kg)]
    payload: f64,
    /// Configuration of the worm; without it, the one stored in the recording, or the worm of the paper
    #[arg(long, value_name = "FILE")]
    pub(super) config: Option<PathBuf>,
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
}

/// A mass as an argument.
fn payload_kg(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(kg) if PAYLOADS_KG.contains(&kg) => Ok(kg),
        _ => Err(format!(
            "'{text}' is not a usable mass: give {} to {} kg",
            PAYLOADS_KG.start(),
            PAYLOADS_KG.end()
        )),
    }
}

/// Recordings of one worm, or advances that it made, and what is known about it and about each.
pub(super) struct Dataset {
    pub config: Config,
    /// The text that the configuration was read from; none for the worm of the paper.
    pub config_text: Option<String>,
    pub is_campaign: bool,
    /// Where these are given, there is no recording.
    pub advances: Vec<Advance>,
    recordings: Vec<Recording>,
    conditions: Vec<Conditions>,
}

struct Conditions {
    slope_deg: f64,
    payload_kg: f64,
    cycle_s: Option<f64>,
}

impl Dataset {
    /// The recordings with their conditions.
    pub fn runs(&self) -> Vec<RecordedRun<'_>> {
        let conditioned = self.recordings.iter().zip(&self.conditions);
        conditioned
            .map(|(recording, conditions)| RecordedRun {
                recording,
                slope_deg: conditions.slope_deg,
                payload_kg: conditions.payload_kg,
                cycle_s: conditions.cycle_s,
            })
            .collect()
    }
}

/// What a campaign is of; anything but a TOML file is of a worm.
///
/// # Errors
/// [`Failure::Unusable`] for a plant that is not known.
pub(super) fn plant_of(path: &Path) -> Result<Plant, Failure> {
    if !has_extension(path, "toml") {
        return Ok(Plant::Worm);
    }
    match worm_estimator::config::read_text(path) {
        Ok(text) => bench::plant_of(&text, path).map_err(Failure::unusable),
        // What is wrong with it is said where it is read.
        Err(_) => Ok(Plant::Worm),
    }
}

impl SourceArgs {
    /// Refuses conditions of a worm for the campaign of a servo.
    ///
    /// # Errors
    /// [`Failure::Unusable`].
    pub(super) fn refuse_conditions(&self, path: &Path) -> Result<(), Failure> {
        let is_given = self.slope.is_some() || self.payload != 0.0 || self.config.is_some() || self.axis.is_some();
        if is_given || self.from.is_some() || self.to.is_some() {
            return Err(Failure::unusable(format!(
                "{}: a servo on a bench has no slope, payload, axis or worm, and its recordings count as a whole: leave out --slope, \
                 --payload, --axis, --config, --from and --to",
                path.display()
            )));
        }
        Ok(())
    }

    /// Reads a campaign of recordings, a TOML file, or else one recording.
    ///
    /// # Errors
    /// [`Failure::Unusable`] names the file, the place in it and the remedy.
    pub(super) fn read(&self, path: &Path, wanted: Wanted, progress: &mut Progress) -> Result<Dataset, Failure> {
        let dataset = self.read_also_advances(path, wanted, progress)?;
        if dataset.advances.is_empty() {
            return Ok(dataset);
        }
        Err(Failure::unusable(format!(
            "{}: it lists advances, which `wormd analyze` cannot use: list recordings, or run `wormd explain`",
            path.display()
        )))
    }

    /// As [`read`](Self::read), but a campaign may list advances instead, and it is said what is wanted of logs.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub(super) fn read_also_advances(
        &self,
        path: &Path,
        wanted: Wanted,
        progress: &mut Progress,
    ) -> Result<Dataset, Failure> {
        if has_extension(path, "toml") {
            return self.read_campaign(path, wanted, progress);
        }
        let Some(slope_deg) = self.slope else {
            return Err(Failure::unusable(format!(
                "{}: at which slope was it made? Give --slope DEG, 0 for a level canal",
                path.display()
            )));
        };
        self.read_recording(path, slope_deg, wanted, progress)
    }

    fn options(&self, wanted: Wanted) -> OpenOptions {
        OpenOptions {
            wanted,
            from_s: self.from,
            to_s: self.to,
            max_gap_s: self.max_gap,
            axis: self.axis,
            cells: None,
        }
    }

    fn read_campaign(&self, path: &Path, wanted: Wanted, progress: &mut Progress) -> Result<Dataset, Failure> {
        if self.slope.is_some() || self.payload != 0.0 || self.config.is_some() {
            return Err(Failure::unusable(format!(
                "{}: a campaign has its own slopes, payloads and worm: leave out --slope, --payload and --config",
                path.display()
            )));
        }
        let campaign = Campaign::load(path).map_err(Failure::unusable)?;
        if !campaign.advances.is_empty() && (self.from.is_some() || self.to.is_some() || self.axis.is_some()) {
            return Err(Failure::unusable(format!(
                "{}: it lists advances, which have no time and no axis: leave out --from, --to and --axis",
                path.display()
            )));
        }
        Ok(Dataset {
            recordings: campaign
                .open_all(&self.options(wanted), &mut |fraction| {
                    progress.tell("reading", READING * fraction)
                })
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
            advances: campaign.advances,
            config: campaign.config,
            config_text: campaign.config_text,
            is_campaign: true,
        })
    }

    /// Reads one recording, made at this slope.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub(super) fn read_recording(
        &self,
        path: &Path,
        slope_deg: f64,
        wanted: Wanted,
        progress: &mut Progress,
    ) -> Result<Dataset, Failure> {
        let configured = self.config.as_deref().map(Config::load_with_text).transpose()?;
        let cells = configured
            .as_ref()
            .map_or(Config::default().worm.cells, |(config, _)| config.worm.cells);
        let options = OpenOptions {
            cells: Some(cells),
            ..self.options(wanted)
        };
        let recording = open_with_progress(path, &options, &mut |fraction| {
            progress.tell("reading", READING * fraction);
        })
        .map_err(Failure::unusable)?;
        let (config, config_text) = match configured {
            Some((config, text)) => (config, Some(text)),
            None => stored_config(path)?,
        };
        Ok(Dataset {
            config,
            config_text,
            is_campaign: false,
            advances: Vec::new(),
            recordings: vec![recording],
            conditions: vec![Conditions {
                slope_deg,
                payload_kg: self.payload,
                cycle_s: None,
            }],
        })
    }
}

/// The configuration that a log of the worm carries; the worm of the paper elsewhere.
fn stored_config(recording: &Path) -> Result<(Config, Option<String>), Failure> {
    if !has_extension(recording, "mcap") {
        return Ok((Config::default(), None));
    }
    let log = worm_log::without_messages(recording).map_err(Failure::unusable)?;
    Ok((log.config()?, log.config))
}

/// Whether a file's name ends like that, in any case.
pub(super) fn has_extension(path: &Path, wanted: &str) -> bool {
    path.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case(wanted))
}
