//! How many instructions the hot paths take, counted by callgrind and held against the figures in `benches/instructions.toml`.
//!
//! ```sh
//! cargo bench --bench instructions              # exit status 1 where a count is off by more than 3 %
//! cargo bench --bench instructions -- --update  # writes the counts down as the new figures
//! ```
//!
//! Wall time on a shared machine says little about a change of a few per cent; a count of instructions is the same on a busy
//! machine and an idle one. A path that became faster by more than 3 % fails as well, so that the figures stay true: write them
//! down anew. The counts are those of one compiler and C library, which the file names; with others they are only shown.
//!
//! Needs valgrind (Debian: `apt install valgrind`).

mod hot_paths;

use clap::Parser;
use hot_paths::{AnsweredExchange, Crawling};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ffi::CStr;
use std::path::Path;
use std::process::{Command, ExitCode};
use testkit::crawl::{Crawl, Scene, config_of, paper_worm};
use worm_analysis::experiment::{RecordedRun, Simulation, simulate};
use worm_analysis::explain::Prediction;
use worm_estimator::config::Config;
use worm_estimator::estimate::Estimator;
use worm_estimator::message::State;
use worm_physics::{Motion, Worm};

/// How far a count may be from its figure.
const TOLERANCE: f64 = 0.03;
const FIGURES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/instructions.toml");
/// What callgrind collects: this function and what it calls.
const COUNTED: &str = "wormd_counted_region";

/// One hot path: what is counted, and how often it is done within one count.
struct HotPath {
    name: &'static str,
    times: u64,
    run: fn(u64),
}

const HOT_PATHS: [HotPath; 5] = [
    HotPath {
        name: "controller-tick",
        times: 2_000,
        run: |times| {
            let mut crawling = Crawling::new();
            repeat(times, || crawling.tick());
        },
    },
    HotPath {
        name: "exchange",
        times: 2_000,
        run: |times| {
            let mut exchange = AnsweredExchange::new();
            repeat(times, || exchange.exchange());
        },
    },
    HotPath {
        name: "estimator-sample",
        times: 150,
        run: estimator_samples,
    },
    HotPath {
        name: "gait-cycle",
        times: 500,
        run: |times| {
            let worm = Worm::paper();
            let mut motion = Motion::at_rest(&worm, &[0.12, 0.08, 0.04, 0.0]);
            repeat(times, || {
                let phase = motion.phase() + 1.0;
                motion.advance_to(&worm, phase).expect("the paper's worm crawls");
            });
        },
    },
    HotPath {
        name: "explain-prediction",
        times: 3,
        run: |times| {
            let config = Config::default();
            let recording = simulate(&config, &Simulation::default()).expect("the paper's worm crawls");
            let run = RecordedRun::at_slope(&recording, 0.0);
            let prediction = Prediction::new(&[run], &config).expect("a recording to predict");
            repeat(times, || {
                std::hint::black_box(prediction.positions_m(0).expect("the paper's worm crawls"));
            });
        },
    },
];

/// Ticks that bring a new sample of the tracker, within a gait cycle.
fn estimator_samples(times: u64) {
    let scene = Scene::default();
    let worm = paper_worm(30.0, true);
    let mut estimator = Estimator::new(&config_of(&worm, &scene)).expect("a valid configuration");
    let mut crawl = Crawl::new(worm, scene);
    for _ in 0..6_000 {
        estimator.update(&crawl.tick());
    }
    // The next cycle ends 1.5 s later: within it lie 180 samples.
    let ticks = (0..1_400).map(|_| crawl.tick());
    let samples: Vec<State> = ticks.filter(|state| state.sample_is_new == 1).collect();
    let mut next = samples.iter();
    repeat(times, || {
        let state = next.next().expect("enough samples");
        std::hint::black_box(estimator.update(state));
    });
}

/// Does the step `times` times under the count.
fn repeat(times: u64, mut step: impl FnMut()) {
    wormd_counted_region(&mut || (0..times).for_each(|_| step()));
}

// SAFETY: no other function of the program has this name.
#[unsafe(no_mangle)]
#[inline(never)]
fn wormd_counted_region(work: &mut dyn FnMut()) {
    work();
}

#[derive(Parser)]
struct Arguments {
    /// Write the counts down as the new figures
    #[arg(long)]
    update: bool,
    /// Run one path, under callgrind
    #[arg(long, hide = true)]
    path: Option<String>,
    /// Given by cargo
    #[arg(long, hide = true)]
    bench: bool,
}

