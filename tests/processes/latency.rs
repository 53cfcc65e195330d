//! The latency benchmark with real processes. What it measures depends on the machine; which figures it reports, and that they add up,
//! does not.

use crate::worm::{Worm, late_ticks};
use serde_json::Value;
use std::process::Output;

fn told(output: &Output) -> Value {
    let error = String::from_utf8_lossy(&output.stderr);
    serde_json::from_slice(&output.stdout).unwrap_or_else(|trouble| panic!("{trouble}: {error}"))
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

/// The percentiles of a duration, in order, with its count as what its histogram adds up to.
fn check_duration(outcome: &Value, name: &str) -> f64 {
    let duration = &outcome[name];
    let ladder = ["p50", "p90", "p99", "p99_9", "max"].map(|percentile| number(&duration[percentile]));
    assert!(
        ladder[0] >= 0.0 && ladder.is_sorted(),
        "{name}: percentiles do not fall: {ladder:?}"
    );
    let bars = duration["histogram"].as_array().expect("the whole histogram");
    let count: f64 = bars.iter().map(|bar| number(&bar[1])).sum();
    assert_eq!(count, number(&duration["count"]), "{name}");
    count
}

#[test]
fn a_run_tells_everything_and_adds_up() {
    let worm = Worm::on_a_steady_computer("lat");
    let page = tempfile::tempdir().expect("a temporary folder");
    let out = page.path().to_string_lossy().into_owned();
    let arguments = [
        "latency",
        "--json",
        "--duration",
        "3",
        "--rate",
        "500",
        "--load",
        "--out",
        &out,
    ];
    let output = worm.wormd(&arguments).output();
    let outcome = told(&output);
    assert!(output.status.success(), "{outcome}");

    assert_eq!(outcome["rate_hz"], 500.0);
    let (ticks, overruns) = (number(&outcome["ticks"]), number(&outcome["overruns"]));
    assert!(
        (1_300.0..1_700.0).contains(&(ticks + overruns)),
        "3 s at 500 Hz: {ticks} and {overruns}"
    );
    // A missed deadline counts with the lateness that it would have had.
    assert_eq!(check_duration(&outcome, "wake_us"), ticks + overruns);
    for name in [
        "bus_us",
        "compute_us",
        "publish_us",
        "own_work_us",
        "notify_us",
        "period_us",
        "execution_us",
    ] {
        assert_eq!(check_duration(&outcome, name), ticks, "{name} of every tick");
    }
    for name in ["floor_wake_us", "floor_notify_us", "delivery_us", "floor_delivery_us"] {
        assert!(check_duration(&outcome, name) > 1_000.0, "{name} beside it");
    }
    assert_eq!(check_duration(&outcome, "alarm_us"), 1.0, "one stall in three seconds");
    let alarm_us = number(&outcome["alarm_us"]["p50"]);
    assert!(
        alarm_us > 10_000.0,
        "a stall cannot be seen before the cam lags: {alarm_us} µs"
    );

    let worst = outcome["worst_ticks"].as_array().expect("the worst ticks");
    assert_eq!(worst.len(), 10);
    let late = worst.iter().filter(|tick| tick["late"] == true).count() as f64;
    let culprits = late_ticks(&outcome["culprits"]);
    assert!(
        culprits >= late && culprits <= overruns,
        "every late tick has a culprit: {outcome}"
    );
    assert!(
        outcome["scheduler"]
            .as_str()
            .is_some_and(|text| text.starts_with("SCHED_"))
    );
    assert!(outcome["memory_locked"].is_boolean() && outcome["warnings"].is_array());
    let trials = outcome["rate_trials"].as_array().expect("trials");
    let highest = trials
        .iter()
        .filter(|trial| trial["sustained"] == true)
        .map(|trial| number(&trial["rate_hz"]));
    assert_eq!(outcome["highest_rate_hz"].as_f64(), highest.reduce(f64::max));
    for file in ["latency.html", "latency.json"] {
        assert!(
            page.path().join(file).metadata().is_ok_and(|file| file.len() > 10_000),
            "{file}"
        );
    }
    assert_eq!(worm.stale_resources(), Vec::<String>::new());
}

#[test]
fn what_cannot_be_had_is_said_and_the_rest_is_measured() {
    let worm = Worm::on_a_steady_computer("lat2");
    let arguments = [
        "latency",
        "--json",
        "--duration",
        "1",
        "--no-rate-search",
        "--cpu",
        "1000",
    ];
    let output = worm.wormd(&arguments).output();
    let outcome = told(&output);
    assert!(output.status.success(), "{outcome}");
    let headline = outcome["headline"].as_str().unwrap_or_default();
    assert!(
        headline.starts_with("REFUSED BY THE SYSTEM") && headline.contains("CPU 1000"),
        "{headline}"
    );
    assert!(check_duration(&outcome, "wake_us") > 0.0);
    assert_eq!(outcome["alarm_us"], Value::Null, "no stall fits into a second");

    // A port that another controller has: the machine's own limit is still reported.
    let busy = Worm::on_a_steady_computer("lat3");
    let _devices = busy.virtual_worm(&[]);
    let _bus = busy.bus();
    let port = busy.port();
    let output = busy
        .wormd(&["latency", "--json", "--duration", "1", "--port", &port])
        .output();
    let outcome = told(&output);
    assert_eq!(output.status.code(), Some(2), "{outcome}");
    let headline = outcome["headline"].as_str().unwrap_or_default();
    assert!(
        headline.contains("NOT MEASURED") && headline.contains("already in use"),
        "{headline}"
    );
    assert_eq!((&outcome["wake_us"], &outcome["ticks"]), (&Value::Null, &0.into()));
    assert!(check_duration(&outcome, "floor_wake_us") > 300.0);

    let output = busy.wormd(&["latency", "--rate", "50000"]).output();
    assert_eq!(output.status.code(), Some(2));
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(
        error.contains("control.rate_hz = 50000") && error.contains("10 to 10000 Hz"),
        "{error}"
    );
}
