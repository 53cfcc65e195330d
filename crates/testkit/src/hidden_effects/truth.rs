//! What is true of a campaign, as `truth.json` beside it has it.
//!
//! Every test bed writes the same file, in whatever language, and one score reads it. Cells count from 1 in the file and
//! from 0 here.

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;

/// Significance from which an effect counts as strong, standard deviations of what hides it.
pub const STRONG_SIGMA: f64 = 8.0;
/// Change of advance or energy from which it does, relative; both must be reached.
pub const STRONG_IMPACT: f64 = 0.05;
/// Change of advance and energy below which an effect need not be named, relative.
pub const NEGLIGIBLE_IMPACT: f64 = 0.02;

/// What a campaign tests.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CampaignKind {
    /// Nothing is hidden.
    Clean,
    /// One effect of the library.
    Single,
    /// Something that the library does not know.
    Stranger,
    /// Two effects of different classes.
    Pair,
    /// Three.
    Triple,
    /// One of two that no position data can separate.
    Twin,
    /// One effect that begins in mid-run.
    Onset,
    /// One effect that begins in mid-run and ends again.
    Spell,
}

/// An effect as it truly is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrueEffect {
    /// Its name in the library; another name where the library has none for it.
    pub name: String,
    /// The cell that it sits in, from 0, where it sits in one.
    #[serde(serialize_with = "cell_to_file", deserialize_with = "cell_from_file")]
    pub cell: Option<usize>,
    /// Its figures, by the library's names.
    pub parameters: BTreeMap<String, f64>,
    /// How clearly it shows by itself, standard deviations; 0 where that was not computed.
    #[serde(default)]
    pub sigma: f64,
}

fn cell_to_file<S: Serializer>(cell: &Option<usize>, to: S) -> Result<S::Ok, S::Error> {
    cell.map(|cell| cell + 1).serialize(to)
}

fn cell_from_file<'de, D: Deserializer<'de>>(from: D) -> Result<Option<usize>, D::Error> {
    let cell = Option::<usize>::deserialize(from)?;
    if cell == Some(0) {
        return Err(serde::de::Error::custom("cells count from 1"));
    }
    Ok(cell.map(|cell| cell - 1))
}

impl TrueEffect {
    pub fn new(name: &str, cell: Option<usize>, parameters: &[(&str, f64)]) -> Self {
        Self {
            name: name.to_owned(),
            cell,
            parameters: parameters
                .iter()
                .map(|&(name, value)| (name.to_owned(), value))
                .collect(),
            sigma: 0.0,
        }
    }

    /// Its cell, from 1, and its figures.
    pub fn in_words(&self) -> String {
        let cell = self.cell.map(|cell| format!("cell {}", cell + 1));
        let figures = self
            .parameters
            .iter()
            .map(|(name, value)| format!("{name} {value:.3e}"));
        cell.into_iter().chain(figures).collect::<Vec<_>>().join(", ")
    }
}

/// Where in a recording an effect begins.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TrueOnset {
    /// As the recording's own phase counts, cycles.
    pub gait_phase: f64,
    /// Gait cycles since the recording's start.
    pub cycle: f64,
    /// Time in the recording, s.
    pub time_s: f64,
    /// Where it ends again, gait cycles since the recording's start; none where it stays.
    #[serde(default)]
    pub until_cycle: Option<f64>,
}

/// One run of a campaign.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrueRun {
    /// As stated, degrees.
    pub slope_deg: f64,
    /// Whole cycles in the recording.
    pub cycles: usize,
    /// Change of the advance by what is hidden, over the advance without it or a quarter of the stroke, whichever is more.
    /// Of an effect that begins in mid-run, by the cycles after it.
    pub advance_change: f64,
    /// Change of the positive work of the actuators, over that without it.
    pub energy_change: f64,
    /// Root mean square of the change of the positions, m.
    pub position_change_m: f64,
    /// Where what is hidden begins; none where it is there from the start, or not at all in this run.
    pub onset: Option<TrueOnset>,
}

/// What is true of a campaign.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// The test bed.
    pub bed: String,
    pub split: String,
    /// Name of the campaign.
    pub case: String,
    pub kind: CampaignKind,
    pub seed: u64,
    pub cells: usize,
    pub cycle_s: f64,
    pub rate_hz: f64,
    /// Standard deviation of the white part of the camera's noise, m.
    pub noise_m: f64,
    /// Whether the cam's phase is recorded.
    pub with_phase: bool,
    /// What is hidden and unknown to the library.
    pub stranger: Option<String>,
    /// What is hidden and known to it.
    pub effects: Vec<TrueEffect>,
    /// How clearly all that is hidden shows, standard deviations.
    pub sigma: f64,
    /// The same for one cycle of those in which it is there.
    pub sigma_per_cycle: f64,
    /// Size of a discrepancy that was put in on purpose, m: root mean square that recalibration leaves of it; 0 for none.
    #[serde(default)]
    pub discrepancy_m: f64,
    /// What is wrong with the recordings, by name.
    #[serde(default)]
    pub artefacts: Vec<String>,
    pub runs: Vec<TrueRun>,
}

impl Truth {
    /// The largest change of advance or energy on any run, relative.
    pub fn impact(&self) -> f64 {
        let of_run = |run: &TrueRun| run.advance_change.max(run.energy_change);
        self.runs.iter().map(of_run).fold(0.0, f64::max)
    }

    /// Whether what is hidden must be found.
    pub fn is_strong(&self) -> bool {
        self.sigma >= STRONG_SIGMA && self.impact() >= STRONG_IMPACT
    }

    /// Significance of the effect that shows least, standard deviations; none of a worm without one.
    pub fn weakest_sigma(&self) -> Option<f64> {
        self.effects.iter().map(|effect| effect.sigma).min_by(f64::total_cmp)
    }

    /// Whether something is hidden in which nobody need be interested.
    pub fn is_negligible(&self) -> bool {
        self.impact() < NEGLIGIBLE_IMPACT
    }

    /// Whether it is a worm without an effect into which a discrepancy was put.
    pub fn is_discrepant(&self) -> bool {
        self.kind == CampaignKind::Clean && self.discrepancy_m > 0.0
    }

    /// The first onset in the order of the runs.
    pub fn onset(&self) -> Option<TrueOnset> {
        self.runs.iter().find_map(|run| run.onset)
    }
}
