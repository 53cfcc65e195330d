//! Processes that come and go, in order or killed, leave nothing with those that stay.

use super::process::{Process, wait_for};
use super::worm::Worm;
use super::{Crawling, PATIENCE};
use std::collections::BTreeMap;
use std::path::Path;

/// Rounds in which everything grows to its usual size.
const WARM_UP: usize = 4;
/// Rounds that may not make anything grow.
const ROUNDS: usize = 14;
/// Rounds in order that may follow, in which nothing can be lost that leaked before.
const SETTLING: usize = 4;
/// Growth of a process's memory that is no leak, bytes. One connection takes 33 kB, and each round makes a dozen.
const TOLERANCE: u64 = 500_000;

/// What a process holds.
#[derive(Debug, Clone, PartialEq)]
struct Held {
    /// How many of each kind of file are open, the digits of their names left out.
    descriptors: BTreeMap<String, usize>,
    threads: usize,
    mappings: usize,
    resident: u64,
}

impl Held {
    fn by(process: &Process) -> Self {
        let folder = Path::new("/proc").join(process.id().to_string());
        let count = |name: &str| std::fs::read_dir(folder.join(name)).expect("is alive").count();
        let mut descriptors = BTreeMap::new();
        for entry in std::fs::read_dir(folder.join("fd")).expect("is alive").flatten() {
            // What is closed meanwhile is held by nobody.
            if let Ok(file) = std::fs::read_link(entry.path()) {
                let kind = file.to_string_lossy().replace(|c: char| c.is_ascii_digit(), "");
                *descriptors.entry(kind).or_insert(0) += 1;
            }
        }
        let text = |name: &str| std::fs::read_to_string(folder.join(name)).expect("is alive");
        let resident_pages = text("statm")
            .split_whitespace()
            .nth(1)
            .and_then(|pages| pages.parse::<u64>().ok());
        Self {
            descriptors,
            threads: count("task"),
            mappings: text("maps").lines().count(),
            resident: 4096 * resident_pages.expect("a number of pages"),
        }
    }

    /// Connections of topics that are open.
    fn connections(&self) -> usize {
        self.descriptors
            .iter()
            .filter_map(|(kind, count)| kind.ends_with(".connection").then_some(count))
            .sum()
    }
}

/// Starts an estimator and a recorder beside the controller, and ends them in order or by kill -9.
fn come_and_go(worm: &Worm, folder: &Path, round: usize, in_order: bool) {
    let file = folder.join("leaks.mcap").to_string_lossy().into_owned();
    let mut recorder = worm.wormd(&["record", "--force", "--out", &file]).start();
    let mut estimator = worm.wormd(&["estimate"]).start();
    let length = || std::fs::metadata(&file).map_or(0, |metadata| metadata.len());
    let begun = length();
    wait_for("something is recorded", PATIENCE, || length() > begun);
    match (in_order, round % 2) {
        (true, 0) => {
            recorder.end();
            estimator.end();
        }
        (true, _) => {
            estimator.end();
            recorder.end();
        }
        (false, _) => {
            recorder.kill();
            estimator.kill();
        }
    }
}

#[test]
fn who_stays_does_not_grow_with_who_comes_and_goes() {
    let Crawling {
        worm,
        virtual_worm,
        estimator,
        controller,
    } = Crawling::at_rest(Worm::on_a_steady_computer("leaks"), &[]);
    estimator.end();
    let folder = tempfile::tempdir().expect("a folder");
    let stays = || [Held::by(&controller), Held::by(&virtual_worm)];
    let mut before = None;
    for round in 0..WARM_UP + ROUNDS {
        // What a killed process leaves is removed at the next start, so the rounds before a look end in order.
        let is_last = round == WARM_UP - 1 || round == WARM_UP + ROUNDS - 1;
        come_and_go(&worm, folder.path(), round, is_last || round % 2 == 0);
        if round == WARM_UP - 1 {
            // The controller closes a connection with its next message or, where it has none to send, a little later.
            wait_for("nobody is connected any more", PATIENCE, || {
                Held::by(&controller).connections() == 0
            });
            before = Some((stays(), worm.stale_resources()));
        }
    }
    let (before, files_before) = before.expect("was looked at");
    println!("{before:#?}\n{:#?}\n{files_before:#?}", stays());
    // What is open for a moment only is no leak.
    let has_not_grown = |(before, now): (&Held, &Held)| {
        (&now.descriptors, now.threads, now.mappings) == (&before.descriptors, before.threads, before.mappings)
            && now.resident <= before.resident + TOLERANCE
    };
    let is_as_before =
        || worm.stale_resources().len() == files_before.len() && before.iter().zip(&stays()).all(has_not_grown);
    // What is left of the last one may go only with the next, who ends in order: a leak does not.
    for round in 0..SETTLING {
        if is_as_before() {
            break;
        }
        come_and_go(&worm, folder.path(), round, true);
    }
    wait_for("nobody has grown", PATIENCE, is_as_before);
    controller.end();
    virtual_worm.end();
    assert_eq!(worm.stale_resources(), Vec::<String>::new());
}
