//! How well the search names what is hidden: every case of a split, and the score table.
//!
//! ```text
//! cargo bench --bench explain_benchmark -- --split development|test [--only EFFECT] [--cases N] [--csv FILE]
//! ```
//! Without `--split` a few cases of the development split are run. `WORMD_CASES` scales how many there are of each kind.

#[path = "../tests/hidden/mod.rs"]
mod hidden;

use clap::Parser;
use hidden::campaign::HiddenCampaign;
use hidden::repeat::{Condition, ExtraRun};
use hidden::split::{Case, Split, scale_wanted, split};
use hidden::table::Table;
use hidden::verdict::{Answer, Estimate, Explainer, Judgement, Named, Proposal, Screened, Verdict, judge};
use std::fs::File;
use std::panic::{self, AssertUnwindSafe};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Instant;
use wormd::experiment::Run;
use wormd::explain;

/// Threads that explain cases side by side.
const THREADS: usize = 2;
/// Cases that are run when no split is asked for.
const FEW: usize = 4;
/// Standard errors to either end of a 90 % interval.
const NINETY_PERCENT: f64 = 1.645;

#[derive(Debug, Parser)]
#[command(about = "Runs the search for the missing effect on campaigns in which one is hidden, and scores it.")]
struct Order {
    /// Which cases: development or test; absent: a few of development.
    #[arg(long, value_parser = |name: &str| Split::named(name).ok_or("must be development or test"))]
    split: Option<Split>,
    /// Only these: an effect, clean, outside, pair or twin.
    #[arg(long, value_parser = |name: &str| Case::words().find(|word| *word == name).ok_or("must be an effect, clean, outside, pair or twin"))]
    only: Option<&'static str>,
    /// At most so many cases, spread evenly over the split.
    #[arg(long)]
    cases: Option<usize>,
    /// Writes a row for every case to this file.
    #[arg(long)]
    csv: Option<PathBuf>,
    /// What `cargo bench` says of itself.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> ExitCode {
    let order = Order::parse();
    let mut cases = split(order.split.unwrap_or(Split::Development), scale_wanted());
    if let Some(only) = order.only {
        cases.retain(|case| case.what() == only);
    }
    let few = order.split.is_none().then_some(FEW);
    if let Some(most) = order.cases.or(few) {
        cases = spread(&cases, most);
    }
    let judgements = judge_all(&cases);
    println!("\n{}", Table(&judgements));
    let Some(path) = &order.csv else {
        return ExitCode::SUCCESS;
    };
    let written = File::create(path)
        .map_err(csv::Error::from)
        .and_then(|file| Table(&judgements).write_csv(file));
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!(
                "{}: cannot be written: {problem}: name a file in a folder that is there",
                path.display()
            );
            ExitCode::FAILURE
        }
    }
}

/// So many cases, as far from each other as they can be.
fn spread(cases: &[Case], most: usize) -> Vec<Case> {
    let count = most.min(cases.len());
    (0..count).map(|place| cases[place * cases.len() / count]).collect()
}

/// Judges every case, in the order given, and prints a line for each as it comes.
fn judge_all(cases: &[Case]) -> Vec<Judgement> {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let Some(case) = cases.get(number) else {
                return done;
            };
            let begun = Instant::now();
            let campaign = case.draw();
            let judgement = judge(&campaign, &Library);
            let seconds = begun.elapsed().as_secs_f64();
            println!("{:>3}/{} {} {seconds:.1} s", number + 1, cases.len(), judgement.line());
            done.push((number, judgement));
        }
    };
    let mut all: Vec<(usize, Judgement)> = thread::scope(|scope| {
        let workers: Vec<_> = (0..THREADS).map(|_| scope.spawn(work)).collect();
        let done = workers.into_iter().map(|worker| worker.join());
        done.flat_map(|done| done.unwrap_or_else(|cause| panic::resume_unwind(cause)))
            .collect()
    });
    all.sort_by_key(|(number, _)| *number);
    all.into_iter().map(|(_, judgement)| judgement).collect()
}

/// The library's own search.
struct Library;

impl Explainer for Library {
    fn explain(&self, campaign: &HiddenCampaign, extra: &[ExtraRun]) -> Result<Answer, String> {
        Ok(scored(&search(campaign, extra)?, campaign))
    }
}

/// Has the library explain the runs of a campaign and those that were proposed. A case on which it panics is one more case
/// without an answer, and not the end of the others.
fn search(campaign: &HiddenCampaign, extra: &[ExtraRun]) -> Result<explain::Answer, String> {
    let own = campaign.recordings.iter().zip(&campaign.slopes_deg);
    let own = own.map(|(recording, &slope_deg)| Run {
        recording,
        slope_deg,
        payload_kg: 0.0,
        cycle_s: Some(campaign.cycle_s),
    });
    let proposed = extra.iter().map(|extra| Run {
        recording: &extra.recording,
        slope_deg: extra.condition.slope_deg,
        payload_kg: extra.condition.payload_kg,
        // The time that the motor takes for a turn, rests left out.
        cycle_s: Some(extra.condition.cycle_s),
    });
    let runs: Vec<Run> = own.chain(proposed).collect();
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
    Proposal::Run(match next.change.as_str() {
        "slope_deg" => Condition {
            slope_deg: value,
            ..usual
        },
        "cycle_s" => Condition {
            cycle_s: value,
            ..usual
        },
        "payload_kg" => Condition {
            payload_kg: value,
            ..usual
        },
        "start_m" => Condition {
            start_shift_m: begun_m(campaign, slope_deg) + value,
            ..usual
        },
        "cycles" => Condition { cycles: value, ..usual },
        "dwell_s" => Condition {
            dwell_s: value,
            ..usual
        },
        _ => return Proposal::Measurement,
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
    let ways_m: Vec<f64> = from_its_place_m
        .filter_map(|(cell, series_m)| {
            let first_m = series_m.iter().find(|at_m| at_m.is_finite())?;
            Some(first_m + campaign.worm.make.spacing_m * cell as f64)
        })
        .collect();
    ways_m.iter().sum::<f64>() / ways_m.len() as f64
}
