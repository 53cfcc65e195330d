//! Campaigns: several recordings of one worm on different slopes, listed in a TOML file; or, where no positions were recorded, its
//! measured advances.

use super::open::open_with_progress;
use super::options::OpenOptions;
use super::series::Recording;
use serde::Deserialize;
use std::ops::{Range, RangeInclusive};
use std::path::{Path, PathBuf};
use toml::Spanned;
use worm_estimator::abridged::abridged;
use worm_estimator::config::{Config, ConfigError, read_text};
use worm_log::ReadError;

const SLOPES_DEG: RangeInclusive<f64> = -90.0..=90.0;
/// What a worm can carry on top of its own mass, kg.
pub const PAYLOADS_KG: RangeInclusive<f64> = 0.0..=100.0;
const CYCLES_S: RangeInclusive<f64> = 0.5..=120.0;
/// The smallest standard error that is accepted for an advance, m.
const MIN_SIGMA_M: f64 = 1e-6;

/// Longest problem or remedy, bytes: they may quote the file.
const MAX_TEXT_LEN: usize = 2000;
/// Longest path of a file, bytes: no Linux system takes a longer one (PATH_MAX).
const MAX_PATH_LEN: usize = 4096;

/// Why a campaign cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CampaignError {
    /// The file could not be read.
    #[error("{}: {source}: give an existing campaign, a TOML file with [[run]] sections", file.display())]
    Read {
        /// The campaign.
        file: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// An invalid entry in the file.
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
    Recording(#[from] ReadError),
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
    /// The nominal worm.
    pub config: Config,
    /// The text of the configuration's file; `None` for the worm of the paper.
    pub config_text: Option<String>,
    /// Its recordings; none where it lists advances.
    pub runs: Vec<CampaignRun>,
    /// Its advances; none where it lists recordings. At least one of either.
    pub advances: Vec<Advance>,
}

/// A run of which only the advance is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Advance {
    /// Slope of the canal, degrees, positive uphill, −90 to 90.
    pub slope_deg: f64,
    /// Known extra mass, kg, 0 to 100.
    pub payload_kg: f64,
    /// Time of a gait cycle where it is not the configured one, s, 0.5 to 120.
    pub cycle_s: Option<f64>,
    /// Mean advance of a settled cycle, m, less than a stroke to either side.
    pub advance_m: f64,
    /// Its standard error, m, 1 µm to a stroke.
    pub sigma_m: f64,
}

/// One recording of a campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct CampaignRun {
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
    /// `worm`; another plant's campaign has a reader of its own.
    plant: Option<Spanned<String>>,
    worm: Option<Spanned<PathBuf>>,
    #[serde(default)]
    run: Vec<RunEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RunEntry {
    recording: Option<Spanned<PathBuf>>,
    slope_deg: Spanned<f64>,
    payload_kg: Option<Spanned<f64>>,
    cycle_s: Option<Spanned<f64>>,
    advance_m: Option<Spanned<f64>>,
    advance_sigma_m: Option<Spanned<f64>>,
}

impl Campaign {
    /// Reads and checks a campaign and its worm's configuration. The recordings must exist; [`open_all`](Self::open_all) reads
    /// them. Paths in the file are relative to it.
    ///
    /// # Errors
    /// [`CampaignError`] with the line for an unknown key, a value out of range, a missing file, a recording listed twice, an advance
    /// without its standard error, or recordings beside advances.
    pub fn load(path: &Path) -> Result<Self, CampaignError> {
        let text = read_text(path).map_err(|source| CampaignError::Read {
            file: path.to_path_buf(),
            source,
        })?;
        Self::from_toml(&text, path)
    }

