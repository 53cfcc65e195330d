//! A worm without a tracker, as real processes on a pseudo-terminal whose bus has none.

use super::worm::Worm;
use std::path::Path;
use worm_estimator::message::{AlarmKind, Inferred};
use worm_log::messages;

const NO_TRACKER: &str = "[tracker]\npresent = false\n";
/// For what needs some cycles, and nothing exact of the forces.
const FAST: &str = "[gait]\ncycle_s = 1.25\n";

fn json(output: &std::process::Output) -> serde_json::Value {
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}\n{error}", output.status);
    serde_json::from_slice(&output.stdout).expect("standard output is one JSON object")
}

#[test]
fn it_crawls_and_is_recorded_and_its_log_says_what_the_current_shows() {
    let worm = Worm::new("blind");
    let folder = tempfile::tempdir().expect("a folder");
    let log = folder.path().join("worm.mcap").to_string_lossy().into_owned();
    let config = worm.config(NO_TRACKER);
    let up = [
        "up",
        "--json",
        "--duration",
        "18",
        "--config",
        &config,
        "--record",
        &log,
    ];
    let summary = json(&worm.wormd(&up).output());
    assert_eq!(
        (&summary["mode"], &summary["fault"], &summary["alarms"]),
        (&"crawling".into(), &"none".into(), &serde_json::json!([]))
    );
    let cycles = summary["cycles"].as_array().expect("a list");
    assert!(cycles.len() >= 3, "{} cycles", cycles.len());
    for cycle in cycles {
        for unknown in [
            "advance_m",
            "energy_loss_j",
            "energy_actuator_net_j",
            "energy_friction_inside_j",
            "cot",
        ] {
            assert_eq!(cycle[unknown], serde_json::Value::Null, "{unknown}");
        }
        assert!(
            cycle["energy_electrical_j"]
                .as_f64()
                .is_some_and(|energy_j| energy_j > 0.1)
        );
    }
    let inferred = &summary["inferred"];
    for known in [
        "advance_m",
        "advance_sigma_m",
        "energy_loss_j",
        "position_m",
        "position_sigma_m",
    ] {
        assert!(
            inferred[known].as_f64().is_some_and(|value| value > 0.0),
            "{known}: {inferred}"
        );
    }
    let coverage = summary["alarm_coverage"].as_array().expect("a list");
    let of = |kind: AlarmKind| {
        coverage
            .iter()
            .find(|alarm| alarm["alarm"] == kind.name())
            .expect("every alarm")
    };
    assert_eq!(of(AlarmKind::MotorStall)["coverage"], "full");
    assert_eq!(of(AlarmKind::FrictionLoss)["coverage"], "full");
    assert_eq!(of(AlarmKind::SlidingDown)["coverage"], "off");

    let recorded = messages(Path::new(&log)).expect("a log");
    assert!(
        recorded
            .states
            .iter()
            .all(|state| state.sample == 0 && state.position_m[0].is_nan())
    );
    let replayed = worm.replay(&log);
    assert!(
        replayed.status.success(),
        "{}",
        String::from_utf8_lossy(&replayed.stderr)
    );
    let inferred = json(&worm.plain_wormd(&["infer", "--json", &log]).output());
    assert!(inferred["cycles"].as_array().is_some_and(|cycles| cycles.len() >= 2));
    assert!(
        inferred["cycles"][0]["advance_sigma_m"]
            .as_f64()
            .is_some_and(|sigma_m| sigma_m > 0.0)
    );
    let out = folder.path().join("why").to_string_lossy().into_owned();
    let output = worm
        .plain_wormd(&["explain", &log, "--slope", "0", "--out", &out])
        .output();
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{error}");
    assert!(error.contains("wormd infer"), "{error}");
    let analyzed = json(
        &worm
            .plain_wormd(&["analyze", &log, "--slope", "0", "--out", &out, "--json"])
            .output(),
    );
    assert_eq!(analyzed["evidence"], "current");
    let of = |group: &str, figure: &str| analyzed[group][figure].as_f64().expect("a number");
    // The level's 6.83 mm and 46.7 mJ, as far as the friction of the gears is known.
    let off_m = of("mean", "advance_m") - 6.83e-3;
    assert!(
        off_m.abs() < 4.0 * of("sigma", "advance_m") && off_m.abs() < 0.7e-3,
        "{analyzed}"
    );
    assert!((0.03..0.06).contains(&of("mean", "energy_loss_j")), "{analyzed}");
    assert!(Path::new(&out).join("report.html").is_file());
    let explained = json(
        &worm
            .plain_wormd(&["explain", &log, "--slope", "0", "--current", "--json"])
            .output(),
    );
    let run = &explained["runs"][0];
    assert_eq!(
        (&run["sees_positions"], &run["advance_m"][0]),
        (&false.into(), &serde_json::Value::Null)
    );
    let shown_j = run["current"]["work_j"][0].as_f64().expect("a work");
    // Of the level's 46.7 mJ; wherever in its gait the worm was stopped, which is no evidence.
    assert!((0.042..0.052).contains(&shown_j), "{run}");
    let stages = explained["gap"].as_array().expect("a list");
    assert!(
        stages
            .iter()
            .all(|stage| stage["torque"]["held_out_rms_n_m"].as_f64().is_some()),
        "{stages:?}"
    );
}

