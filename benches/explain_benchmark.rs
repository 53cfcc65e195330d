//! How well the search names the hidden effect: every case of a split, and the score table.
//!
//! ```text
//! cargo bench --bench explain_benchmark -- --split development|test|search [--only EFFECT] [--cases N] [--csv FILE]
//! ```
//! Without `--split` a few cases of the development split are run; `search` are those that `tests/analysis/search.rs` runs at a smaller size.
//! `WORMD_CASES` scales how many there are of each kind.

use clap::Parser;
use std::fs::File;
use std::panic;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Instant;
use testkit::hidden_effects::assessment::{Assessment, assess};
use testkit::hidden_effects::library::Library;
use testkit::hidden_effects::split::{Case, Split, scale_from_environment, split};
use testkit::hidden_effects::table::ScoreTable;

/// Threads that explain cases side by side.
const THREADS: usize = 2;
/// Cases that are run without `--split`.
const FEW: usize = 4;

#[derive(Debug, Parser)]
#[command(about = "Runs the search for the missing effect on campaigns in which one is hidden, and scores it.")]
struct Arguments {
    /// Which cases: development, test, search or sample; absent: a few of development.
    #[arg(long, value_parser = |name: &str| Split::named(name).ok_or("must be development, test, search or sample"))]
    split: Option<Split>,
    /// Only these: an effect, clean, discrepant, outside, pair, triple, twin or onset.
    #[arg(long, value_parser = |name: &str| Case::words().find(|word| *word == name).ok_or("must be an effect, clean, discrepant, outside, pair, triple, twin or onset"))]
    only: Option<&'static str>,
    /// At most so many cases, spread evenly over the split.
    #[arg(long)]
    cases: Option<usize>,
    /// Writes a row for every case to this file.
    #[arg(long)]
    csv: Option<PathBuf>,
    /// Passed by `cargo bench`.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let mut cases = split(arguments.split.unwrap_or(Split::Development), scale_from_environment());
    if let Some(only) = arguments.only {
        cases.retain(|case| case.what() == only);
    }
    let few = arguments.split.is_none().then_some(FEW);
    if let Some(max) = arguments.cases.or(few) {
        cases = spread(&cases, max);
    }
    let assessments = assess_all(&cases);
    println!("\n{}", ScoreTable(&assessments));
    let Some(path) = &arguments.csv else {
        return ExitCode::SUCCESS;
    };
    let written = File::create(path)
        .map_err(csv::Error::from)
        .and_then(|file| ScoreTable(&assessments).write_csv(file));
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!(
                "{}: cannot be written: {problem}: name a file in an existing folder",
                path.display()
            );
            ExitCode::FAILURE
        }
    }
}

/// At most `max` cases, spread evenly.
fn spread(cases: &[Case], max: usize) -> Vec<Case> {
    let count = max.min(cases.len());
    (0..count).map(|place| cases[place * cases.len() / count]).collect()
}

/// Assesses every case, in the order given, and prints a line for each as it comes.
fn assess_all(cases: &[Case]) -> Vec<Assessment> {
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
            let assessment = assess(&campaign, &Library);
            let seconds = begun.elapsed().as_secs_f64();
            println!("{:>3}/{} {} {seconds:.1} s", number + 1, cases.len(), assessment.line());
            done.push((number, assessment));
        }
    };
    let mut all: Vec<(usize, Assessment)> = thread::scope(|scope| {
        let workers: Vec<_> = (0..THREADS).map(|_| scope.spawn(work)).collect();
        let done = workers.into_iter().map(|worker| worker.join());
        done.flat_map(|done| done.unwrap_or_else(|cause| panic::resume_unwind(cause)))
            .collect()
    });
    all.sort_by_key(|(number, _)| *number);
    all.into_iter().map(|(_, assessment)| assessment).collect()
}
