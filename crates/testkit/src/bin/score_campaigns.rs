//! Scores a built `wormd` on a folder of campaigns of which the truth is known, whatever test bed wrote them.
//!
//! ```text
//! cargo run --release -p testkit --bin score_campaigns -- FOLDER --wormd target/release/wormd [--threads N] [--csv FILE] [--keep NAME]
//! cargo run --release -p testkit --bin score_campaigns -- FOLDER --answers NAME [--csv FILE]
//! ```
//! `--keep` leaves each answer's JSON beside its campaign, as NAME; `--answers` scores those that lie there, and leaves out
//! campaigns without one.

use std::collections::VecDeque;
use std::fs::File;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Mutex;
use std::thread;
use std::time::Instant;
use testkit::hidden_effects::assessment::Assessment;
use testkit::hidden_effects::folders::{CampaignFolder, campaigns};
use testkit::hidden_effects::table::ScoreTable;

const USAGE: &str =
    "usage: score_campaigns FOLDER (--wormd PROGRAM [--threads N] [--keep NAME] | --answers NAME) [--csv FILE]";

struct Arguments {
    folder: PathBuf,
    answers: Answers,
    threads: usize,
    csv: Option<PathBuf>,
}

/// Where the answers come from.
enum Answers {
    /// A built `wormd`, and the name under which each answer is kept.
    Program { wormd: PathBuf, keep: Option<String> },
    /// Files of this name beside the campaigns.
    Files(String),
}

fn main() -> ExitCode {
    match arguments().and_then(|arguments| score(&arguments)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("{problem}");
            ExitCode::from(2)
        }
    }
}

fn arguments() -> Result<Arguments, String> {
    let mut given: VecDeque<String> = std::env::args().skip(1).collect();
    let folder = given.pop_front().ok_or(USAGE)?;
    let (mut wormd, mut keep, mut files, mut csv, mut threads) = (None, None, None, None, 1);
    while let Some(option) = given.pop_front() {
        let value = given
            .pop_front()
            .ok_or_else(|| format!("{option} needs a value\n{USAGE}"))?;
        match option.as_str() {
            "--wormd" => wormd = Some(PathBuf::from(value)),
            "--keep" => keep = Some(value),
            "--answers" => files = Some(value),
            "--csv" => csv = Some(PathBuf::from(value)),
            "--threads" => threads = value.parse().map_err(|error| format!("--threads {value}: {error}"))?,
            _ => return Err(format!("unknown option {option}\n{USAGE}")),
        }
    }
    let answers = match (wormd, files) {
        (Some(wormd), None) => Answers::Program { wormd, keep },
        (None, Some(name)) => Answers::Files(name),
        _ => return Err(USAGE.to_owned()),
    };
    Ok(Arguments {
        folder: folder.into(),
        answers,
        threads,
        csv,
    })
}

fn score(arguments: &Arguments) -> Result<(), String> {
    let mut campaigns = campaigns(&arguments.folder)?;
    if let Answers::Files(name) = &arguments.answers {
        campaigns.retain(|campaign| campaign.path.join(name).is_file());
    }
    let count = campaigns.len();
    let waiting = Mutex::new(campaigns.into_iter().enumerate().collect::<VecDeque<_>>());
    let work = || {
        let next = || waiting.lock().ok().and_then(|mut waiting| waiting.pop_front());
        let mut done: Vec<(usize, Assessment)> = Vec::new();
        while let Some((number, campaign)) = next() {
            done.push((number, explain(&campaign, arguments, number + 1, count)));
        }
        done
    };
    let mut all: Vec<(usize, Assessment)> = thread::scope(|scope| {
        let workers: Vec<_> = (0..arguments.threads.max(1)).map(|_| scope.spawn(work)).collect();
        let done = workers.into_iter().map(|worker| worker.join());
        done.flat_map(|done| done.unwrap_or_else(|cause| std::panic::resume_unwind(cause)))
            .collect()
    });
    all.sort_by_key(|(number, _)| *number);
    let assessments: Vec<Assessment> = all.into_iter().map(|(_, assessment)| assessment).collect();
    let table = ScoreTable(&assessments);
    say(format_args!("\n{table}"));
    let Some(path) = &arguments.csv else {
        return Ok(());
    };
    let problem = |error: String| format!("{}: {error}: name a file in an existing folder", path.display());
    let file = File::create(path).map_err(|error| problem(error.to_string()))?;
    table.write_csv(file).map_err(|error| problem(error.to_string()))
}

/// Prints a line. A reader that has left, such as `head`, ends nothing: answers are still kept.
fn say(line: std::fmt::Arguments<'_>) {
    let _ = writeln!(std::io::stdout(), "{line}");
}

fn explain(campaign: &CampaignFolder, arguments: &Arguments, number: usize, count: usize) -> Assessment {
    let begun = Instant::now();
    let assessment = match &arguments.answers {
        Answers::Program { wormd, keep } => campaign.assess(wormd, keep.as_deref()),
        Answers::Files(name) => campaign.assess_file(name),
    };
    let seconds = begun.elapsed().as_secs_f64();
    say(format_args!("{number:>3}/{count} {} {seconds:.1} s", assessment.line()));
    assessment
}
