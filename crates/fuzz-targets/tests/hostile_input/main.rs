//! The fuzzer's targets on stable Rust, for a bounded time: every input of the corpora, and inputs mutated from them.
//!
//! `WORMD_FUZZ_CASES` sets the number of mutated inputs per target, `WORMD_FUZZ_SEED` the first seed. A failure names the seed and leaves
//! the input in a file: put it into `fuzz/corpus/<target>/` when it is fixed.

mod mutation;
mod oversized;

use fuzz_targets::{Target, target};
use mutation::Mutator;
use nix::time::{ClockId, clock_gettime};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// CPU time that one input may take. An optimised build takes milliseconds; that of a debugger is slower.
const MAX_CPU: Duration = Duration::from_secs(if cfg!(debug_assertions) { 30 } else { 3 });
/// Time after which an input counts as endless, however busy the computer is.
const ENDLESS: Duration = Duration::from_secs(300);
/// Failures of a target after which it is left alone.
const MAX_FAILURES: usize = 20;

macro_rules! targets {
    ($($name:ident: $cases:literal,)+) => {
        $(#[test]
        fn $name() {
            attack(stringify!($name), $cases);
        })+

        #[test]
        fn every_target_is_attacked() {
            let mut tested = [$(stringify!($name)),+];
            let mut all = fuzz_targets::TARGETS.map(|target| target.name);
            tested.sort_unstable();
            all.sort_unstable();
            assert_eq!(tested, all);
        }
    };
}

targets! {
    packets: 20_000,
    tracker_table: 50_000,
    config_toml: 4_000,
    campaign_toml: 20_000,
    bench_toml: 20_000,
    servo_csv: 6_000,
    recording_csv: 6_000,
    route_csv: 20_000,
    vicon_csv: 6_000,
    c3d: 10_000,
    mcap_log: 1_000,
    protobuf_message: 50_000,
    log_messages: 2_000,
}

fn setting(name: &str) -> Option<u64> {
    std::env::var(name).ok().map(|text| text.parse().expect("a number"))
}

fn attack(name: &str, cases: u64) {
    let target = target(name).expect("a target");
    let first_seed = setting("WORMD_FUZZ_SEED").unwrap_or(1);
    // A build without optimisation is for a look at a failure.
    let cases = if cfg!(debug_assertions) { cases / 20 } else { cases };
    let cases = setting("WORMD_FUZZ_CASES").unwrap_or(cases);
    let corpus = corpus(name);
    println!("{name}: {} inputs, {cases} cases from seed {first_seed}", corpus.len());
    let (report, reports) = channel();
    std::thread::scope(|scope| {
        scope.spawn(move || {
            loop {
                match reports.recv_timeout(ENDLESS) {
                    Ok(()) => {}
                    Err(RecvTimeoutError::Disconnected) => return,
                    Err(RecvTimeoutError::Timeout) => {
                        eprintln!(
                            "{name}: an input takes longer than {ENDLESS:?}: see {}",
                            kept(name, "last").display()
                        );
                        std::process::abort();
                    }
                }
            }
        });
        let mut failures = Vec::new();
        let mut try_one = |what: &str, input: &[u8]| {
            if failures.len() < MAX_FAILURES {
                failures.extend(run(target, what, input));
            }
            report.send(()).expect("the watch runs");
        };
        for (file, input) in &corpus {
            try_one(file, input);
        }
        for (what, input) in oversized::inputs(name) {
            try_one(what, &input);
        }
        let seeds: Vec<&[u8]> = corpus.iter().map(|(_, input)| input.as_slice()).collect();
        for seed in first_seed..first_seed + cases {
            try_one(&format!("seed {seed}"), &Mutator::new(seed).mutate(&seeds));
        }
        drop(report);
        assert!(failures.is_empty(), "{name}:\n{}", failures.join("\n"));
    });
}

/// Where an input stays that did harm.
fn kept(name: &str, what: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{}", what.replace(' ', "-")))
}

/// What is wrong with a target's answer to an input, if anything is.
fn run(target: &Target, what: &str, input: &[u8]) -> Option<String> {
    keep_for_the_watch(target, input);
    let before = cpu();
    let mut outcome = Ok(());
    let memory = allocation_counter::measure(|| {
        outcome = catch_unwind(AssertUnwindSafe(|| (target.run)(input)));
    });
    let taken = cpu() - before;
    let bound = target.memory_bound(input.len());
    let problem = if outcome.is_err() {
        "it panicked".to_owned()
    } else if taken > MAX_CPU {
        format!("it took {taken:?}")
    } else if memory.bytes_max > bound as u64 {
        format!("it held {} bytes, and {bound} are allowed", memory.bytes_max)
    } else {
        return None;
    };
    let kept = kept(target.name, what);
    std::fs::write(&kept, input).expect("the input can be kept");
    Some(format!(
        "{what}: {problem}; the input of {} bytes is in {}",
        input.len(),
        kept.display()
    ))
}

/// Only a long input can take so long that the watch ends it.
fn keep_for_the_watch(target: &Target, input: &[u8]) {
    if input.len() > 64 * 1024 {
        std::fs::write(kept(target.name, "last"), input).expect("the input can be kept");
    }
}

fn cpu() -> Duration {
    let time = clock_gettime(ClockId::CLOCK_THREAD_CPUTIME_ID).expect("every thread has this clock");
    Duration::from(time)
}

/// The inputs kept for a target, with the names of their files.
fn corpus(name: &str) -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../fuzz/corpus")
        .join(name);
    let files = std::fs::read_dir(&folder).expect("the corpus is there");
    let mut inputs: Vec<(String, Vec<u8>)> = files
        .map(|file| {
            let file = file.expect("the corpus can be read");
            let input = std::fs::read(file.path()).expect("the input can be read");
            (file.file_name().to_string_lossy().into_owned(), input)
        })
        .collect();
    inputs.sort();
    assert!(!inputs.is_empty(), "{} is empty", folder.display());
    inputs
}
