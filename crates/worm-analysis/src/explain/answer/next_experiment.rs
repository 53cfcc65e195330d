//! The experiment that would decide.

use serde::Serialize;

/// What a run may change against the runs of the campaign.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum RunChange {
    /// Slope of the canal, degrees.
    #[serde(rename = "slope_deg")]
    Slope,
    /// Time of a gait cycle, s.
    #[serde(rename = "cycle_s")]
    Cycle,
    /// Where the worm starts along the canal, as a shift, m.
    #[serde(rename = "start_m")]
    Start,
    /// Known extra mass, kg.
    #[serde(rename = "payload_kg")]
    Payload,
    /// Number of gait cycles.
    #[serde(rename = "cycles")]
    Cycles,
    /// Rest after each gait cycle, s.
    #[serde(rename = "dwell_s")]
    Dwell,
}

impl RunChange {
    /// Unit of its value; empty for none.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Slope => "deg",
            Self::Cycle | Self::Dwell => "s",
            Self::Start => "m",
            Self::Payload => "kg",
            Self::Cycles => "",
        }
    }
}

/// What the next experiment changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum ExperimentChange {
    /// One condition of a run.
    Run(RunChange),
    /// Nothing: a measurement on the bench, in words.
    Measurement(&'static str),
}

/// A proposal for the next experiment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NextExperiment {
    /// What to change, or to measure.
    pub change: ExperimentChange,
    /// The new value; none for a measurement.
    pub value: Option<f64>,
    /// Unit of the value.
    pub unit: String,
    /// Slope of the run to make, degrees; that of the run to repeat where something else is changed. None for a measurement.
    pub slope_deg: Option<f64>,
    /// In words, with how to do it.
    pub description: String,
    /// What each rival predicts.
    pub predictions: Vec<Prediction>,
    /// Expected distance between the two nearest predictions, in standard deviations.
    pub separation_sigma: Option<f64>,
}

/// What an effect predicts for an experiment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Prediction {
    /// The effect.
    pub effect: String,
    /// Advance per cycle that it predicts, m.
    pub advance_m: Option<f64>,
    /// In words.
    pub description: String,
}
