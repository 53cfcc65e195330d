//! Bad input gets a clear error that names the file, key or device and the remedy, and exit status 2; nothing hangs.

use std::path::Path;
use std::process::{Command, Output};
use testkit::log_sample::{crawl, write_log};

fn wormd(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_wormd"))
        .args(arguments)
        .output()
        .expect("the binary runs")
}

fn config(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).expect("a temporary file can be written");
    path.to_string_lossy().into_owned()
}

#[test]
fn unusable_input_is_named_and_ends_with_status_2() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let unknown_key = config(folder.path(), "unknown.toml", "[worm]\nlegs = 6\n");
    let out_of_range = config(folder.path(), "range.toml", "[gait]\ncycle_s = 0.0\n");
    let not_toml = config(folder.path(), "not.toml", "worm = [\n");
    let wrong_model = config(folder.path(), "model.toml", "[servo]\nmodel_number = 1190\n");
    let log = folder.path().join("log.mcap");
    write_log(&log, &crawl(0.2));
    let log = log.to_string_lossy().into_owned();
    let table: &[(&[&str], &[&str])] = &[
        (&["up", "--config", "no/such.toml"], &["no/such.toml", "--config"]),
        (&["up", "--config", &unknown_key], &["unknown.toml:2:1", "legs"]),
        (
            &["up", "--config", &out_of_range],
            &["range.toml", "gait.cycle_s = 0", "0.5 to 120 s"],
        ),
        (&["up", "--config", &not_toml], &["not.toml:"]),
        (
            &["up", "--name", "cl-model", "--config", &wrong_model, "--json"],
            &["1200", "1190"],
        ),
        (&["up", "--name", "No Name"], &["worm.name", "a-z"]),
        (&["up", "--duration", "-3"], &["-3", "more than 0 s"]),
        (&["up", "--duration", "nan"], &["nan"]),
        (
            &["up", "--fault", "earthquake", "--name", "cl-fault"],
            &["earthquake", "stall"],
        ),
        (
            &["up", "--port", "/dev/null", "--fault", "stall"],
            &["--fault", "virtual worm"],
        ),
        (
            &["up", "--port", "/dev/no-such-port", "--name", "cl-port"],
            &["/dev/no-such-port", "cable"],
        ),
        (&["control"], &["no serial port", "--port"]),
        (&["control", "--port", "/dev/null", "--name", "cl-null"], &["/dev/null"]),
        (&["command", "dance"], &["dance", "arm"]),
        (&["command", "hold", "--speed", "1"], &["--speed", "crawl"]),
        (&["command", "crawl", "--speed", "0"], &["--speed", "hold"]),
        (&["command", "crawl", "--speed", "nan"], &["--speed", "number"]),
        (&["command", "crawl", "--for", "-3"], &["-3", "more than 0 s"]),
        (&["study", "--efficiency", "0.5"], &["--efficiency", "--battery"]),
        (&["study", "--json", "--battery=-5"], &["-5", "above 0"]),
        (&["study", "--cells", "1"], &["1 cells", "2 to 16"]),
        (&["study", "--slopes", "steep"], &["steep"]),
        (&["study", "--battery=-5"], &["-5", "above 0"]),
        (
            &["infer", "no/such.mcap"],
            &["no/such.mcap: cannot be read", "check that the file is there"],
        ),
        (&["export", "no/such.mcap"], &["--mcap", "--parquet"]),
        (
            &["export", "no/such.mcap", "--mcap", "copy.mcap"],
            &["no/such.mcap: cannot be read", "check that the file is there"],
        ),
        (
            &["export", &not_toml, "--mcap", &not_toml, "--force"],
            &["not.toml is the log itself", "choose another name"],
        ),
        (
            &["export", &log, "--csv", "/dev/null"],
            &["/dev/null: it is no folder", "choose another place"],
        ),
        (
            &["export", &log, "--parquet", &not_toml],
            &["not.toml: it is no folder", "choose another place"],
        ),
        (
            &["export", &log, "--mcap", "/no/such/folder/x.mcap"],
            &["x.mcap: cannot be written", "choose another place"],
        ),
        (
            &["export", &log, "--mcap", "/dev/null", "--force"],
            &["/dev/null: it is no file that can be replaced", "choose another place"],
        ),
        (
            &["why", &log, "--no-explain", "--out", "/dev/null"],
            &["/dev/null: the directory cannot be made", "name a directory"],
        ),
        (
            &["dashboard", "--token-file", "/no/such/token"],
            &["/no/such/token", "openssl rand"],
        ),
        (
            &["record", "--out", "x.mcap", "--max-total", "9MB"],
            &["--max-total 9MB is too small", "10MB"],
        ),
        (
            &["record", "--out", "x.mcap", "--max-total", "1GB", "--keep", "3"],
            &["--max-total", "--keep"],
        ),
        (
            &["bundle", "--config", "no/such.toml", "--out", "no/such.tar.zst"],
            &["no/such.toml: cannot be read", "--config"],
        ),
        (&["virtual-worm"], &["--link"]),
        (
            &["virtual-worm", "--link", "/no/such/folder/port"],
            &["/no/such/folder"],
        ),
        (&["frobnicate"], &["frobnicate"]),
    ];
    for (arguments, parts) in table {
        let output = wormd(arguments);
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(
            output.status.code(),
            Some(2),
            "{arguments:?} ended with {}\n{error}",
            output.status
        );
        for part in *parts {
            assert!(error.contains(part), "{arguments:?} does not say {part:?}:\n{error}");
        }
        assert!(output.stdout.is_empty(), "{arguments:?} wrote to standard output");
    }
}

