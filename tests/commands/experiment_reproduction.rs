//! The paper's experiment as one would do it at home: simulate the worm of section 3.2.3, analyse what was recorded, and find
//! its figures again. Real commands, real files.

use serde_json::Value;
use std::path::Path;
use std::process::Command;
use std::sync::LazyLock;

/// The largest tip deformations of section 3.2.3, mm.
const BOUNDS_MM: [f64; 4] = [2.0, 1.1, 1.75, 2.15];
const MASS_KG: f64 = 0.333;
/// Slope, and the advance of that worm in a cycle by an independent simulation, mm.
const ADVANCE_MM: [(f64, f64); 3] = [(0.0, 6.356), (30.0, 3.333), (45.0, 1.379)];

/// Runs `wormd` and returns what it writes to standard output.
#[track_caller]
fn wormd(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_wormd"))
        .args(arguments)
        .output()
        .expect("the binary runs");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success(),
        "{arguments:?} ended with {}\n{error}",
        output.status
    );
    String::from_utf8(output.stdout).expect("wormd writes UTF-8")
}

/// Records the worm on a slope and returns the file's path.
fn simulated(folder: &Path, slope_deg: f64) -> String {
    let file = folder
        .join(format!("slope{slope_deg}.csv"))
        .to_string_lossy()
        .into_owned();
    let bounds = BOUNDS_MM.map(|mm| mm.to_string()).join(",");
    let slope = slope_deg.to_string();
    wormd(&[
        "simulate",
        "--max-deformation-mm",
        &bounds,
        "--slope",
        &slope,
        "--cycles",
        "12",
        "--out",
        &file,
    ]);
    file
}

/// The worm analysed on every slope by itself, once for all tests that use it.
static ALONE: LazyLock<[Value; 3]> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a temporary folder");
    ADVANCE_MM.map(|(slope_deg, _)| {
        let file = simulated(folder.path(), slope_deg);
        json(&wormd(&["analyze", &file, "--slope", &slope_deg.to_string(), "--json"]))
    })
});

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("not JSON: {error}\n{text}"))
}

/// Follows a path of keys.
#[track_caller]
fn at<'a>(value: &'a Value, pointer: &str) -> &'a Value {
    value
        .pointer(pointer)
        .unwrap_or_else(|| panic!("{pointer} is missing in {value:#}"))
}

#[track_caller]
fn number(value: &Value, pointer: &str) -> f64 {
    let at = at(value, pointer);
    at.as_f64().unwrap_or_else(|| panic!("{pointer} is {at}, not a number"))
}

#[track_caller]
fn numbers(value: &Value, pointer: &str) -> Vec<f64> {
    let list = at(value, pointer).as_array();
    let list = list.unwrap_or_else(|| panic!("{pointer} is not a list"));
    list.iter()
        .map(|entry| entry.as_f64().expect("a list of numbers"))
        .collect()
}

#[track_caller]
fn assert_close(what: &str, value: f64, expected: f64, tolerance: f64) {
    assert!(
        (value - expected).abs() <= tolerance,
        "{what}: {value} should be {expected} within {tolerance}"
    );
}

/// What a run must say, whether it stands alone or in a campaign.
#[track_caller]
fn assert_like_the_paper(run: &Value, slope_deg: f64, advance_mm: f64) {
    let what = |name: &str| format!("{name} at {slope_deg}°");
    assert_eq!(number(run, "/slope_deg"), slope_deg);
    assert_eq!(numbers(run, "/step_order"), [1.0, 2.0, 3.0, 4.0]);
    assert_close(&what("stroke, m"), number(run, "/stroke_m"), 0.0115, 1e-4);
    assert_close(
        &what("advance, m"),
        number(run, "/mean/advance_m"),
        1e-3 * advance_mm,
        5e-5,
    );
    let theory_m = number(run, "/theory/identified/advance_m");
    assert_close(&what("advance in theory, m"), theory_m, 1e-3 * advance_mm, 1.5e-4);
    assert_close(&what("time of a cycle, s"), number(run, "/cycle_s"), 2.5, 0.1);
    let backward_m = numbers(run, "/mean/backward_slide_m");
    if slope_deg == 0.0 {
        assert!(at(run, "/mass_estimate_kg").is_null(), "nothing pulls on the level");
        assert_close(&what("backward slide of cell 2, m"), backward_m[1], 2.05e-3, 1e-4);
    } else {
        let mass_kg = number(run, "/mass_estimate_kg");
        assert_close(&what("mass, kg"), mass_kg, MASS_KG, 0.03 * MASS_KG);
        let pull_n = MASS_KG * 9.81 * slope_deg.to_radians().sin();
        let expected_m = -pull_n / 980.0;
        let mean_m = number(run, "/mean_deformation_m");
        assert_close(
            &what("mean deformation (8), m"),
            mean_m,
            expected_m,
            0.03 * expected_m.abs(),
        );
    }
    let [loss_j, net_j] = ["/mean/energy_loss_j", "/mean/energy_actuator_net_j"].map(|path| number(run, path));
    assert_close(&what("net work against losses, J"), net_j, loss_j, 0.03 * loss_j);
    assert!(number(run, "/mean/energy_actuator_positive_j") > net_j);
    assert!(number(run, "/rigid_energy_j") > 0.0);
    assert!(at(run, "/cycles").as_array().is_some_and(|cycles| cycles.len() >= 10));
}

