//! Scores a built `wormd` on a folder of campaigns of which the truth is known, whatever test bed wrote them.
//!
//! ```text
//! cargo run --release -p testkit --bin score_campaigns -- FOLDER --wormd target/release/wormd [--threads N] [--csv FILE] [--keep NAME]
//! cargo run --release -p testkit --bin score_campaigns -- FOLDER --answers NAME [--csv FILE]
//! cargo run --release -p testkit --bin score_campaigns -- FOLDER --answers NAME --answers NAME ... --figure FILE
//! ```
//! `--keep` leaves each answer's JSON beside its campaign, as NAME; `--answers` scores those that lie there, and leaves out
//! campaigns without one. `--figure` draws the curves and the calibration, of several sets of answers beside each other.

use std::collections::VecDeque;
use std::fs::File;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Mutex;
use std::thread;
use std::time::Instant;
use testkit::hidden_effects::assessment::Assessment;
use testkit::hidden_effects::curve_figure::{self, Series};
use testkit::hidden_effects::folders::{CampaignFolder, campaigns};
use testkit::hidden_effects::table::ScoreTable;

const USAGE: &str = "usage: score_campaigns FOLDER (--wormd PROGRAM [--threads N] [--keep NAME] | --answers NAME [--answers NAME ...]) [--csv FILE] [--figure FILE]";

struct Arguments {
    folder: PathBuf,
    /// One set or more.
    answers: Vec<Answers>,
    threads: usize,
    csv: Option<PathBuf>,
    figure: Option<PathBuf>,
}

/// Where a set of answers comes from.
enum Answers {
    /// A built `wormd`, and the name under which each answer is kept.
    Program { wormd: PathBuf, keep: Option<String> },
    /// Files of this name beside the campaigns.
    Files(String),
}

impl Answers {
    /// What it is called in tables and pictures.
    fn name(&self) -> String {
        match self {
            Self::Program { wormd, .. } => wormd.display().to_string(),
            Self::Files(name) => name.trim_end_matches(".json").to_owned(),
        }
    }
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
    let (mut wormd, mut keep, mut files, mut threads) = (None, None, Vec::new(), 1);
    let (mut csv, mut figure) = (None, None);
    while let Some(option) = given.pop_front() {
        let value = given
            .pop_front()
            .ok_or_else(|| format!("{option} needs a value\n{USAGE}"))?;
        match option.as_str() {
            "--wormd" => wormd = Some(PathBuf::from(value)),
            "--keep" => keep = Some(value),
            "--answers" => files.push(Answers::Files(value)),
            "--csv" => csv = Some(PathBuf::from(value)),
            "--figure" => figure = Some(PathBuf::from(value)),
            "--threads" => threads = value.parse().map_err(|error| format!("--threads {value}: {error}"))?,
            _ => return Err(format!("unknown option {option}\n{USAGE}")),
        }
    }
    let answers = match (wormd, files.is_empty()) {
        (Some(wormd), true) => vec![Answers::Program { wormd, keep }],
        (None, false) => files,
        _ => return Err(USAGE.to_owned()),
    };
    if csv.is_some() && answers.len() > 1 {
        return Err(format!("--csv holds one set of answers: give one --answers\n{USAGE}"));
    }
    Ok(Arguments {
        folder: folder.into(),
        answers,
        threads,
        csv,
        figure,
    })
}

fn score(arguments: &Arguments) -> Result<(), String> {
    let sets = arguments.answers.iter().map(|answers| assess(answers, arguments));
    let sets = sets.collect::<Result<Vec<_>, _>>()?;
    let mut series = Vec::new();
    for (answers, assessments) in arguments.answers.iter().zip(&sets) {
        let name = answers.name();
        let table = ScoreTable(assessments);
        say(format_args!("\n{name}\n{table}"));
        if let Some(path) = &arguments.csv {
            let problem = |error: String| format!("{}: {error}: name a file in an existing folder", path.display());
            let file = File::create(path).map_err(|error| problem(error.to_string()))?;
            table.write_csv(file).map_err(|error| problem(error.to_string()))?;
        }
        series.push(Series { name, assessments });
    }
    match &arguments.figure {
        Some(file) => curve_figure::draw(&series, file),
        None => Ok(()),
    }
}

/// All campaigns of the folder with one set of answers.
fn assess(answers: &Answers, arguments: &Arguments) -> Result<Vec<Assessment>, String> {
    let mut campaigns = campaigns(&arguments.folder)?;
    if let Answers::Files(name) = answers {
        campaigns.retain(|campaign| campaign.path.join(name).is_file());
    }
    let count = campaigns.len();
    let waiting = Mutex::new(campaigns.into_iter().enumerate().collect::<VecDeque<_>>());
    let work = || {
        let next = || waiting.lock().ok().and_then(|mut waiting| waiting.pop_front());
        let mut done: Vec<(usize, Assessment)> = Vec::new();
        while let Some((number, campaign)) = next() {
            done.push((number, explain(&campaign, answers, number + 1, count)));
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
    Ok(all.into_iter().map(|(_, assessment)| assessment).collect())
}

/// Prints a line. A reader that has left, such as `head`, ends nothing: answers are still kept.
fn say(line: std::fmt::Arguments<'_>) {
    let _ = writeln!(std::io::stdout(), "{line}");
}

fn explain(campaign: &CampaignFolder, answers: &Answers, number: usize, count: usize) -> Assessment {
    let begun = Instant::now();
    let assessment = match answers {
        Answers::Program { wormd, keep } => campaign.assess(wormd, keep.as_deref()),
        Answers::Files(name) => campaign.assess_file(name),
    };
    let seconds = begun.elapsed().as_secs_f64();
    say(format_args!("{number:>3}/{count} {} {seconds:.1} s", assessment.line()));
    assessment
}
