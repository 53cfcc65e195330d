//! The library's own search, called as its user would, and the scored part of its answer.

use super::answer::{Answer, Proposal};
use super::assessment::Explainer;
use super::campaign::HiddenCampaign;
use super::follow_up::{Condition, ExtraRun};
use std::panic::{self, AssertUnwindSafe};
use worm_analysis::experiment::RecordedRun;
use worm_analysis::explain;
use worm_analysis::explain::answer::{ExperimentChange, RunChange};
use worm_analysis::recording::{OpenOptions, Recording};

/// The library's own search.
pub struct Library;

impl Explainer for Library {
    fn explain(&self, campaign: &HiddenCampaign, extra: &[ExtraRun]) -> Result<Answer, String> {
        scored(&search(campaign, extra)?, campaign)
    }
}

/// Has the library explain the runs of a campaign and those that were proposed. A case on which it panics counts
/// as one without an answer.
fn search(campaign: &HiddenCampaign, extra: &[ExtraRun]) -> Result<explain::Answer, String> {
    // What is wrong with a capture is repaired or refused, as when it is read from a file.
    let checked = campaign.recordings.iter().cloned();
    let checked: Vec<Recording> = checked
        .map(|recording| recording.checked(&OpenOptions::default()))
        .collect::<Result<_, _>>()
        .map_err(|problem| problem.to_string())?;
    let mut runs = campaign.runs(&checked);
    runs.extend(extra.iter().map(|extra| RecordedRun {
        recording: &extra.recording,
        slope_deg: extra.condition.slope_deg,
        payload_kg: extra.condition.payload_kg,
        // The time that the motor takes for a turn, rests left out.
        cycle_s: Some(extra.condition.cycle_s),
    }));
    let options = explain::Options::default();
    let answer = || explain::explain(&runs, &campaign.config, &options, &mut |_| ());
    panic::catch_unwind(AssertUnwindSafe(answer))
        .map_err(|_| "the search panicked".to_owned())?
        .map_err(|problem| problem.to_string())
}

/// The scored part of the library's answer, read from the JSON that it prints.
fn scored(answer: &explain::Answer, campaign: &HiddenCampaign) -> Result<Answer, String> {
    let report = serde_json::to_value(answer).map_err(|problem| problem.to_string())?;
    Ok(Answer {
        proposal: answer.next_experiment.as_ref().map(|next| proposal(next, campaign)),
        ..Answer::from_json(&report)?
    })
}

/// The proposed run as the campaign's experimenter would make it: on the slope that the proposal names, as usual but for one
/// change.
fn proposal(next: &explain::answer::NextExperiment, campaign: &HiddenCampaign) -> Proposal {
    let (Some(value), Some(slope_deg)) = (next.value, next.slope_deg) else {
        return Proposal::Measurement;
    };
    let usual = campaign.usual(slope_deg);
    Proposal::Run(match next.change {
        ExperimentChange::Run(RunChange::Slope) => Condition {
            slope_deg: value,
            ..usual
        },
        ExperimentChange::Run(RunChange::Cycle) => Condition {
            cycle_s: value,
            ..usual
        },
        ExperimentChange::Run(RunChange::Payload) => Condition {
            payload_kg: value,
            ..usual
        },
        ExperimentChange::Run(RunChange::Start) => Condition {
            start_shift_m: begun_m(campaign, slope_deg) + value,
            ..usual
        },
        ExperimentChange::Run(RunChange::Cycles) => Condition { cycles: value, ..usual },
        ExperimentChange::Run(RunChange::Dwell) => Condition {
            dwell_s: value,
            ..usual
        },
        ExperimentChange::Measurement(_) => return Proposal::Measurement,
    })
}

/// How far up the canal the worm lay where the recording on a slope begins, m: a worm that was recorded from mid-crawl had crawled there,
/// and a start further up counts from there.
fn begun_m(campaign: &HiddenCampaign, slope_deg: f64) -> f64 {
    let repeated = campaign
        .slopes_deg
        .iter()
        .position(|&deg| deg == slope_deg)
        .unwrap_or(0);
    let from_its_place_m = campaign.recordings[repeated].position_m.iter().enumerate();
    let displacements_m: Vec<f64> = from_its_place_m
        .filter_map(|(cell, series_m)| {
            let first_m = series_m.iter().find(|at_m| at_m.is_finite())?;
            Some(first_m + campaign.worm.parameters.spacing_m * cell as f64)
        })
        .collect();
    displacements_m.iter().sum::<f64>() / displacements_m.len() as f64
}
