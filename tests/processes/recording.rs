//! The recorder beside a real worm.

use super::process::wait_for;
use super::worm::Worm;
use super::{Crawling, PATIENCE};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use worm_analysis::recording::mcap::read;
use worm_estimator::config::Config;
use worm_estimator::message::{CommandKind, CommandOutcome};
use worm_log::messages;

/// A gait fast enough for some cycles in a few seconds.
const FAST: &str = "[gait]\ncycle_s = 1.25\n";

fn path_in(folder: &tempfile::TempDir) -> (PathBuf, String) {
    let path = folder.path().join("worm.mcap");
    let argument = path.to_string_lossy().into_owned();
    (path, argument)
}

fn length(path: &Path) -> u64 {
    path.metadata().map_or(0, |metadata| metadata.len())
}

/// The summary of eight seconds that are recorded.
fn record_up(worm: &Worm, config: &str, file: &str, more: &[&str]) -> serde_json::Value {
    let up = ["up", "--json", "--duration", "8", "--config", config, "--record", file];
    let output = worm.wormd(&[&up, more].concat()).output();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}\n{error}", output.status);
    serde_json::from_slice(&output.stdout).expect("a summary")
}

#[test]
fn the_main_job_records_what_replays_to_the_same_results() {
    let worm = Worm::new("record");
    let folder = tempfile::tempdir().expect("a folder");
    let (path, file) = path_in(&folder);
    let config = worm.config(FAST);
    let summary = record_up(&worm, &config, &file, &[]);
    assert_eq!(worm.stale_resources(), Vec::<String>::new());

    let log = messages(&path).expect("a log");
    assert_eq!(log.warnings, Vec::<String>::new(), "it was finished");
    assert_eq!(log.config.as_deref(), Some(FAST));
    assert_eq!(log.states[0].sequence, 0, "the very first state is there");
    assert!(
        Some(log.states.len() as u64) >= summary["ticks"].as_u64(),
        "and the last"
    );
    assert_eq!(log.states.len(), log.timings.len());
    assert_eq!(Some(log.cycles.len()), summary["cycles"].as_array().map(Vec::len));

    let commands = log.commands.iter().map(|record| {
        let kind = CommandKind::try_from(record.kind).expect("a known command");
        let at = log.states.iter().find(|state| state.sequence == record.state_sequence);
        assert_eq!(at.map(|state| state.time_ns), Some(record.time_ns), "{record:?}");
        (kind, record.outcome, record.sender.to_string())
    });
    let ordered = |kind| (kind, CommandOutcome::Accepted.code(), "supervisor".to_owned());
    let commands: Vec<_> = commands.collect();
    assert_eq!(
        commands[..2],
        [CommandKind::Arm, CommandKind::Crawl].map(ordered),
        "{commands:?}"
    );

    let output = worm.replay(&file);
    let replay: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert!(output.status.success(), "{replay}");
    assert_eq!(
        (&replay["complete"], &replay["warnings"]),
        (&true.into(), &serde_json::json!([]))
    );
    assert!(replay["cycles_compared"].as_u64() >= Some(2), "{replay}");
    assert!(replay["estimates_compared"].as_u64() > Some(400), "{replay}");
    for what in ["estimates", "cycles", "alarms"] {
        let figure = |kind: &str| &replay[format!("{what}_{kind}")];
        assert_eq!(figure("identical"), figure("compared"), "{replay}");
    }
    let recording = read(&path).expect("a recording");
    assert!(recording.cells() == 4 && recording.samples() > 400, "{recording:?}");

    let output = worm.plain_wormd(&["analyze", &file, "--slope", "0", "--json"]).output();
    let analysis: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let of_steps = |name: &str| -> Vec<f64> {
        let profile = serde_json::from_value::<Vec<f64>>(analysis["torque_profile"][name].clone());
        // Late in each step, where the tip of the cell slides forward and the torque is that of its friction, and before the drive slows for the next.
        // The servo's velocity comes in coarse steps, so what the inertia takes is attributed to single bins by chance, and to all together rightly.
        let late = |step: &[f64]| step[18..26].iter().sum::<f64>() / 8.0;
        profile.expect("a profile").chunks(32).map(late).collect()
    };
    let physical = worm_physics::Worm::try_from(&Config::default()).expect("the default worm");
    let contact = physical.contact(0);
    let friction_n = contact.stiffness_n_per_m * contact.forward_bound_m;
    let expected_n_m = friction_n * 4.0 * physical.stroke_m() / TAU;
    for name in ["measured_n_m", "model_n_m"] {
        for torque_n_m in of_steps(name) {
            assert!(
                (torque_n_m / expected_n_m - 1.0).abs() < 0.1,
                "{name}: {torque_n_m} instead of {expected_n_m} N m"
            );
        }
    }
}