fn assert_bounds(found: &Value, tolerance_m: f64) {
    let found_m = numbers(found, "/max_deformation_m");
    assert_eq!(found_m.len(), 4);
    for (cell, (found_m, mm)) in found_m.iter().zip(BOUNDS_MM).enumerate() {
        assert_close(
            &format!("bound of cell {}, m", cell + 1),
            *found_m,
            1e-3 * mm,
            tolerance_m,
        );
    }
}

#[test]
fn each_slope_gives_the_worm_back() {
    for (found, (slope_deg, advance_mm)) in ALONE.iter().zip(ADVANCE_MM) {
        println!(
            "{slope_deg}°: bounds {} m, advance {} m, mass {} kg",
            at(found, "/max_deformation_m"),
            at(found, "/mean/advance_m"),
            at(found, "/mass_estimate_kg")
        );
        assert_bounds(found, 0.05e-3);
        assert_like_the_paper(found, slope_deg, advance_mm);
    }
}

#[test]
fn a_campaign_gives_one_worm_back() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("a temporary file can be written");
        path.to_string_lossy().into_owned()
    };
    write("worm.toml", "[worm]\nmass_kg = 0.333\n");
    let mut campaign = "worm = \"worm.toml\"\n".to_owned();
    for (slope_deg, _) in ADVANCE_MM {
        simulated(folder.path(), slope_deg);
        campaign += &format!("\n[[run]]\nrecording = \"slope{slope_deg}.csv\"\nslope_deg = {slope_deg:?}\n");
    }
    let found = json(&wormd(&["analyze", &write("campaign.toml", &campaign), "--json"]));
    println!("together: bounds {} m", at(&found, "/max_deformation_m"));
    assert_bounds(&found, 0.05e-3);
    let runs = at(&found, "/runs").as_array().expect("a list of runs");
    assert_eq!(runs.len(), ADVANCE_MM.len());
    for (run, (slope_deg, advance_mm)) in runs.iter().zip(ADVANCE_MM) {
        assert_like_the_paper(run, slope_deg, advance_mm);
    }
}

/// The fields of an analysis, as scripts read them.
#[test]
fn an_analysis_prints_the_contracted_fields() {
    let found = &ALONE[1];
    assert_eq!(number(found, "/slope_deg"), 30.0);
    let values = [
        "advance_m",
        "forward_slide_m",
        "backward_slide_m",
        "energy_loss_j",
        "energy_actuator_net_j",
        "energy_actuator_positive_j",
    ];
    let fields: [(&str, &[&str]); 6] = [
        (
            "",
            &[
                "recording",
                "slope_deg",
                "cells",
                "samples",
                "duration_s",
                "cycle_s",
                "step_order",
                "phase_source",
                "stroke_m",
                "noise_m",
                "first_estimate",
                "paper_search",
                "max_deformation_m",
                "max_deformation_sigma_m",
                "laid_down",
                "mean_deformation_m",
                "mass_estimate_kg",
                "mass_sigma_kg",
                "momentum_violation_n",
                "cycles",
                "mean",
                "std",
                "theory",
                "rigid_energy_j",
                "warnings",
            ],
        ),
        ("/first_estimate", &["max_deformation_m"]),
        (
            "/paper_search",
            &["max_deformation_m", "candidates", "mean_force_n", "force_std_n"],
        ),
        ("/mean", &values),
        ("/theory/identified", &["max_deformation_m", "rigid_energy_j"]),
        ("/cycles/0", &["index", "start_s", "duration_s", "settled"]),
    ];
    for (place, names) in fields {
        let object = at(found, place).as_object().expect("an object");
        for name in names {
            assert!(object.contains_key(*name), "{place}/{name} is missing");
        }
    }
    for place in ["/std", "/theory/identified", "/theory/nominal", "/cycles/0"] {
        let object = at(found, place).as_object().expect("an object");
        assert!(
            values.iter().all(|name| object.contains_key(*name)),
            "{place} lacks figures"
        );
    }
    assert_eq!(at(found, "/paper_search/candidates"), 2401);
    assert!(found.get("series").is_none(), "the series are no part of the JSON");
}
