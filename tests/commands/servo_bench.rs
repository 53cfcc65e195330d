//! A servo on a bench: `wormd explain` and `wormd predict` on the recordings of a real one, and what they refuse.

use super::workspace::{Workspace, said, wormd};
use serde_json::Value;
use std::path::{Path, PathBuf};

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("examples/xl330-bench")
        .join(name)
}

/// A campaign of three of the real recordings, with these lines in place of others.
fn campaign(files: &Workspace, change: &[(&str, &str)]) -> PathBuf {
    let mut text =
        "plant = \"servo-bench\"\n[bench]\nmass_kg = 0.49\nlength_m = 0.1\nsupply_v = 7.4\nservo = \"xl330-m288-t\"\n"
            .to_owned();
    for (trajectory, gain) in [("sin_sin", 400), ("sin_time_square", 200), ("lift_and_drop", 200)] {
        let recording = example(&format!("{trajectory}-p{gain}.csv"));
        text += &format!(
            "[[run]]\nrecording = \"{}\"\nposition_p_gain = {gain}\n",
            recording.display()
        );
    }
    for (from, to) in change {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    files.write("bench.toml", &text)
}

fn json(arguments: &[&str]) -> Value {
    let output = wormd(arguments);
    assert!(output.status.success(), "{}", said(&output));
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

/// What is written back predicts the recordings better than the data sheet, also one that was not in the campaign.
#[test]
fn what_explain_writes_predict_reads() {
    let files = Workspace::new();
    let campaign = campaign(&files, &[]);
    let (campaign, out) = (campaign.to_str().expect("plain"), files.path("why"));
    let out = out.to_str().expect("plain");
    let answer = json(&["explain", campaign, "--json", "--out", out]);
    for key in [
        "verdict",
        "sentence",
        "effects",
        "rivals",
        "where",
        "gap",
        "calibration",
        "screening",
        "threshold",
        "null_probability",
        "other_probability",
        "current",
        "runs",
        "warnings",
    ] {
        assert!(!answer[key].is_null(), "{key} in {answer}");
    }
    assert_eq!(answer["plant"], "servo-bench");
    assert_eq!(answer["current"]["measures"], "duty", "{answer}");
    let page = std::fs::read_to_string(files.path("why/report.html")).expect("a page");
    assert!(page.contains("Friction over speed and load"));
    let model = files.path("why/model.toml");
    let model = model.to_str().expect("plain");
    let whole = example("bench.toml");
    let whole = whole.to_str().expect("plain");
    let mean = |value: &Value| value["mean_absolute_error_rad"].as_f64().expect("a number");
    let (sheet, found) = (
        json(&["predict", whole, "--json"]),
        json(&["predict", whole, "--config", model, "--json"]),
    );
    assert_eq!(found["runs"].as_array().map(Vec::len), Some(12));
    for key in [
        "mean_absolute_error_rad",
        "root_mean_square_error_rad",
        "mean_absolute_error_a",
        "root_mean_square_error_a",
    ] {
        assert!(found["runs"][0][key].is_number(), "{found}");
    }
    assert!(
        mean(&found) < 0.7 * mean(&sheet),
        "{} rad, {} by the data sheet",
        mean(&found),
        mean(&sheet)
    );
}

#[test]
fn what_cannot_be_used_is_refused_with_exit_status_2() {
    let files = Workspace::new();
    let real = std::fs::read_to_string(example("sin_sin-p400.csv")).expect("a recording");
    let first = example("sin_sin-p400.csv").display().to_string();
    let lines: Vec<&str> = real.lines().collect();
    let backward: Vec<&str> = [&lines[..40], &lines[30..]].concat();
    let with = |name: &str, text: &str| files.write(name, text).display().to_string();
    let cases = [
        ("mass_kg = 0.49\n".to_owned(), String::new(), "[bench] has no mass_kg"),
        (
            first.clone(),
            with("no-goal.csv", &real.replace("goal_rad", "target_rad")),
            "no column goal_rad",
        ),
        (
            first.clone(),
            with("backward.csv", &backward.join("\n")),
            "time runs backward",
        ),
        (
            first.clone(),
            with("unsigned.csv", &without_sign_of_current(&lines)),
            "read without its sign",
        ),
        (first, with("counts.csv", &in_degrees(&lines)), "another servo's scale"),
        ("servo-bench".to_owned(), "rover".to_owned(), "plant = \"rover\""),
    ];
    for (from, to, reason) in cases {
        let campaign = campaign(&files, &[(&from, &to)]);
        let campaign = campaign.to_str().expect("plain");
        for command in [&["explain", campaign, "--json"][..], &["predict", campaign]] {
            let output = wormd(command);
            assert_eq!(output.status.code(), Some(2), "{command:?}: {}", said(&output));
            assert!(said(&output).contains(reason), "{reason}: {}", said(&output));
        }
    }
    let campaign = campaign(&files, &[]);
    let output = wormd(&["explain", campaign.to_str().expect("plain"), "--slope", "30", "--json"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        said(&output).contains("a servo on a bench has no slope"),
        "{}",
        said(&output)
    );
}

/// Negative currents as the register holds them.
fn without_sign_of_current(lines: &[&str]) -> String {
    changed(lines, 4, |current_ma| {
        if current_ma < 0.0 {
            current_ma + 65_536.0
        } else {
            current_ma
        }
    })
}

/// Positions of a servo with fewer counts in a turn.
fn in_degrees(lines: &[&str]) -> String {
    changed(lines, 2, |rad| rad * 300.0 / 90.0)
}

fn changed(lines: &[&str], column: usize, change: impl Fn(f64) -> f64) -> String {
    let row = |line: &&str| {
        let mut values: Vec<String> = line.split(',').map(str::to_owned).collect();
        if let Ok(value) = values[column].parse::<f64>() {
            values[column] = format!("{:.6}", change(value));
        }
        values.join(",")
    };
    lines.iter().map(row).collect::<Vec<_>>().join("\n")
}

/// For a worm the same command compares cell positions.
#[test]
fn predict_knows_how_far_a_worm_is_from_its_model() {
    let files = Workspace::new();
    let effect = ["--effect", "constant-drag:force_n=0.5", "--cycles", "6"];
    files.simulate("up.csv", "20", &effect);
    let campaign = files.write(
        "campaign.toml",
        "plant = \"worm\"\n[[run]]\nrecording = \"up.csv\"\nslope_deg = 20.0\n",
    );
    let text = std::fs::read_to_string("config/worm.toml").expect("the configuration");
    let model = files.write(
        "model.toml",
        &format!("{text}\n[[effect]]\nname = \"constant-drag\"\nforce_n = 0.5\n"),
    );
    let (campaign, model) = (campaign.to_str().expect("plain"), model.to_str().expect("plain"));
    let mean = |answer: &Value| answer["runs"][0]["mean_absolute_error_m"].as_f64().expect("a number");
    let (plain, with) = (
        json(&["predict", campaign, "--json"]),
        json(&["predict", campaign, "--config", model, "--json"]),
    );
    assert_eq!(plain["plant"], "worm");
    assert!(
        mean(&with) < 2e-4 && mean(&plain) > 3.0 * mean(&with),
        "{} and {} m",
        mean(&plain),
        mean(&with)
    );
}