    /// As [`load`](Self::load), from a text in memory; errors call it `path`, and the paths in it are relative to that.
    ///
    /// # Errors
    /// As [`load`](Self::load), except for those of reading the file.
    pub fn from_toml(text: &str, path: &Path) -> Result<Self, CampaignError> {
        let reader = Reader { path, text };
        let file: CampaignFile = toml::from_str(text).map_err(|error| {
            let remedy =
                "a campaign holds worm = \"FILE\" and [[run]] with recording (or advance_m and advance_sigma_m), slope_deg, payload_kg \
                 and cycle_s";
            reader.invalid(error.span().unwrap_or(0..0), error.message().trim(), remedy)
        })?;
        if let Some(plant) = file.plant.filter(|plant| plant.get_ref() != "worm") {
            let problem = format!("plant = \"{}\" is no worm", plant.get_ref());
            let remedy = "give a worm's campaign; `wormd explain` and `wormd predict` take those of a servo-bench, too";
            return Err(reader.invalid(plant.span(), &problem, remedy));
        }
        if file.run.is_empty() {
            let remedy = "add a section [[run]] with recording and slope_deg for each recording";
            return Err(reader.invalid(0..0, "there is no run in it", remedy));
        }
        let worm = file.worm.map(|worm| reader.worm(&worm)).transpose()?;
        let (config, config_text) = match worm.as_deref() {
            Some(worm) => {
                let (config, text) = Config::load_with_text(worm)?;
                (config, Some(text))
            }
            None => (Config::default(), None),
        };
        let mut runs: Vec<(CampaignRun, PathBuf)> = Vec::with_capacity(file.run.len());
        let mut advances = Vec::new();
        for entry in &file.run {
            let Some(recording) = &entry.recording else {
                if !runs.is_empty() {
                    return Err(reader.mixed(entry));
                }
                advances.push(reader.advance(entry, config.worm.stroke_m)?);
                continue;
            };
            if !advances.is_empty() || entry.advance_m.is_some() || entry.advance_sigma_m.is_some() {
                return Err(reader.mixed(entry));
            }
            let run = reader.run(entry, recording)?;
            let real_path = reader.real_path(recording, &run)?;
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
                return Err(reader.invalid(recording.span(), &problem, "list each recording once"));
            }
            runs.push((run, real_path));
        }
        Ok(Self {
            file: path.to_path_buf(),
            worm,
            config,
            config_text,
            runs: runs.into_iter().map(|(run, _)| run).collect(),
            advances,
        })
    }

    /// Opens all recordings, in the order of the runs, reporting to `progress` which fraction was read, 0 to 1.
    ///
    /// # Errors
    /// [`CampaignError`] for the first recording that cannot be used or has another number of cells than the worm.
    pub fn open_all(
        &self,
        options: &OpenOptions,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Vec<Recording>, CampaignError> {
        let options = &OpenOptions {
            cells: Some(self.config.worm.cells),
            ..options.clone()
        };
        let count = self.runs.len() as f64;
        let mut recordings: Vec<Recording> = Vec::with_capacity(self.runs.len());
        for (number, run) in self.runs.iter().enumerate() {
            let mut one = |fraction: f64| progress((number as f64 + fraction) / count);
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
            problem: abridged(problem.to_owned(), MAX_TEXT_LEN),
            remedy: abridged(remedy.to_owned(), MAX_TEXT_LEN),
        }
    }

    /// A path relative to the campaign's file.
    fn beside(&self, path: &Path) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(path)
    }

    /// The worm's configuration. A device or a pipe in its place may never end.
    fn worm(&self, worm: &Spanned<PathBuf>) -> Result<PathBuf, CampaignError> {
        let path = self.beside(worm.get_ref());
        let length = path.as_os_str().len();
        if length > MAX_PATH_LEN {
            let problem = format!("a path of {length} bytes");
            return Err(self.invalid(worm.span(), &problem, "give the worm's configuration file"));
        }
        match path.metadata() {
            Ok(metadata) if !metadata.is_file() => {
                let problem = format!("{} is not a file", path.display());
                Err(self.invalid(worm.span(), &problem, "give the worm's configuration file"))
            }
            _ => Ok(path),
        }
    }

    fn run(&self, entry: &RunEntry, recording: &Spanned<PathBuf>) -> Result<CampaignRun, CampaignError> {
        let (slope_deg, payload_kg, cycle_s) = self.conditions(entry)?;
        Ok(CampaignRun {
            recording: self.beside(recording.get_ref()),
            slope_deg,
            payload_kg,
            cycle_s,
        })
    }

    /// Slope in degrees, payload in kg, and time of a cycle in s.
    fn conditions(&self, entry: &RunEntry) -> Result<(f64, f64, Option<f64>), CampaignError> {
        let payload_kg = entry.payload_kg.as_ref();
        let payload_kg = payload_kg.map(|value| self.within("payload_kg", value, PAYLOADS_KG, "kg"));
        let cycle_s = entry.cycle_s.as_ref();
        let cycle_s = cycle_s.map(|value| self.within("cycle_s", value, CYCLES_S, "s"));
        Ok((
            self.within("slope_deg", &entry.slope_deg, SLOPES_DEG, "degrees")?,
            payload_kg.transpose()?.unwrap_or(0.0),
            cycle_s.transpose()?,
        ))
    }

    /// A run without a recording.
    fn advance(&self, entry: &RunEntry, stroke_m: f64) -> Result<Advance, CampaignError> {
        let (slope_deg, payload_kg, cycle_s) = self.conditions(entry)?;
        let (Some(advance_m), Some(sigma_m)) = (&entry.advance_m, &entry.advance_sigma_m) else {
            let (problem, remedy) = match &entry.advance_m {
                Some(_) => (
                    "an advance without its standard error",
                    "add advance_sigma_m, in m: without it a gap cannot be told from chance",
                ),
                None => (
                    "a run without recording or advance",
                    "give recording = \"FILE\", or advance_m and advance_sigma_m where no positions were recorded",
                ),
            };
            return Err(self.invalid(entry.slope_deg.span(), problem, remedy));
        };
        let unit = "m, no more than a stroke";
        Ok(Advance {
            slope_deg,
            payload_kg,
            cycle_s,
            advance_m: self.within("advance_m", advance_m, -stroke_m..=stroke_m, unit)?,
            sigma_m: self.within("advance_sigma_m", sigma_m, MIN_SIGMA_M..=stroke_m, unit)?,
        })
    }

    fn mixed(&self, entry: &RunEntry) -> CampaignError {
        let problem = "recordings and advances in one campaign";
        let remedy = "list recordings only, which say more, or advances only: a recording's advance is in it";
        self.invalid(entry.slope_deg.span(), problem, remedy)
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

    /// The canonical path of a recording.
    fn real_path(&self, recording: &Spanned<PathBuf>, run: &CampaignRun) -> Result<PathBuf, CampaignError> {
        run.recording.canonicalize().map_err(|error| {
            let problem = format!("{}: {error}", run.recording.display());
            let remedy = "give the recording's path relative to the campaign's file";
            self.invalid(recording.span(), &problem, remedy)
        })
    }
}

#[cfg(test)]
mod tests;
