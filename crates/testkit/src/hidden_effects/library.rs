//! The library's own search, asked as its user would ask it, and its answer as far as it is scored.

use super::assessment::{Answer, Estimate, Explainer, Named, Proposal, Screened, Verdict};
use super::campaign::HiddenCampaign;
use super::follow_up::{Condition, ExtraRun};
use std::panic::{self, AssertUnwindSafe};
use worm_analysis::experiment::RecordedRun;
use worm_analysis::explain;
use worm_analysis::explain::answer::{ExperimentChange, RunChange};

/// Standard errors to either end of a 90 % interval.
const NINETY_PERCENT: f64 = 1.645;

/// The library's own search.
pub struct Library;

impl Explainer for Library {
    fn explain(&self, campaign: &HiddenCampaign, extra: &[ExtraRun]) -> Result<Answer, String> {
        Ok(scored(&search(campaign, extra)?, campaign))
    }
}

/// Has the library explain the runs of a campaign and those that were proposed. A case on which it panics is one more case
/// without an answer, and not the end of the others.
fn search(campaign: &HiddenCampaign, extra: &[ExtraRun]) -> Result<explain::Answer, String> {
    let own = campaign.recordings.iter().zip(&campaign.slopes_deg);
    let own = own.map(|(recording, &slope_deg)| RecordedRun {
        recording,
        slope_deg,
        payload_kg: 0.0,
        cycle_s: Some(campaign.cycle_s),
    });
    let proposed = extra.iter().map(|extra| RecordedRun {
        recording: &extra.recording,
        slope_deg: extra.condition.slope_deg,
        payload_kg: extra.condition.payload_kg,
        // The time that the motor takes for a turn, rests left out.
        cycle_s: Some(extra.condition.cycle_s),
    });
    let runs: Vec<RecordedRun> = own.chain(proposed).collect();
    let options = explain::Options::default();
    let answer = || explain::explain(&runs, &campaign.config, &options, &mut |_| ());
    panic::catch_unwind(AssertUnwindSafe(answer))
        .map_err(|_| "the search panicked".to_owned())?
        .map_err(|problem| problem.to_string())
}

/// The library's answer as far as it is scored.
fn scored(answer: &explain::Answer, campaign: &HiddenCampaign) -> Answer {
    let first = answer.effects.first();
    Answer {
        verdict: match answer.verdict {
            explain::Verdict::Agrees => Verdict::Nothing,
            explain::Verdict::Explained => Verdict::Named,
            explain::Verdict::Ambiguous => Verdict::Ambiguous,
            explain::Verdict::OutsideLibrary => Verdict::Outside,
        },
        named: answer.effects.iter().map(named).collect(),
        rivals: answer.rivals.iter().map(named).collect(),
        screened: answer.screening.iter().map(screened).collect(),
        closure: first.map(|effect| effect.closure),
        margin: first.map(|effect| effect.margin),
        proposal: answer.next_experiment.as_ref().map(|next| proposal(next, campaign)),
    }
}

fn named(effect: &explain::answer::NamedEffect) -> Named {
    Named {
        name: effect.name.clone(),
        cell: effect.cell.map(|cell| cell - 1),
        twins: effect.twins.clone(),
        parameters: effect
            .parameters
            .iter()
            .map(|found| Estimate {
                name: found.name.clone(),
                value: found.value,
                low: found.value - NINETY_PERCENT * found.sigma,
                high: found.value + NINETY_PERCENT * found.sigma,
            })
            .collect(),
    }
}

fn screened(effect: &explain::answer::Screened) -> Screened {
    Screened {
        name: effect.name.clone(),
        cell: effect.cell.map(|cell| cell - 1),
        // Twice the log likelihood rises by the square of the standard deviations.
        sigma: effect.improvement.unwrap_or(effect.score).max(0.0).sqrt(),
    }
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

/// How far up the canal the worm lay where the recording on a slope begins, m: a worm under way had crawled there, and a start
/// further up is meant from there.
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
