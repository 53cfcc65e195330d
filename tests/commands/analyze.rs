//! `wormd analyze` as people and scripts call it: input that cannot be analysed is named and ends with status 2, the rest is reported.

use super::workspace::{Workspace, said, wormd};
use serde_json::Value;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Output;

/// The same CSV with its rows changed; `change` gets row number and fields.
fn changed(writer: &Workspace, name: &str, from: &Path, change: impl Fn(usize, &mut Vec<String>)) -> PathBuf {
    let text = std::fs::read_to_string(from).expect("a CSV");
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let mut changed = format!("{}\n", lines.next().expect("a header"));
    for (row, line) in lines.enumerate() {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        change(row, &mut fields);
        writeln!(changed, "{}", fields.join(",")).expect("a string");
    }
    writer.write(name, &changed)
}

fn analyze(recording: &Path, more: &[&str]) -> Output {
    let mut arguments = vec!["analyze".into(), recording.to_path_buf()];
    arguments.extend(more.iter().map(PathBuf::from));
    wormd(&arguments)
}

fn json(recording: &Path, more: &[&str]) -> Value {
    let output = analyze(recording, &[&["--json"], more].concat());
    assert!(output.status.success(), "{}", said(&output));
    serde_json::from_slice(&output.stdout).expect("one JSON object and nothing else")
}

fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().expect("a list");
    list.iter().map(|value| value.as_f64().expect("a number")).collect()
}

