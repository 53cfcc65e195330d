//! Campaigns of a servo on a bench.
//!
//! ```toml
//! plant = "servo-bench"
//!
//! [bench]
//! mass_kg = 0.490
//! length_m = 0.100
//! arm_mass_kg = 0.0
//! supply_v = 7.4
//! duty_limit = 0.66               # 1 unless given
//! servo = "xl330-m288-t"          # or the file of a model, relative to this one
//!
//! [[run]]
//! recording = "sin_sin-p400.csv"
//! position_p_gain = 400
//! trajectory = "sin_sin"          # may be left out: runs with the same goals then count as one
//! ```

use super::model::{ServoModel, XL330, line_of};
use super::recording::ServoRecording;
use serde::Deserialize;
use std::ops::{Range, RangeInclusive};
use std::path::{Path, PathBuf};
use toml::Spanned;
use worm_estimator::config::read_text;
use worm_log::ReadError;
use worm_physics::servo::Pendulum;

const MASSES_KG: RangeInclusive<f64> = 1e-4..=100.0;
const LENGTHS_M: RangeInclusive<f64> = 1e-3..=10.0;
const ARM_MASSES_KG: RangeInclusive<f64> = 0.0..=100.0;
const SUPPLIES_V: RangeInclusive<f64> = 1.0..=60.0;
const DUTY_LIMITS: RangeInclusive<f64> = 0.01..=1.0;
/// Position P gain of the control table.
const GAINS: RangeInclusive<f64> = 1.0..=16_383.0;
/// Most runs.
const MAX_RUNS: usize = 200;
const REMEDY: &str = "a campaign of a servo holds plant = \"servo-bench\", [bench] with mass_kg, length_m, arm_mass_kg, supply_v and servo, \
                      and [[run]] with recording and position_p_gain";

/// What a campaign is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Plant {
    /// A worm.
    Worm,
    /// A servo on a bench.
    ServoBench,
}

/// A servo on a bench, with its recordings.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchCampaign {
    /// The file it comes from.
    pub file: PathBuf,
    /// What the servo moves.
    pub pendulum: Pendulum,
    /// Voltage of the supply without load, V.
    pub supply_v: f64,
    /// Greatest duty of the servo, in (0, 1].
    pub duty_limit: f64,
    /// The nominal servo.
    pub model: ServoModel,
    /// The text of the nominal servo's file; none for one that is known by name.
    pub model_text: Option<String>,
    /// The runs.
    pub runs: Vec<BenchRun>,
}

