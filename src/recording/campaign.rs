//! Campaigns: several recordings of one worm on different slopes, listed in a TOML file.

use super::open::{OpenOptions, open_with_progress};
use super::series::{Recording, RecordingError};
use crate::config::{Config, ConfigError};
use serde::Deserialize;
use std::ops::{Range, RangeInclusive};
use std::path::{Path, PathBuf};
use toml::Spanned;

const SLOPES_DEG: RangeInclusive<f64> = -90.0..=90.0;
/// What a worm can carry on top of its own mass, kg.
pub(crate) const PAYLOADS_KG: RangeInclusive<f64> = 0.0..=100.0;
const CYCLES_S: RangeInclusive<f64> = 0.5..=120.0;

/// Why a campaign cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CampaignError {
    /// The file could not be read.
    #[error("{}: {source}: give an existing campaign, a TOML file with [[run]] sections", file.display())]
    Read {
        /// The campaign.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file says something that cannot be.
    #[error("{}:{line}: {problem}: {remedy}", file.display())]
    Invalid {
        /// The campaign.
        file: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        problem: String,
        /// What to do about it.
        remedy: String,
    },
    /// The worm's configuration cannot be used.
    #[error("the campaign's worm: {0}")]
    Worm(#[from] ConfigError),
    /// A recording cannot be used.
    #[error("the campaign's recording: {0}")]
    Recording(#[from] RecordingError),
    /// Two recordings are not of one worm.
    #[error("{} has {first_cells} cells and {} has {second_cells}: list recordings of one worm", first.display(), second.display())]
    Cells {
        /// One recording, or the worm's configuration.
        first: PathBuf,
        /// Its cells.
        first_cells: usize,
        /// Another recording.
        second: PathBuf,
        /// Its cells.
        second_cells: usize,
    },
}

/// Several recordings of one worm, and what is known about each.
#[derive(Debug, Clone, PartialEq)]
pub struct Campaign {
    /// The file it comes from.
    pub file: PathBuf,
    /// The configuration's file; `None` for the worm of the paper.
    pub worm: Option<PathBuf>,
    /// The worm as it is believed to be.
    pub config: Config,
    /// The text of the configuration's file; `None` for the worm of the paper.
    pub config_text: Option<String>,
    /// At least one.
    pub runs: Vec<Run>,
}

/// One recording of a campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Where the recording is.
    pub recording: PathBuf,
    /// Slope of the canal, degrees, positive uphill, −90 to 90.
    pub slope_deg: f64,
    /// Known extra mass, kg, 0 to 100.
    pub payload_kg: f64,
    /// Time of a gait cycle where it is not the configured one, s, 0.5 to 120.
    pub cycle_s: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CampaignFile {
    worm: Option<PathBuf>,
    #[serde(default)]
    run: Vec<RunEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RunEntry {
    recording: Spanned<PathBuf>,
    slope_deg: Spanned<f64>,
    payload_kg: Option<Spanned<f64>>,
    cycle_s: Option<Spanned<f64>>,
}

impl Campaign {
    /// Reads and checks a campaign and its worm's configuration. The recordings must exist; [`open_all`](Self::open_all) reads
    /// them. Paths in the file are relative to it.
    ///
    /// # Errors
    /// [`CampaignError`] with the line for an unknown key, a value out of range, a missing file, or a recording listed twice.
    pub fn load(path: &Path) -> Result<Self, CampaignError> {
        let text = std::fs::read_to_string(path).map_err(|source| CampaignError::Read {
            file: path.to_path_buf(),
            source,
        })?;
        let reader = Reader { path, text: &text };
        let file: CampaignFile = toml::from_str(&text).map_err(|error| {
            let remedy =
                "a campaign holds worm = \"FILE\" and [[run]] with recording, slope_deg, payload_kg and cycle_s";
            reader.invalid(error.span().unwrap_or(0..0), error.message().trim(), remedy)
        })?;
        if file.run.is_empty() {
            let remedy = "add a section [[run]] with recording and slope_deg for each recording";
            return Err(reader.invalid(0..0, "there is no run in it", remedy));
        }
        let worm = file.worm.map(|worm| reader.beside(&worm));
        let (config, config_text) = match worm.as_deref() {
            Some(worm) => {
                let (config, text) = Config::load_with_text(worm)?;
                (config, Some(text))
            }
            None => (Config::default(), None),
        };
        let mut runs: Vec<(Run, PathBuf)> = Vec::with_capacity(file.run.len());
        for entry in &file.run {
            let run = reader.run(entry)?;
            let real_path = reader.find(entry, &run)?;
            if let Some((earlier, _)) = runs.iter().find(|(_, other)| *other == real_path) {
                let problem = if earlier.slope_deg == run.slope_deg {
                    format!("{} is listed twice", run.recording.display())
                } else {
                    format!(
                        "contradictory slopes: {} is listed with {}° and with {}°",
                        run.recording.display(),
                        earlier.slope_deg,
                        run.slope_deg
                    )
                };
                return Err(reader.invalid(entry.recording.span(), &problem, "list each recording once"));
            }
            runs.push((run, real_path));
        }
        Ok(Self {
            file: path.to_path_buf(),
            worm,
            config,
            config_text,
            runs: runs.into_iter().map(|(run, _)| run).collect(),
        })
    }

    /// Opens all recordings, in the order of the runs, telling `progress` now and then which share was read, 0 to 1.
    ///
    /// # Errors
    /// [`CampaignError`] for the first recording that cannot be used or has another number of cells than the worm.
    pub fn open_all(
        &self,
        options: &OpenOptions,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Vec<Recording>, CampaignError> {
        let count = self.runs.len() as f64;
        let mut recordings: Vec<Recording> = Vec::with_capacity(self.runs.len());
        for (number, run) in self.runs.iter().enumerate() {
            let mut one = |share: f64| progress((number as f64 + share) / count);
            let recording = open_with_progress(&run.recording, options, &mut one)?;
            let (first, first_cells) = match recordings.first() {
                Some(first) => (first.source.clone(), first.cells()),
                None => (
                    self.worm.clone().unwrap_or_else(|| "the paper's worm".into()),
                    self.config.worm.cells,
                ),
            };
            if recording.cells() != first_cells {
                return Err(CampaignError::Cells {
                    first,
                    first_cells,
                    second: recording.source.clone(),
                    second_cells: recording.cells(),
                });
            }
            recordings.push(recording);
        }
        Ok(recordings)
    }
}

struct Reader<'f> {
    path: &'f Path,
    text: &'f str,
}

impl Reader<'_> {
    fn invalid(&self, at: Range<usize>, problem: &str, remedy: &str) -> CampaignError {
        let before = self.text.get(..at.start).unwrap_or("");
        CampaignError::Invalid {
            file: self.path.to_path_buf(),
            line: before.matches('\n').count() + 1,
            problem: problem.to_owned(),
            remedy: remedy.to_owned(),
        }
    }

    /// A path as the file means it.
    fn beside(&self, path: &Path) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(path)
    }

    fn run(&self, entry: &RunEntry) -> Result<Run, CampaignError> {
        let payload_kg = entry.payload_kg.as_ref();
        let payload_kg = payload_kg.map(|value| self.within("payload_kg", value, PAYLOADS_KG, "kg"));
        let cycle_s = entry.cycle_s.as_ref();
        let cycle_s = cycle_s.map(|value| self.within("cycle_s", value, CYCLES_S, "s"));
        Ok(Run {
            recording: self.beside(entry.recording.get_ref()),
            slope_deg: self.within("slope_deg", &entry.slope_deg, SLOPES_DEG, "degrees")?,
            payload_kg: payload_kg.transpose()?.unwrap_or(0.0),
            cycle_s: cycle_s.transpose()?,
        })
    }

    fn within(
        &self,
        key: &str,
        value: &Spanned<f64>,
        range: RangeInclusive<f64>,
        unit: &str,
    ) -> Result<f64, CampaignError> {
        if range.contains(value.get_ref()) {
            return Ok(*value.get_ref());
        }
        let remedy = format!("must be from {} to {} {unit}", range.start(), range.end());
        Err(self.invalid(value.span(), &format!("{key} = {}", value.get_ref()), &remedy))
    }

    /// The recording's one true path.
    fn find(&self, entry: &RunEntry, run: &Run) -> Result<PathBuf, CampaignError> {
        run.recording.canonicalize().map_err(|error| {
            let problem = format!("{}: {error}", run.recording.display());
            let remedy = "give the recording's path relative to the campaign's file";
            self.invalid(entry.recording.span(), &problem, remedy)
        })
    }
}