/// A device that tracks no cells says the slope, until it falls silent.
#[test]
fn an_inertial_sensor_measures_the_slope_of_a_worm_without_a_tracker() {
    let worm = Worm::new("pitch");
    let folder = tempfile::tempdir().expect("a folder");
    let log = folder.path().join("worm.mcap").to_string_lossy().into_owned();
    let config = worm.config(&format!(
        "{FAST}{NO_TRACKER}[inertial_sensor]\n[canal]\nslope_deg = 15.0\n"
    ));
    let up = [
        "up",
        "--json",
        "--duration",
        "13",
        "--config",
        &config,
        "--record",
        &log,
        "--fault",
        "silence:device=tracker@7",
    ];
    let summary = json(&worm.wormd(&up).output());
    assert_eq!(
        (&summary["mode"], &summary["fault"]),
        (&"crawling".into(), &"none".into())
    );
    let recorded = messages(Path::new(&log)).expect("a log");
    let states = &recorded.states;
    // The state with the last pitch; a computer that was held up falls silent later than in the seventh second.
    let last = states
        .iter()
        .rposition(|state| !state.pitch_rad.is_nan())
        .expect("a pitch");
    let silent_from_ns = states[last].time_ns;
    let crawled_s = (silent_from_ns - states[0].time_ns) as f64 * 1e-9;
    assert!(
        crawled_s > 4.0 && states.len() > last + 1000,
        "silent after {crawled_s} s"
    );
    let known = states[..=last].iter().filter(|state| !state.pitch_rad.is_nan());
    let off_deg = known.map(|state| (state.pitch_rad.to_degrees() - 15.0).abs());
    let worst_deg = off_deg.fold(0.0f64, |worst, off| worst.max(off));
    assert!(worst_deg < 3.0, "{worst_deg}");

    // Every cycle that was measured says the slope of the canal, and the newest, which was not, that it does not know it so well.
    let cycles = recorded
        .inferred
        .iter()
        .filter(|cycle| cycle.slope_sigma_rad.is_finite());
    let (while_measured, after) = cycles.partition::<Vec<&Inferred>, _>(|cycle| cycle.end_ns <= silent_from_ns);
    assert!(
        while_measured.len() >= 2 && after.len() >= 2,
        "{while_measured:?} {after:?}"
    );
    for cycle in while_measured {
        let slope_deg = cycle.slope_rad.to_degrees();
        assert!(
            cycle.slope_is_measured == 1 && (slope_deg - 15.0).abs() < 2.0,
            "{cycle:?}"
        );
    }
    let inferred = &summary["inferred"];
    assert_eq!(inferred["slope_is_measured"], false, "{inferred}");
    let degrees = |field: &str| inferred[field].as_f64().expect("an angle");
    let sigma_deg = degrees("slope_sigma_deg");
    assert!(
        sigma_deg > 2.0 && (degrees("slope_deg") - 15.0).abs() < 3.0 * sigma_deg,
        "{inferred}"
    );
    assert!(states.iter().all(|state| state.sample == 0));
    assert!(worm.replay(&log).status.success());
}