#[test]
fn what_cannot_be_analysed_is_named_and_ends_with_status_2() {
    let writer = Workspace::new();
    let level: &[&str] = &["--slope", "0"];
    let good = writer.simulate("good.csv", "0", &["--cycles", "4", "--positions-only"]);
    let with_phase = writer.simulate("phase.csv", "0", &["--cycles", "4"]);
    let six = writer.write("six.toml", "[worm]\ncells = 6\nstep_order = [1, 2, 3, 4, 5, 6]\n");
    let campaign = writer.write(
        "campaign.toml",
        "worm = \"worm.toml\"\n[[run]]\nrecording = \"good.csv\"\nslope_deg = 0.0\n",
    );
    writer.write("worm.toml", "");
    let short_log = writer.simulate("log.mcap", "0", &["--cycles", "1"]);
    let cut_log = writer.path("cut.mcap");
    let log = std::fs::read(&short_log).expect("a log");
    // Within the first compressed chunk, of which nothing can be unpacked.
    std::fs::write(&cut_log, &log[..1000]).expect("it is cut");

    let position = |cell: usize| 1 + cell; // time comes first
    let to_millimetres = |_: usize, fields: &mut Vec<String>| {
        for field in &mut fields[position(0)..=position(3)] {
            let at_m: f64 = field.parse().expect("a position");
            *field = (at_m * 1e3).to_string();
        }
    };
    let still = |row: usize, fields: &mut Vec<String>| {
        for (cell, field) in fields[position(0)..=position(3)].iter_mut().enumerate() {
            *field = format!(
                "{:.6}",
                0.12 - 0.04 * cell as f64 + 1e-5 * (row as f64 * 2.1 + cell as f64).sin()
            );
        }
    };
    let nowhere = |_: usize, fields: &mut Vec<String>| fields[position(0)..=position(3)].fill("nan".to_owned());
    let third_unseen = |_: usize, fields: &mut Vec<String>| fields[position(2)].clear();
    let third_fixed = |_: usize, fields: &mut Vec<String>| fields[position(2)] = "0.05".to_owned();
    let runs_back = |row: usize, fields: &mut Vec<String>| {
        // One wrong time is left out; a clock that was set back is no recording.
        if row >= 100 {
            let time_s: f64 = fields[0].parse().expect("a time");
            fields[0] = (time_s - 0.5).to_string();
        }
    };
    let mirrored = |_: usize, fields: &mut Vec<String>| {
        for field in &mut fields[position(0)..=position(3)] {
            let at_m: f64 = field.parse().expect("a position");
            *field = (-at_m).to_string();
        }
    };
    let in_degrees = |_: usize, fields: &mut Vec<String>| {
        let phase: f64 = fields[position(4)].parse().expect("a phase");
        fields[position(4)] = (phase * 360.0).to_string();
    };
    let table: &[(PathBuf, &[&str], &[&str])] = &[
        (good.clone(), &[], &["--slope"]),
        (campaign, level, &["campaign", "--slope"]),
        (writer.path("nowhere.csv"), level, &["nowhere.csv"]),
        (writer.write("poem.txt", "Of worms I sing\n"), level, &["poem.txt"]),
        (
            writer.write("poem.csv", "Of worms, I sing\n1, 2\n"),
            level,
            &["poem.csv", "time_s"],
        ),
        (writer.write("empty.csv", ""), level, &["empty.csv"]),
        (
            good.clone(),
            &["--slope", "0", "--config", six.to_str().expect("plain")],
            &["4 cells", "6", "--config"],
        ),
        (
            changed(&writer, "mm.csv", &good, to_millimetres),
            level,
            &["mm.csv", "millimetres"],
        ),
        (
            writer.simulate("one.csv", "0", &["--cycles", "1", "--positions-only"]),
            level,
            &["one.csv", "cycles are too few"],
        ),
        (
            writer.simulate("one-phase.csv", "0", &["--cycles", "1"]),
            level,
            &["1.0 gait cycles are too few"],
        ),
        (
            changed(&writer, "still.csv", &good, still),
            level,
            &["still.csv", "no cell moves"],
        ),
        (
            changed(&writer, "nan.csv", &good, nowhere),
            level,
            &["nan.csv", "no cell is ever seen"],
        ),
        (
            changed(&writer, "unseen.csv", &good, third_unseen),
            level,
            &["cell 3", "never seen"],
        ),
        (
            changed(&writer, "fixed.csv", &good, third_fixed),
            level,
            &["cell 3", "frozen", "cannot be used"],
        ),
        (
            changed(&writer, "back.csv", &good, runs_back),
            level,
            &["back.csv:", "time_s"],
        ),
        (
            changed(&writer, "mirrored.csv", &good, mirrored),
            level,
            &["crawls backward", "mirror"],
        ),
        (
            changed(&writer, "degrees.csv", &with_phase, in_degrees),
            level,
            &["phase", "counted in cycles"],
        ),
        (short_log, level, &["log.mcap", "cycles are too few"]),
        (cut_log, level, &["cut.mcap", "cut off after 0 messages"]),
        (good.clone(), &["--slope", "100"], &["100", "-90 to 90"]),
        (good.clone(), &["--slope", "nan"], &["NaN", "-90 to 90"]),
        (
            good.clone(),
            &["--slope", "0", "--from", "9.95"],
            &["good.csv", "--from"],
        ),
        (good.clone(), &["--slope", "0", "--payload=-5"], &["payload"]),
        (good, &["--slope", "0", "--axis", "up"], &["--axis"]),
    ];
    for (recording, more, parts) in table {
        let output = analyze(recording, more);
        let error = said(&output);
        let name = recording.file_name().expect("a name");
        assert_eq!(
            output.status.code(),
            Some(2),
            "{name:?} {more:?}: {}\n{error}",
            output.status
        );
        for part in *parts {
            assert!(
                error.contains(part),
                "{name:?} {more:?} does not say {part:?}:\n{error}"
            );
        }
        assert!(!error.contains("panicked"), "{name:?}: {error}");
        assert!(output.stdout.is_empty(), "{name:?} wrote to standard output");
    }
}

#[test]
fn a_folder_for_the_report_that_cannot_be_is_refused() {
    let writer = Workspace::new();
    let good = writer.simulate("good.csv", "0", &["--cycles", "4"]);
    let occupied = writer.write("occupied", "a file, no folder");
    let output = analyze(&good, &["--slope", "0", "--out", occupied.to_str().expect("plain")]);
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    assert!(said(&output).contains("occupied"), "{}", said(&output));
}