/// `benches/instructions.toml`.
#[derive(Serialize, Deserialize)]
struct Figures {
    /// Compiler and C library that the counts are of.
    toolchain: String,
    /// Instructions of one step of each path.
    instructions: BTreeMap<String, u64>,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    if let Some(name) = &arguments.path {
        let path = HOT_PATHS.iter().find(|path| path.name == name).expect("a known path");
        (path.run)(path.times);
        return ExitCode::SUCCESS;
    }
    match compare(arguments.update) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(problem) => {
            eprintln!("instructions: {problem}");
            ExitCode::FAILURE
        }
    }
}

/// Counts every path, and says how each compares with its figure. Whether all are within the tolerance.
fn compare(update: bool) -> Result<bool, String> {
    let toolchain = toolchain()?;
    let text = std::fs::read_to_string(FIGURES).map_err(|error| format!("{FIGURES}: {error}"))?;
    let figures: Figures = toml::from_str(&text).map_err(|error| format!("{FIGURES}: {error}"))?;
    let is_comparable = figures.toolchain == toolchain;
    let mut counts = BTreeMap::new();
    let mut all_within = true;
    println!("{:<20} {:>12} {:>12} {:>9}", "path", "instructions", "figure", "change");
    for path in &HOT_PATHS {
        let count = count(path)?;
        counts.insert(path.name.to_owned(), count);
        let Some(&figure) = figures.instructions.get(path.name) else {
            println!("{:<20} {count:>12} {:>12}", path.name, "none");
            all_within = false;
            continue;
        };
        let change = count as f64 / figure as f64 - 1.0;
        let is_within = change.abs() <= TOLERANCE;
        all_within &= is_within;
        let mark = if is_within { "" } else { "  beyond 3 %" };
        println!(
            "{:<20} {count:>12} {figure:>12} {:>+8.2}%{mark}",
            path.name,
            100.0 * change
        );
    }
    if update {
        let figures = Figures {
            toolchain,
            instructions: counts,
        };
        let text = toml::to_string(&figures).map_err(|error| error.to_string())?;
        let header = "# Instructions of one step of each hot path: `cargo bench --bench instructions -- --update` writes them.\n";
        std::fs::write(FIGURES, format!("{header}{text}")).map_err(|error| format!("{FIGURES}: {error}"))?;
        return Ok(true);
    }
    if !is_comparable {
        println!(
            "not compared: the figures are of {}, this is {toolchain}",
            figures.toolchain
        );
        return Ok(true);
    }
    if !all_within {
        println!(
            "a path takes more than 3 % more or fewer instructions than its figure: find out why; if it is meant, --update"
        );
    }
    Ok(all_within)
}

/// Instructions of one step.
fn count(path: &HotPath) -> Result<u64, String> {
    let itself = std::env::current_exe().map_err(|error| error.to_string())?;
    let output = Command::new("valgrind")
        .args([
            "--tool=callgrind",
            "--callgrind-out-file=/dev/null",
            "--collect-atstart=no",
        ])
        .arg(format!("--toggle-collect={COUNTED}"))
        .arg(&itself)
        .args(["--path", path.name])
        // The C library has its mathematics once for each generation of CPUs: always the oldest, so that all machines count alike.
        .env(
            "GLIBC_TUNABLES",
            "glibc.cpu.hwcaps=-AVX2_Usable,-AVX2,-FMA_Usable,-FMA,-FMA4_Usable,-FMA4,-ERMS,-FSRM",
        )
        .output()
        .map_err(|error| format!("valgrind cannot be started: {error}: install it (Debian: apt install valgrind)"))?;
    let report = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        return Err(format!("{} failed under valgrind:\n{report}", path.name));
    }
    let collected = report
        .lines()
        .find_map(|line| line.split_once("Collected :"))
        .and_then(|(_, count)| count.trim().parse::<u64>().ok())
        .filter(|&count| count > 0)
        .ok_or_else(|| format!("valgrind counted nothing of {} ({COUNTED}):\n{report}", path.name))?;
    Ok(collected / path.times)
}

/// What a count depends on besides the code.
fn toolchain() -> Result<String, String> {
    let output = Command::new("rustc")
        .arg("--version")
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")))
        .output()
        .map_err(|error| format!("rustc cannot be asked for its version: {error}"))?;
    let version = String::from_utf8_lossy(&output.stdout);
    let version = version.split(" (").next().unwrap_or_default().trim();
    // SAFETY: it returns a static string.
    let libc = unsafe { CStr::from_ptr(libc::gnu_get_libc_version()) };
    Ok(format!(
        "{version}, {}, glibc {}",
        std::env::consts::ARCH,
        libc.to_string_lossy()
    ))
}
