//! The result of the search on a servo: its JSON contract, with the names of a worm's answer where they mean the same.

use crate::bench::ServoModel;
use crate::explain::answer::{Calibrated, FoundLaw, NamedEffect, Screened, StageKind, Verdict};
use crate::recording::Repair;
use serde::{Deserialize, Serialize};

/// The whole answer.
#[derive(Debug, Clone, Serialize)]
pub struct ServoAnswer {
    /// `servo-bench`.
    pub plant: &'static str,
    /// The verdict.
    pub verdict: Verdict,
    /// The verdict in a sentence or two.
    pub sentence: String,
    /// The effects that explain the data: one, or a pair that acts together; empty unless explained or ambiguous.
    pub effects: Vec<NamedEffect>,
    /// Others that explain them about as well, best first.
    pub rivals: Vec<NamedEffect>,
    /// Where the recalibrated model's friction is wrong, most significant first.
    pub r#where: Vec<FrictionPlace>,
    /// The gap, stage by stage.
    #[serde(rename = "gap")]
    pub stages: Vec<ServoStage>,
    /// A law that nobody listed, where no effect of the library explains the data and one predicts what it was not fitted to.
    pub law: Option<FoundLaw>,
    /// What is left, where nothing explains it.
    pub remainder: Option<FrictionRemainder>,
    /// The run that would best decide between what is left open.
    pub next_experiment: Option<NextRun>,
    /// The recalibrated model.
    pub calibration: Vec<Calibrated>,
    /// What of it is far from the stated value, so that something else that was stated may be wrong.
    pub far_off: Vec<FarOff>,
    /// The screening of the whole library, most significant first.
    pub screening: Vec<Screened>,
    /// Improvement that the best of the whole library stays below in 99 of a hundred servos without an effect, drawn for this campaign.
    pub threshold: f64,
    /// Probability that no effect is missing that changes what matters: the posterior one, less what recalibration can hide.
    pub null_probability: f64,
    /// Probability that something else is missing, alone or beside an effect: the posterior one, less effects that are unlike their laws.
    pub other_probability: f64,
    /// The mean absolute error of the answer's model is on no run larger than this, rad: as fitted.
    pub agrees_within_rad: f64,
    /// Standard deviation that any model is taken to be wrong by, rad.
    pub discrepancy_rad: f64,
    /// What the reported current measures.
    pub current: PresentCurrent,
    /// The supply as its voltages show it; none where they were not recorded.
    pub supply: Option<Supply>,
    /// The recordings.
    pub runs: Vec<ServoRun>,
    /// Limitations of this answer.
    pub warnings: Vec<String>,
    /// Nothing is repaired in a servo's recording.
    pub repairs: Vec<Repair>,
    /// Series and maps for figures; not part of the JSON.
    #[serde(skip)]
    pub figures: ServoFigures,
}

/// A recalibrated value that is far from what was stated.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FarOff {
    /// What it is, as in the calibration.
    pub name: String,
    /// How far it is off, as a fraction of the stated value; `NaN` where that is 0.
    pub change: f64,
    /// The same in standard deviations of its prior.
    pub prior_sigmas: f64,
    /// The same in standard errors.
    pub standard_errors: f64,
    /// In words, with what to check.
    pub description: String,
}

/// Where friction is not the model's: a range of speed and load.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrictionPlace {
    /// Speed, from and to, rad/s.
    pub speed_rad_s: [f64; 2],
    /// Torque on the gears, the mean of both their ends, from and to, N m.
    pub load_n_m: [f64; 2],
    /// Friction by the torque balance beyond the model's, N m.
    pub residual_n_m: f64,
    /// That in standard errors, by the scatter of seconds.
    pub significance: f64,
    /// The trajectory and the gain that show it most.
    pub trajectory: String,
    /// See `trajectory`.
    pub position_p_gain: f64,
}

/// One stage of the shrinking gap.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ServoStage {
    /// Which one.
    pub stage: StageKind,
    /// The effect, where the stage has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub effect: Option<String>,
    /// Mean over the runs of the mean absolute error of the positions, as fitted, rad.
    pub fit_mean_absolute_error_rad: f64,
    /// Root mean square of the positions' residual, as fitted, rad.
    pub fit_rms_rad: f64,
    /// The same on trajectories and gains that it was not fitted to, rad.
    pub held_out_rms_rad: f64,
    /// 90 % interval of that, by the scatter of seconds, rad.
    pub held_out_interval_rad: [f64; 2],
    /// Mean absolute error of runs whose trajectory it was not fitted to, rad.
    pub without_trajectory_mean_absolute_error_rad: Option<f64>,
    /// Mean absolute error of runs whose gain it was not fitted to, rad.
    pub without_gain_mean_absolute_error_rad: Option<f64>,
}