#[test]
fn json_is_one_object_with_the_contracted_keys() {
    let writer = Workspace::new();
    let recording = writer.simulate(
        "up.csv",
        "30",
        &["--cycles", "6", "--positions-only", "--dropout", "0.03"],
    );
    let analysis = json(&recording, &["--slope", "30"]);
    for key in [
        "cycle_s",
        "step_order",
        "max_deformation_m",
        "max_deformation_sigma_m",
        "mean_deformation_m",
        "mass_estimate_kg",
        "cycles",
        "mean",
        "std",
        "theory",
        "rigid_energy_j",
    ] {
        assert!(!analysis[key].is_null(), "{key} is missing");
    }
    let figures = [
        "advance_m",
        "forward_slide_m",
        "backward_slide_m",
        "energy_loss_j",
        "energy_actuator_net_j",
        "energy_actuator_positive_j",
    ];
    let theory = &analysis["theory"];
    for of in [
        &analysis["mean"],
        &analysis["std"],
        &analysis["cycles"][2],
        &theory["identified"],
        &theory["nominal"],
    ] {
        for figure in figures {
            assert!(!of[figure].is_null(), "{figure} is missing in {of}");
        }
    }
    assert_eq!(analysis["step_order"], serde_json::json!([1, 2, 3, 4]));
    assert_eq!(analysis["phase_source"], "positions");
    let is_close = |key: &str, expected: f64, within: f64| {
        let value = analysis[key].as_f64().expect("a number");
        assert!((value - expected).abs() < within, "{key} = {value}, not {expected}");
    };
    is_close("cycle_s", 2.5, 0.01);
    is_close("mass_estimate_kg", 0.333, 0.02);
    assert_eq!(analysis["cycles"].as_array().expect("a list").len(), 6);
    assert_eq!(numbers(&analysis["max_deformation_m"]).len(), 4);
}

#[test]
fn without_json_there_are_tables_and_with_out_there_is_a_report() {
    let writer = Workspace::new();
    let recording = writer.simulate("level.csv", "0", &["--cycles", "4"]);
    let out = writer.path("report");
    let output = analyze(&recording, &["--slope", "0", "--out", out.to_str().expect("plain")]);
    assert!(output.status.success(), "{}", said(&output));
    let tables = String::from_utf8_lossy(&output.stdout);
    for part in [
        "largest tip deformation",
        "mm",
        "mJ",
        "per cycle",
        "theory, identified worm",
    ] {
        assert!(tables.contains(part), "no {part:?} in\n{tables}");
    }
    assert!(said(&output).contains("report.html"), "{}", said(&output));
    let page = std::fs::read_to_string(out.join("report.html")).expect("a page");
    assert!(page.contains("<svg") && page.contains("</html>"));
    let files = std::fs::read_dir(&out).expect("a folder").flatten();
    let sheets = files.filter(|file| file.path().extension().is_some_and(|extension| extension == "csv"));
    assert!(sheets.count() >= 2, "series and cycles stand beside it");
}

#[test]
fn the_format_of_a_recording_does_not_change_its_figures() {
    let writer = Workspace::new();
    let more = [
        "--cycles",
        "6",
        "--seed",
        "3",
        "--max-deformation-mm",
        "2,1.1,1.75,2.15",
    ];
    let csv = json(&writer.simulate("same.csv", "20", &more), &["--slope", "20"]);
    let log = json(&writer.simulate("same.mcap", "20", &more), &["--slope", "20"]);
    let (of_csv_m, of_log_m) = (numbers(&csv["max_deformation_m"]), numbers(&log["max_deformation_m"]));
    for (of_csv_m, of_log_m) in of_csv_m.iter().zip(&of_log_m) {
        assert!((of_csv_m - of_log_m).abs() < 5e-6, "{of_csv_m} m and {of_log_m} m");
    }
    assert_eq!(csv["step_order"], log["step_order"]);
    let advances_m = [&csv, &log].map(|analysis| analysis["mean"]["advance_m"].as_f64().expect("an advance"));
    assert!((advances_m[0] - advances_m[1]).abs() < 5e-6, "{advances_m:?} m");
}

#[test]
fn from_and_to_cut_the_recording() {
    let writer = Workspace::new();
    let recording = writer.simulate("long.csv", "0", &["--cycles", "8"]);
    let cut = json(&recording, &["--slope", "0", "--from", "5", "--to", "15"]);
    assert_eq!(cut["duration_s"], 10.0);
    let cycles = cut["cycles"].as_array().expect("cycles");
    assert_eq!(cycles.len(), 4, "{cycles:?}");
    assert_eq!(cycles[0]["start_s"], 5.0);
}