/// A disk that is full is not made fuller: what was written of a bundle goes again.
#[test]
fn a_bundle_that_has_no_room_leaves_nothing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("bundle.tar.zst");
    // No file may be larger than a block.
    let limited = "trap '' XFSZ; ulimit -f 1; exec \"$0\" bundle --name cl-bundle --out \"$1\"";
    let output = Command::new("bash")
        .args(["-c", limited, env!("CARGO_BIN_EXE_wormd")])
        .arg(&out)
        .output()
        .expect("bash runs");
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{error}");
    assert!(error.contains("bundle.tar.zst: cannot be written"), "{error}");
    let left: Vec<_> = std::fs::read_dir(folder.path()).expect("a folder").collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn a_command_without_a_controller_says_how_to_start_one() {
    let output = wormd(&["command", "arm", "--name", "cl-nobody"]);
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{error}");
    assert!(error.contains("cl-nobody") && error.contains("wormd up"), "{error}");
}

/// The JSON of a study, as scripts read it.
#[test]
fn a_study_prints_the_contracted_fields() {
    let output = wormd(&["study", "--json", "--cells", "3,4", "--slopes", "0,45"]);
    assert!(output.status.success());
    let rows: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON array");
    let names = [
        "cells",
        "slope_deg",
        "progresses",
        "advance_m",
        "energy_positive_j",
        "energy_net_j",
        "cot",
        "energy_per_distance_j_per_m",
    ];
    let rows = rows.as_array().expect("an array");
    assert_eq!(rows.len(), 4);
    for row in rows {
        let keys: Vec<_> = row.as_object().expect("objects").keys().map(String::as_str).collect();
        assert!(
            names.iter().all(|name| keys.contains(name)) && keys.len() == names.len(),
            "{keys:?}"
        );
    }
    assert_eq!(
        (&rows[1]["progresses"], &rows[1]["advance_m"]),
        (&false.into(), &serde_json::Value::Null)
    );
}

/// With a battery each row also shows how far it takes the worm.
#[test]
fn a_study_with_a_battery_tells_the_range() {
    let output = wormd(&[
        "study",
        "--json",
        "--cells",
        "3",
        "--slopes",
        "0,45",
        "--battery",
        "100",
    ]);
    assert!(output.status.success());
    let rows: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON array");
    let range_m = rows[0]["range_m"].as_f64().expect("the level is climbed");
    assert!((16.0..16.2).contains(&range_m), "{range_m}");
    assert!(rows[1]["range_m"].is_null() && rows[1]["range_cycles"].is_null());
}
