//! `wormd explain` as people and scripts call it: what cannot be used is named and ends with status 2, whatever was found is a
//! success, and what was found stays.

use super::workspace::{Workspace, said, wormd};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Output;
use worm_estimator::config::Config;

fn explain(input: &Path, more: &[&str]) -> Output {
    let mut arguments = vec!["explain".into(), input.to_path_buf()];
    arguments.extend(more.iter().map(PathBuf::from));
    wormd(&arguments)
}

fn object(text: &[u8]) -> Value {
    serde_json::from_slice(text).expect("one JSON object and nothing else")
}

fn file(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A campaign of runs, each with its lines beyond `recording`.
fn campaign(worm: &str, runs: &[(&str, &str)]) -> String {
    let run = |(recording, rest): &(&str, &str)| format!("\n[[run]]\nrecording = \"{recording}\"\n{rest}\n");
    format!("worm = \"{worm}\"\n{}", runs.iter().map(run).collect::<String>())
}

#[test]
fn what_cannot_be_explained_is_named_and_ends_with_status_2() {
    let writer = Workspace::new();
    writer.simulate("level.csv", "0", &["--cycles", "6"]);
    writer.simulate("up.csv", "30", &["--cycles", "6", "--positions-only"]);
    writer.simulate("short.csv", "0", &["--cycles", "1.2"]);
    writer.write("poem.csv", "Of worms, I sing\n1, 2\n");
    writer.write("worm.toml", "");
    writer.write("six.toml", "[worm]\ncells = 6\nstep_order = [1, 2, 3, 4, 5, 6]\n");
    let effect = |text: &str| format!("[[effect]]\n{text}\n");
    writer.write("gremlins.toml", &effect("name = \"gremlins\""));
    writer.write("parameter.toml", &effect("name = \"payload\"\nmass_g = 20"));
    writer.write(
        "cell.toml",
        &effect("name = \"unequal-clamping\"\nfriction_factor = 0.7\ncell = 5"),
    );
    let level = ("level.csv", "slope_deg = 0.0");
    writer.write("copy.csv", &file(&writer.path("level.csv")));
    let written = |name: &str, worm: &str, runs: &[(&str, &str)]| writer.write(name, &campaign(worm, runs));
    let taken = writer.write("taken", "");
    let six = writer.path("six.toml");
    let six = six.to_str().expect("plain");
    let taken = taken.to_str().expect("plain");

    let table: &[(PathBuf, &[&str], &[&str])] = &[
        (writer.path("nowhere.toml"), &[], &["nowhere.toml", "[[run]]"]),
        (
            writer.write("empty.toml", ""),
            &[],
            &["empty.toml:1", "no run", "[[run]]"],
        ),
        (
            written("positions.toml", "worm.toml", &[("up.csv", "slope_deg = 30.0")]),
            &["--current"],
            &["no recording has the motor's current", "record with wormd"],
        ),
        (
            written("missing.toml", "worm.toml", &[level, ("gone.csv", "slope_deg = 3.0")]),
            &[],
            &["missing.toml:8", "gone.csv", "relative to the campaign"],
        ),
        (
            written("angles.toml", "worm.toml", &[level, ("level.csv", "slope_deg = 3.0")]),
            &[],
            &["angles.toml:8", "contradictory slopes", "0° and with 3°", "once"],
        ),
        (
            written("copies.toml", "worm.toml", &[level, ("copy.csv", "slope_deg = 3.0")]),
            &[],
            &["copy.csv: it is a copy of", "level.csv", "once, with its own slope"],
        ),
        (
            written("no-worm.toml", "nobody.toml", &[level]),
            &[],
            &["campaign's worm", "nobody.toml"],
        ),
        (
            written("other.toml", "six.toml", &[level]),
            &[],
            &["six.toml has 6 cells", "level.csv has 4", "one worm"],
        ),
        (
            written("gremlin-run.toml", "gremlins.toml", &[level]),
            &[],
            &[
                "gremlins.toml: effect = \"gremlins\"",
                "the library has unequal-clamping",
            ],
        ),
        (
            written("parameter-run.toml", "parameter.toml", &[level]),
            &[],
            &["parameter.toml", "`payload` has no parameter `mass_g`: it has mass_kg"],
        ),
        (
            written("cell-run.toml", "cell.toml", &[level]),
            &[],
            &["cell.toml", "`unequal-clamping`: cell 5 of 4: give 1 to 4"],
        ),
        (
            written("brief.toml", "worm.toml", &[level, ("short.csv", "slope_deg = 0.0")]),
            &[],
            &["short.csv", "1.2 gait cycles are too few"],
        ),
        (
            written(
                "slow.toml",
                "worm.toml",
                &[level, ("up.csv", "slope_deg = 30.0\ncycle_s = 5.0")],
            ),
            &[],
            &["up.csv", "took 2.50 s, but cycle_s = 5", "leave cycle_s out"],
        ),
        (
            written(
                "loaded.toml",
                "worm.toml",
                &[level, ("up.csv", "slope_deg = 30.0\npayload_kg = 5.0")],
            ),
            &[],
            &["up.csv", "payload of 5 kg at 30°", "crawl"],
        ),
        (
            written("angle.toml", "worm.toml", &[level]),
            &["--slope", "0"],
            &["a campaign has its own slopes", "--slope"],
        ),
        (writer.path("level.csv"), &[], &["level.csv", "--slope DEG"]),
        (
            writer.path("gone.csv"),
            &["--slope", "0"],
            &["gone.csv", "cannot be read"],
        ),
        (writer.path("poem.csv"), &["--slope", "0"], &["poem.csv", "time_s"]),
        (writer.path("."), &["--slope", "0"], &["is not a file"]),
        (writer.path("short.csv"), &["--slope", "0"], &["short.csv", "too few"]),
        (
            writer.path("level.csv"),
            &["--slope", "0", "--config", six],
            &["4 cells", "6", "--config"],
        ),
        (
            writer.path("level.csv"),
            &["--slope", "0", "--out", taken],
            &["taken", "directory"],
        ),
        (
            writer.path("level.csv"),
            &["--slope", "0", "--out", "/proc/nowhere"],
            &["/proc/nowhere", "directory"],
        ),
        (writer.path("level.csv"), &["--live"], &["--live"]),
        (writer.path("level.csv"), &["--cycles", "8"], &["--live"]),
        (writer.path("level.csv"), &["--slope", "0", "--seed", "x"], &["--seed"]),
    ];
    for (input, more, expected) in table {
        let more = [&["--json"], *more].concat();
        let output = explain(input, &more);
        let said = said(&output);
        assert_eq!(output.status.code(), Some(2), "{input:?} {more:?}: {said}");
        assert!(
            output.stdout.is_empty(),
            "nothing but the answer goes to standard output"
        );
        for part in *expected {
            assert!(said.contains(part), "no {part:?} for {input:?} {more:?} in\n{said}");
        }
    }
    for (arguments, expected) in [
        (&["explain", "--json"][..], "CAMPAIGN|RECORDING"),
        (&["explain", "level.csv", "--slope", "0"], "--out"),
        (&["explain", "--live", "--json"], "--out"),
        (&["explain", "--live", "--cycles", "0", "--out", taken], "--cycles"),
        (&["explain", "--live", "--out", taken], "taken"),
    ] {
        let output = wormd(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(said(&output).contains(expected), "{arguments:?}: {}", said(&output));
    }
}

/// Whom permissions bind, that is.
#[test]
fn a_recording_that_may_not_be_read_is_refused() {
    use std::os::unix::fs::PermissionsExt;
    let writer = Workspace::new();
    let recording = writer.write("secret.csv", "time_s,x1_m,x2_m\n");
    std::fs::set_permissions(&recording, std::fs::Permissions::from_mode(0o000)).expect("it is the test's own");
    let output = explain(&recording, &["--slope", "0", "--json"]);
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    if !nix::unistd::geteuid().is_root() {
        assert!(said(&output).contains("that you may read"), "{}", said(&output));
    }
}

#[test]
fn one_recording_is_explained_and_everything_is_kept() {
    let writer = Workspace::new();
    let recording = writer.simulate("level.csv", "0", &["--cycles", "6", "--rest", "0.3", "--rate", "60"]);
    let dir = writer.path("deep/found");
    let out = dir.to_str().expect("plain");
    let output = explain(&recording, &["--slope", "0", "--out", out, "--json"]);
    assert!(output.status.success(), "{}", said(&output));
    let answer = object(&output.stdout);
    for key in [
        "verdict",
        "sentence",
        "effects",
        "rivals",
        "where",
        "gap",
        "remainder",
        "next_experiment",
        "calibration",
        "screening",
        "threshold",
        "null_probability",
        "other_probability",
        "agrees_within_m",
        "discrepancy_m",
        "runs",
        "warnings",
    ] {
        assert!(answer.get(key).is_some(), "no {key} in {answer}");
    }
    assert_eq!(answer["runs"].as_array().map(Vec::len), Some(1));
    assert_eq!(object(file(&dir.join("report.json")).as_bytes()), answer);
    assert!(file(&dir.join("report.html")).contains("</html>"));
    let model = Config::load(&dir.join("model.toml")).expect("the model can be used");
    assert_eq!(model.worm.cells, 4);
    let diff = file(&dir.join("model.diff"));
    let is_new = file(&dir.join("model.toml")) != Config::COMMENTED;
    assert_eq!(is_new, diff.starts_with("--- believed\n+++ model.toml\n@@ "), "{diff}");

    // The same in words.
    let output = explain(&recording, &["--slope", "0", "--out", out]);
    assert!(output.status.success(), "{}", said(&output));
    let text = String::from_utf8_lossy(&output.stdout);
    let sentence = answer["sentence"].as_str().expect("a sentence");
    for part in [
        sentence,
        "the gap",
        "held-out cycles, mm",
        "recalibrated",
        "noise floor",
    ] {
        assert!(text.contains(part), "no {part:?} in\n{text}");
    }
    for part in ["report.html", "model.toml", "model.diff"] {
        assert!(said(&output).contains(part), "{}", said(&output));
    }
}

/// The worm of the recordings grips 4 % harder than believed: after one round, nothing is left to recalibrate.
#[test]
fn the_written_back_model_agrees_with_the_campaign_it_comes_from() {
    let writer = Workspace::new();
    let truth = ["--cycles", "8", "--max-deformation-mm", "1.82,1.82,1.82,1.82"];
    writer.simulate("level.csv", "0", &truth);
    writer.simulate("up.csv", "30", &truth);
    writer.write(
        "worm.toml",
        "# My worm\n[worm]\nmax_deformation_m = 0.00175 # as measured\n",
    );
    let runs = [
        ("level.csv", "slope_deg = 0.0"),
        ("up.csv", "slope_deg = 30.0\ncycle_s = 2.5"),
    ];
    let found_m = |worm: &str, name: &str| {
        let input = writer.write(&format!("{name}.toml"), &campaign(worm, &runs));
        let dir = writer.path(name);
        let output = explain(&input, &["--json", "--out", dir.to_str().expect("plain")]);
        assert!(output.status.success(), "{}", said(&output));
        assert_eq!(object(&output.stdout)["verdict"], "agrees", "{name}");
        let model = dir.join("model.toml");
        assert!(file(&model).starts_with("# My worm\n"));
        let config = Config::load(&model).expect("a configuration");
        assert_eq!(config.effect, [], "nothing is missing");
        config.worm.max_deformation_m.to_vec(4)
    };
    let first_m = found_m("worm.toml", "first");
    let second_m = found_m("first/model.toml", "second");
    for (first_m, second_m) in first_m.iter().zip(&second_m) {
        assert!((first_m - 0.00182).abs() < 2e-5, "{first_m} m");
        assert!((first_m - second_m).abs() < 2e-6, "{first_m} m, then {second_m} m");
    }
}

#[test]
fn what_goes_wrong_late_loses_nothing() {
    let writer = Workspace::new();
    let recording = writer.simulate("level.csv", "0", &["--cycles", "6", "--rate", "60"]);
    let short = writer.simulate("short.csv", "0", &["--cycles", "1.2"]);
    let dir = writer.path("found");
    let out = dir.to_str().expect("plain");

    let output = explain(&short, &["--slope", "0", "--out", out]);
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    let report = object(file(&dir.join("report.json")).as_bytes());
    assert!(
        report["error"].as_str().is_some_and(|error| error.contains("too few")),
        "{report}"
    );
    assert_eq!(report["stage"], "gait");
    assert_eq!(report["runs"][0]["slope_deg"], 0.0);

    // The page cannot take the place of a folder.
    std::fs::create_dir_all(dir.join("report.html/full")).expect("a folder");
    let output = explain(&recording, &["--slope", "0", "--out", out, "--json"]);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("report.html"), "{}", said(&output));
    assert_eq!(
        object(file(&dir.join("report.json")).as_bytes()),
        object(&output.stdout)
    );
    Config::load(&dir.join("model.toml")).expect("the model is there");
    let files = std::fs::read_dir(&dir).expect("a folder").flatten();
    let names: Vec<_> = files
        .map(|file| file.file_name().to_string_lossy().into_owned())
        .collect();
    assert!(names.iter().all(|name| !name.ends_with(".part")), "{names:?}");
}

#[test]
fn an_effect_for_a_simulation_is_checked() {
    let writer = Workspace::new();
    let out = writer.path("x.csv");
    let out = out.to_str().expect("plain");
    for (effect, expected) in [
        ("gremlins:force_n=1", "the library has unequal-clamping"),
        ("constant-drag:force_n", "NAME:PARAM=VALUE"),
        (
            "unequal-clamping:friction_factor=0.7,cell=5",
            "cell 5 of 4: give 1 to 4",
        ),
    ] {
        let output = wormd(&[
            "simulate", "--slope", "0", "--cycles", "2", "--out", out, "--effect", effect,
        ]);
        assert_eq!(output.status.code(), Some(2), "{effect}");
        assert!(said(&output).contains(expected), "{effect}: {}", said(&output));
    }
}