/// What no effect explains.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrictionRemainder {
    /// In words.
    pub description: String,
    /// Fraction of the gap that stays open after the best effect.
    pub open_share: f64,
    /// Where friction is still wrong.
    pub places: Vec<FrictionPlace>,
}

/// A proposal for the next run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NextRun {
    /// What to change: `position_p_gain`, or `mass_kg`.
    pub change: &'static str,
    /// The new value.
    pub value: f64,
    /// Its unit; empty for none.
    pub unit: &'static str,
    /// The trajectory to run.
    pub trajectory: String,
    /// In words.
    pub description: String,
    /// What each rival predicts.
    pub predictions: Vec<RunPrediction>,
    /// Distance between the two nearest predictions, in standard deviations of noise and discrepancy.
    pub separation_sigma: f64,
}

/// What an effect predicts for a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunPrediction {
    /// The effect.
    pub effect: String,
    /// Largest angle that it predicts, rad.
    pub largest_angle_rad: f64,
    /// In words.
    pub description: String,
}

/// What a servo reports as its present current.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Measures {
    /// The current in the winding.
    Winding,
    /// The current from the supply, with the sign of the motion.
    Supply,
    /// No current: the duty, in steps of the largest PWM value.
    Duty,
}

impl Measures {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Winding, Self::Supply, Self::Duty];

    /// In words.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Winding => "the current in the winding",
            Self::Supply => "the current from the supply",
            Self::Duty => "the duty of the bridge and no current at all",
        }
    }
}

/// What the reported current measures, and how sure that is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PresentCurrent {
    /// The most probable; none where the recordings cannot tell.
    pub measures: Option<Measures>,
    /// Its probability.
    pub probability: f64,
    /// All that were weighed, most probable first.
    pub hypotheses: Vec<CurrentHypothesis>,
    /// Logarithm of the odds of the winding against the supply, whatever a third would say.
    pub ln_odds_winding_over_supply: f64,
    /// In words.
    pub sentence: String,
}

/// How one reading of the current does.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CurrentHypothesis {
    /// What would be measured.
    pub measures: Measures,
    /// Root mean square of what it leaves, A.
    pub rms_a: f64,
    /// Logarithm of its odds against the most probable.
    pub ln_odds: f64,
}

/// The supply as the reported voltages show it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Supply {
    /// Voltage without load, V.
    pub unloaded_v: f64,
    /// Resistance, Ω.
    pub ohm: f64,
    /// Its standard error, Ω.
    pub sigma_ohm: f64,
}

/// A run of the campaign.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ServoRun {
    /// Where it comes from.
    pub recording: String,
    /// Its goals' course.
    pub trajectory: String,
    /// Position P gain.
    pub position_p_gain: f64,
    /// Readings.
    pub readings: usize,
    /// Duration, s.
    pub duration_s: f64,
    /// Mean absolute error of the positions, rad: of the nominal, the recalibrated, and the named model or the one with the law, where there
    /// is one.
    pub mean_absolute_error_rad: [f64; 3],
    /// Electrical energy, J, by the recalibrated and by the named model or the one with the law.
    pub electrical_j: [f64; 2],
}

/// What the page draws, beyond the JSON.
#[derive(Debug, Clone)]
pub struct ServoFigures {
    /// Friction by the torque balance, and the model's, before and after; the second empty where nothing is named.
    pub map_before: Vec<FrictionCell>,
    /// See `map_before`.
    pub map_after: Vec<FrictionCell>,
    /// Each run: time, s, and positions, rad: goal, measured, recalibrated, by the named model or the law (empty without one).
    pub runs: Vec<RunSeries>,
    /// The servo's model with the answer in it.
    pub model: ServoModel,
    /// Difference of the model's text, as lines with ' ', '-' or '+' before them.
    pub model_diff: Vec<String>,
}

/// Friction in a range of speed and load.
#[derive(Debug, Clone, PartialEq)]
pub struct FrictionCell {
    /// Speed, from and to, rad/s.
    pub speed_rad_s: [f64; 2],
    /// Load, from and to, N m; and its mean.
    pub load_n_m: [f64; 2],
    /// See `load_n_m`.
    pub mean_load_n_m: f64,
    /// By the torque balance, with its standard error, and by the model, N m.
    pub measured_n_m: f64,
    /// See `measured_n_m`.
    pub sigma_n_m: f64,
    /// See `measured_n_m`.
    pub model_n_m: f64,
    /// The run that shows most of it.
    pub run: usize,
}

/// One run for a figure.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RunSeries {
    /// Name of the run.
    pub name: String,
    /// s.
    pub time_s: Vec<f64>,
    /// rad.
    pub goal_rad: Vec<f64>,
    /// rad.
    pub measured_rad: Vec<f64>,
    /// rad.
    pub recalibrated_rad: Vec<f64>,
    /// rad.
    pub named_rad: Vec<f64>,
}
