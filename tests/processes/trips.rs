//! A trip as a process: it makes the worm crawl out and home, is one at a time, and leaves a worm that holds when it is killed.

use super::PATIENCE;
use super::process::wait_for;
use super::worm::Worm;
use std::time::Duration;
use worm_estimator::message::{CommandKind, CommandOutcome, Mode};

/// As long as two gait cycles, out and home on a busy computer.
const TRIP: Duration = Duration::from_secs(90);
const ROUTE: &str = "length_m,slope_deg,cycle_s\n0.012,0,\n0.012,0,2\n";

fn is_in(worm: &Worm, mode: Mode) -> bool {
    worm.state().is_some_and(|state| state.mode == mode.code())
}

fn stands(worm: &Worm) -> serde_json::Value {
    let output = worm.wormd(&["trip", "status", "--json"]).output();
    serde_json::from_slice(&output.stdout).unwrap_or_default()
}

#[test]
fn out_and_home_one_at_a_time_and_whoever_holds_it_makes_it_wait() {
    let worm = Worm::on_a_steady_computer("trip");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("route.csv");
    std::fs::write(&file, ROUTE).expect("it can be written");
    let file = file.to_string_lossy().into_owned();
    let alone = worm.wormd(&["trip", &file]).output();
    assert_eq!(alone.status.code(), Some(2), "there is no worm");
    let up = worm.wormd(&["up", "--plain"]).start_without_reader();
    wait_for("a worm that crawls", PATIENCE, || is_in(&worm, Mode::Crawling));

    let trip = worm.wormd(&["trip", &file, "--link-loss", "continue"]).start_silent();
    wait_for("an outbound trip", PATIENCE, || stands(&worm)["phase"] == "outbound");
    let second = worm.wormd(&["trip", &file]).output();
    let error = String::from_utf8_lossy(&second.stderr);
    assert_eq!(second.status.code(), Some(2), "{error}");
    assert!(error.contains("already has a trip"), "{error}");

    assert_eq!(worm.order(CommandKind::Hold), CommandOutcome::Accepted);
    wait_for("a trip that waits", PATIENCE, || stands(&worm)["phase"] == "holding");
    let held = stands(&worm);
    assert_eq!(
        (&held["reason"], &held["needs_operator"]),
        (&"hold-commanded".into(), &1.into())
    );
    assert!(is_in(&worm, Mode::Holding));
    assert!(worm.wormd(&["trip", "resume"]).output().status.success());
    wait_for("the way home", TRIP, || stands(&worm)["phase"] == "returning");
    assert_eq!(trip.ends_within(TRIP).code(), Some(0));
    wait_for("a worm that holds", PATIENCE, || is_in(&worm, Mode::Holding));

    // A trip that is killed.
    let mut trip = worm.wormd(&["trip", &file]).start_silent();
    wait_for("a worm that crawls", PATIENCE, || is_in(&worm, Mode::Crawling));
    trip.kill();
    wait_for("a worm that holds", Duration::from_secs(3), || {
        is_in(&worm, Mode::Holding)
    });
    std::thread::sleep(Duration::from_secs(2));
    assert!(is_in(&worm, Mode::Holding), "nothing makes it crawl again");
    drop(up);
}

#[test]
fn a_leg_that_cannot_be_crawled_is_refused_by_its_number() {
    let worm = Worm::on_a_steady_computer("steep");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("route.csv");
    std::fs::write(&file, "length_m,slope_deg\n1,0\n1,65\n").expect("it can be written");
    let output = worm.wormd(&["trip", &file.to_string_lossy()]).output();
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{error}");
    assert!(error.contains("leg 2 (65°) cannot be crawled"), "{error}");
}

#[test]
fn a_worm_that_nobody_sees_goes_out_and_home_by_its_motors_current() {
    let worm = Worm::on_a_steady_computer("blind-trip");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("route.csv");
    std::fs::write(&file, "length_m,slope_deg,cycle_s\n0.02,0,1.5\n").expect("it can be written");
    let file = file.to_string_lossy().into_owned();
    let config = worm.config("[tracker]\npresent = false\n");
    let up = worm
        .wormd(&["up", "--plain", "--config", &config])
        .start_without_reader();
    wait_for("a worm that crawls", PATIENCE, || is_in(&worm, Mode::Crawling));
    let trip = ["trip", &file, "--config", &config, "--link-loss", "continue", "--json"];
    let output = worm.wormd(&trip).output();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    let end: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one object");
    assert_eq!((&end["phase"], &end["reason"]), (&"done".into(), &"home".into()));
    let at = |name: &str| end[name].as_f64().expect("a number");
    // Some percent of the way out and home, and what a gait cycle begun at rest is off by.
    let (place_m, sigma_m) = (at("position_m"), at("position_sigma_m"));
    assert!(place_m.abs() < 0.007 && (0.001..0.01).contains(&sigma_m), "{end}");
    assert!(at("cycles") >= 5.0, "{end}");
    wait_for("a worm that holds", PATIENCE, || is_in(&worm, Mode::Holding));
    drop(up);
}
