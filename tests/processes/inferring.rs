//! Self-sensing in a running worm: what `up` says, a mark, an alarm by the current alone, and the same again from the recording.

use super::process::wait_for;
use super::worm::Worm;
use super::{Crawling, PATIENCE};
use serde_json::Value;
use std::process::Output;
use worm_log::messages;

/// A gait fast enough for many cycles in half a minute.
const FAST: &str = "[gait]\ncycle_s = 1.25\n";
/// When cell 2 loses four tenths of its friction, s.
const WET_FROM_S: f64 = 18.0;

fn json(output: &Output) -> Value {
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}\n{error}", output.status);
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

#[test]
fn the_main_job_infers_takes_a_mark_and_reports_lost_friction() {
    // A pause costs the cycle in which it is, and there are few.
    let worm = Worm::on_a_steady_computer("infer");
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("worm.mcap").to_string_lossy().into_owned();
    let config = worm.config(FAST);
    let fault = format!("slip:friction=0.6,cell=2@{WET_FROM_S}");
    let up = [
        "up",
        "--json",
        "--duration",
        "32",
        "--config",
        &config,
        "--record",
        &file,
        "--fault",
        &fault,
    ];
    let main_job = worm.wormd(&up);
    let running = std::thread::spawn(move || main_job.output());
    let mark = ["command", "mark", "--position", "0.5", "--sigma", "0.002"];
    wait_for("a mark is accepted", PATIENCE, || {
        worm.wormd(&mark).output().status.success()
    });
    // One that came before the estimator listened says nothing to it.
    wait_for("it crawls", PATIENCE, || {
        worm.state().is_some_and(|state| state.phase > 2.0)
    });
    assert!(worm.wormd(&mark).output().status.success());
    worm.forget_topics();
    let summary = json(&running.join().expect("the main job ends"));
    let inferred = &summary["inferred"];
    println!("{inferred:#}");
    for name in ["friction", "stiffness"] {
        let (values, sigmas) = match name {
            "friction" => ("friction_n", "friction_sigma_n"),
            _ => ("stiffness_n_per_m", "stiffness_sigma_n_per_m"),
        };
        assert_eq!(inferred[values].as_array().map(Vec::len), Some(4), "{name}");
        let are_known = |of: &str| inferred[of].as_array().is_some_and(|all| all.iter().all(Value::is_f64));
        assert!(are_known(values) && are_known(sigmas), "{name}");
    }
    assert_eq!(inferred["standing"], "changed");
    assert!(inferred["marks"].as_u64() >= Some(1) && inferred["tracker_marks"].as_u64() > Some(3));
    let alarms = summary["alarms"].as_array().expect("a list");
    let lost = alarms.iter().find(|alarm| alarm["alarm"] == "friction-loss");
    let lost = lost.unwrap_or_else(|| panic!("no loss of friction in {alarms:#?}"));
    assert_eq!(lost["cell"], 2, "{lost}");
    let raised_s = lost["raised_s"].as_f64().unwrap_or(f64::NAN);
    println!("raised {:.1} cycles after the loss", (raised_s - WET_FROM_S) / 1.25);
    // Three cycles; twice that where the computer was busy in one of them.
    assert!((0.0..7.5).contains(&(raised_s - WET_FROM_S)), "{lost}");

    // Its positions are there, and are not looked at.
    let analyze = ["analyze", &file, "--slope", "0", "--current=alone", "--json"];
    let by_current = json(&worm.plain_wormd(&analyze).output());
    assert_eq!(by_current["evidence"], "current", "{by_current}");
    assert!(
        by_current["cycles"].as_array().map(Vec::len) >= Some(15),
        "{by_current}"
    );
    // A configuration of another worm.
    let three = folder.path().join("three.toml");
    std::fs::write(&three, "[worm]\ncells = 3\nstep_order = [1, 2, 3]\n").expect("it can be written");
    let three = three.to_string_lossy().into_owned();
    for command in ["infer", "replay"] {
        let refused = worm.plain_wormd(&[command, &file, "--config", &three]).output();
        let error = String::from_utf8_lossy(&refused.stderr);
        assert_eq!(refused.status.code(), Some(2), "{command}: {error}");
        assert!(
            error.contains("the recorded worm has 4 cells, and this configuration has 3"),
            "{command}: {error}"
        );
    }

    let replay = json(&worm.replay(&file));
    for what in ["estimates", "alarms", "inferred"] {
        assert_eq!(
            replay[format!("{what}_identical")],
            replay[format!("{what}_compared")],
            "{replay}"
        );
    }
    assert!(replay["inferred_compared"].as_u64() > Some(5), "{replay}");

    // Without a look at positions, `infer` finds the same worm.
    let log = messages(file.as_ref()).expect("a log");
    let mut commands = log.commands.iter();
    let mark = commands.find(|record| record.position_m == 0.5).expect("the mark");
    assert_eq!(mark.sender.as_str(), "wormd command");
    let answer = json(&worm.plain_wormd(&["infer", "--json", &file]).output());
    let live = log
        .inferred
        .iter()
        .rfind(|inferred| inferred.end_ns != 0)
        .expect("cycles");
    let cycles = answer["cycles"].as_array().expect("a list");
    let same = cycles
        .iter()
        .find(|cycle| cycle["phase"] == live.end_phase)
        .expect("that cycle");
    assert_eq!(same["advance_m"], live.advance_m);
    assert_eq!(same["energy_loss_sigma_j"], live.energy_loss_sigma_j);
}

#[test]
fn a_mark_must_make_sense() {
    let crawling = Crawling::start("mark");
    let mark = |arguments: &[&str]| {
        let output = crawling
            .worm
            .wormd(&[&["command", "mark"], arguments].concat())
            .output();
        (
            output.status.code(),
            String::from_utf8_lossy(&output.stderr).into_owned(),
        )
    };
    for (arguments, named) in [
        (&[][..], "--position"),
        (&["--position", "nan"], "--position"),
        (&["--position", "1e9"], "--position"),
        (&["--position", "1", "--sigma", "0"], "--sigma"),
        (&["--sigma", "0.1"], "--position"),
    ] {
        let (code, said) = mark(arguments);
        assert_eq!((code, said.contains(named)), (Some(2), true), "{arguments:?}: {said}");
    }
    assert_eq!(mark(&["--position", "-1.5"]).0, Some(0));
}