#[test]
fn a_thinned_recording_has_few_ticks_and_every_cycle() {
    let worm = Worm::new("thin");
    let folder = tempfile::tempdir().expect("a folder");
    let (path, file) = path_in(&folder);
    let config = worm.config(FAST);
    let summary = record_up(&worm, &config, &file, &["--rate", "50"]);
    let log = messages(&path).expect("a log");
    assert!(
        log.warnings.iter().any(|note| note.contains("only 50 ticks")),
        "{:?}",
        log.warnings
    );
    assert_eq!(Some(log.cycles.len()), summary["cycles"].as_array().map(Vec::len));
    let span_s = log.states.last().map_or(0, |last| last.time_ns - log.states[0].time_ns) as f64 * 1e-9;
    let rates = [log.states.len(), log.estimates.len()].map(|count| count as f64 / span_s);
    // A tick in which something changes comes besides; an estimate waits for a sample of the tracker.
    assert!(
        rates.iter().all(|rate| (30.0..55.0).contains(rate)),
        "{rates:?} a second"
    );
    let too_fast = worm.wormd(&["record", "--out", &file, "--rate", "2000"]).output();
    assert_eq!(too_fast.status.code(), Some(2));
}

#[test]
fn a_recorder_goes_on_while_others_are_started_anew_and_loses_little_when_it_is_killed() {
    let worm = Worm::new("recorder");
    let folder = tempfile::tempdir().expect("a folder");
    let (path, file) = path_in(&folder);
    // It waits for a worm that is not there yet.
    let mut recorder = worm.wormd(&["record", "--out", &file]).start();
    let empty = length(&path);
    let mut crawling = Crawling::start_again(worm);
    wait_for("the recorder writes", PATIENCE, || length(&path) > empty);
    crawling.estimator.kill();
    crawling.controller.kill();
    let Crawling { worm, .. } = crawling;
    let before = worm.state().expect("has been heard");
    let crawling = Crawling::start_again(worm);
    wait_for("half a second of the new one", PATIENCE, || {
        crawling
            .worm
            .state()
            .is_some_and(|state| state.sequence > 500 && state.time_ns > before.time_ns)
    });
    let grown = length(&path);
    wait_for("what has come is safe", PATIENCE, || length(&path) > grown);
    let safe = crawling.worm.state().expect("is there");
    recorder.kill();
    let log = messages(&path).expect("a log");
    assert!(log.warnings[0].starts_with("cut off after"), "{:?}", log.warnings);
    let starts = log.states.iter().filter(|state| state.sequence == 0).count();
    assert_eq!(starts, 2, "both runs of the controller from their first state on");
    let last_ns = log.states.iter().map(|state| state.time_ns).max().expect("states");
    assert!(last_ns + 1_000_000_000 > safe.time_ns, "at most a moment is lost");
    let recording = read(&path).expect("a recording");
    assert!(
        recording
            .warnings
            .iter()
            .any(|text| text.contains("the controller was started 2 times"))
    );
}

#[test]
fn only_what_was_asked_for_is_recorded_and_no_file_is_lost() {
    let crawling = Crawling::start("topics");
    let worm = &crawling.worm;
    let folder = tempfile::tempdir().expect("a folder");
    let (path, file) = path_in(&folder);
    let record = |more: &[&str]| {
        let arguments = [&["record", "--duration", "2", "--out"], more].concat();
        let output = worm.wormd(&arguments).output();
        (
            output.status.code(),
            String::from_utf8_lossy(&output.stderr).into_owned(),
        )
    };
    let (code, error) = record(&[&file, "--topics", "state,cycle"]);
    assert_eq!(code, Some(0), "{error}");
    assert!(error.contains("(0 lost)") && error.contains("timing 0,"), "{error}");
    let log = messages(&path).expect("a log");
    assert!(log.states.len() >= 400 && log.timings.is_empty() && log.estimates.is_empty());
    assert_eq!((log.config, log.warnings), (None, Vec::new()));

    for (arguments, code, part) in [
        (&[file.as_str()][..], 2, "exists already: choose another name"),
        (
            &["/dev/full", "--force"],
            1,
            "cannot be written: No space left on device",
        ),
        (&["/nowhere/x.mcap"], 2, "cannot be written: No such file"),
        (
            &[file.as_str(), "--topics", "states"],
            2,
            "give some of state, timing, estimate, cycle, alarm",
        ),
        (
            &["/nowhere/x.mcap", "--keep", "3"],
            2,
            "--keep needs --max-size or --max-age",
        ),
        (&["/nowhere/x.mcap", "--max-size", "100"], 2, "give one such as 100MB"),
        (&["/dev/null", "--force", "--max-age", "1h"], 2, "is no ordinary file"),
        (&[file.as_str(), "--force"], 0, "recorded: state"),
    ] {
        let (found, error) = record(arguments);
        assert_eq!(found, Some(code), "{arguments:?}: {error}");
        assert!(error.contains(part), "{part} is not in {error}");
    }
}