/// A recording on the bench.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchRun {
    /// The recording's file.
    pub recording: PathBuf,
    /// Position P gain of the control table.
    pub gain: f64,
    /// Name of the goal's course; runs of the same one are left out together. None where the goals tell.
    pub trajectory: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    plant: Spanned<String>,
    bench: Option<Spanned<Bench>>,
    #[serde(default)]
    run: Vec<Run>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Bench {
    mass_kg: Option<Spanned<f64>>,
    length_m: Option<Spanned<f64>>,
    arm_mass_kg: Option<Spanned<f64>>,
    supply_v: Option<Spanned<f64>>,
    duty_limit: Option<Spanned<f64>>,
    servo: Option<Spanned<String>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Run {
    recording: Spanned<PathBuf>,
    position_p_gain: Option<Spanned<f64>>,
    trajectory: Option<String>,
}

/// What the campaign in a text is of: a worm unless it says otherwise. A text that is no TOML is left to the reader of a worm's campaigns.
///
/// # Errors
/// [`ReadError`] for a plant that nobody knows.
pub fn plant_of(text: &str, path: &Path) -> Result<Plant, ReadError> {
    #[derive(Deserialize)]
    struct Head {
        plant: Option<Spanned<toml::Value>>,
    }
    let head: Option<Head> = toml::from_str(text).ok();
    let Some(plant) = head.and_then(|head| head.plant) else {
        return Ok(Plant::Worm);
    };
    match plant.get_ref().as_str() {
        Some("worm") => Ok(Plant::Worm),
        Some("servo-bench") => Ok(Plant::ServoBench),
        _ => Err(ReadError::at(
            path,
            format!("line {}", line_of(text, plant.span().start)),
            format!("plant = {}", plant.get_ref()),
            "give \"worm\", or \"servo-bench\" for a servo on a bench",
        )),
    }
}

impl BenchCampaign {
    /// Reads and checks a campaign and its nominal servo; [`open_all`](Self::open_all) reads the recordings. Paths in it are relative to it.
    ///
    /// # Errors
    /// [`ReadError`] with the line for an unknown key, a missing or impossible value, and a recording that is listed twice.
    pub fn load(path: &Path) -> Result<Self, ReadError> {
        let text = read_text(path).map_err(|error| ReadError::whole(path, error.to_string(), REMEDY))?;
        Self::from_toml(&text, path)
    }

    /// As [`load`](Self::load), from a text; errors call it `path`.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn from_toml(text: &str, path: &Path) -> Result<Self, ReadError> {
        let reader = Reader { text, path };
        let file: File = toml::from_str(text)
            .map_err(|error| reader.invalid(error.span().unwrap_or(0..0), error.message().trim(), REMEDY))?;
        if file.plant.get_ref() != "servo-bench" {
            let problem = format!("plant = \"{}\"", file.plant.get_ref());
            return Err(reader.invalid(file.plant.span(), problem, "give \"servo-bench\""));
        }
        let Some(bench) = file.bench else {
            return Err(reader.invalid(0..0, "there is no [bench] in it", REMEDY));
        };
        let at = bench.span();
        let bench = bench.into_inner();
        let needed = |key: &str, value: &Option<Spanned<f64>>, range: RangeInclusive<f64>, unit: &str, what: &str| {
            let Some(value) = value else {
                let problem = format!("[bench] has no {key}");
                return Err(reader.invalid(at.clone(), problem, format!("give {what}, in {unit}")));
            };
            reader.within(key, value, range, unit)
        };
        let pendulum = Pendulum {
            mass_kg: needed(
                "mass_kg",
                &bench.mass_kg,
                MASSES_KG,
                "kg",
                "the mass at the end of the arm",
            )?,
            length_m: needed(
                "length_m",
                &bench.length_m,
                LENGTHS_M,
                "m",
                "the length from the shaft to that mass",
            )?,
            arm_mass_kg: match &bench.arm_mass_kg {
                Some(mass_kg) => reader.within("arm_mass_kg", mass_kg, ARM_MASSES_KG, "kg")?,
                None => 0.0,
            },
            zero_rad: 0.0,
        };
        let supply_v = needed(
            "supply_v",
            &bench.supply_v,
            SUPPLIES_V,
            "V",
            "the voltage of the supply without load",
        )?;
        let duty_limit = match &bench.duty_limit {
            Some(limit) => reader.within("duty_limit", limit, DUTY_LIMITS, "(goal PWM over 885)")?,
            None => 1.0,
        };
        let (model, model_text) = reader.servo(bench.servo.as_ref())?;
        if file.run.is_empty() || file.run.len() > MAX_RUNS {
            let problem = format!("{} runs", file.run.len());
            return Err(reader.invalid(0..0, problem, format!("list 1 to {MAX_RUNS} [[run]]: {REMEDY}")));
        }
        let mut runs: Vec<BenchRun> = Vec::with_capacity(file.run.len());
        for run in file.run {
            let Some(gain) = &run.position_p_gain else {
                let remedy = "give the servo's position P gain in this run: without it its loop is not known";
                return Err(reader.invalid(run.recording.span(), "a run without position_p_gain", remedy));
            };
            let gain = reader.within("position_p_gain", gain, GAINS, "(register 84)")?;
            let recording = reader.beside(run.recording.get_ref());
            if runs.iter().any(|other| other.recording == recording) {
                let problem = format!("{} is listed twice", recording.display());
                return Err(reader.invalid(run.recording.span(), problem, "list each recording once"));
            }
            runs.push(BenchRun {
                recording,
                gain,
                trajectory: run.trajectory,
            });
        }
        Ok(Self {
            file: path.to_path_buf(),
            pendulum,
            supply_v,
            duty_limit,
            model,
            model_text,
            runs,
        })
    }

    /// Opens all recordings, in the order of the runs.
    ///
    /// # Errors
    /// [`ReadError`] for the first that cannot be used.
    pub fn open_all(&self) -> Result<Vec<ServoRecording>, ReadError> {
        self.runs
            .iter()
            .map(|run| ServoRecording::open(&run.recording))
            .collect()
    }
}

struct Reader<'f> {
    text: &'f str,
    path: &'f Path,
}

impl Reader<'_> {
    fn invalid(&self, at: Range<usize>, problem: impl Into<String>, remedy: impl Into<String>) -> ReadError {
        let line = line_of(self.text, at.start);
        ReadError::at(self.path, format!("line {line}"), problem, remedy)
    }

    fn within(
        &self,
        key: &str,
        value: &Spanned<f64>,
        range: RangeInclusive<f64>,
        unit: &str,
    ) -> Result<f64, ReadError> {
        if range.contains(value.get_ref()) {
            return Ok(*value.get_ref());
        }
        let problem = format!("{key} = {}", value.get_ref());
        let remedy = format!("must be from {} to {} {unit}", range.start(), range.end());
        Err(self.invalid(value.span(), problem, remedy))
    }

    /// A path relative to the campaign's file.
    fn beside(&self, path: &Path) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(path)
    }

    /// The nominal servo: one that is known by name, or a model's file.
    fn servo(&self, servo: Option<&Spanned<String>>) -> Result<(ServoModel, Option<String>), ReadError> {
        let Some(servo) = servo else {
            return Ok((ServoModel::xl330_m288_t(), None));
        };
        if servo.get_ref().eq_ignore_ascii_case(XL330) {
            return Ok((ServoModel::xl330_m288_t(), None));
        }
        if !servo.get_ref().ends_with(".toml") {
            let problem = format!("servo = \"{}\" is not known", servo.get_ref());
            let remedy = format!("give \"{XL330}\", or the file of a servo's model (model.toml)");
            return Err(self.invalid(servo.span(), problem, remedy));
        }
        let path = self.beside(Path::new(servo.get_ref()));
        let text = read_text(&path)
            .map_err(|error| ReadError::whole(&path, error.to_string(), "give the file of a servo's model"))?;
        Ok((ServoModel::from_toml(&text, &path)?, Some(text)))
    }
}
