//! `wormd calibrate` on a running worm whose gears are not as configured.

use super::PATIENCE;
use super::process::wait_for;
use super::worm::Worm;
use nix::sys::signal::Signal;
use worm_estimator::config::{CalibrationMode, Config};
use worm_estimator::message::Mode;

/// A lifted worm: its tips hold nothing. The gears have a third more dry friction than `[self_sensing]` says, and a third less that grows
/// with speed.
const LIFTED: &str = "# mine\n[gait]\ncycle_s = 1.25\n[virtual_worm]\nmax_deformation_m = 0.00001\n\
                      inner_friction_n_m = 0.0125\ninner_viscous_n_m_s_per_rad = 0.0042\n";
const DRY_N_M: f64 = 0.0125;
const VISCOUS_N_M_S_PER_RAD: f64 = 0.0042;

#[test]
fn a_lifted_worm_gives_the_friction_of_its_gears_into_a_configuration_and_holds() {
    let worm = Worm::on_a_steady_computer("calibrate");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("calibrated.toml");
    let out = path.to_string_lossy().into_owned();
    let config = worm.config(LIFTED);
    let calibrate = ["calibrate", "--lifted", "--json", "--config", &config, "--out", &out];
    let alone = worm.wormd(&calibrate).output();
    assert_eq!(alone.status.code(), Some(2), "there is no worm yet");
    let error = String::from_utf8_lossy(&alone.stderr);
    assert!(error.contains("is running: start it with"), "{error}");
    assert!(!path.exists());

    let up = worm.wormd(&["up", "--config", &config]).start_silent();
    wait_for("a worm that crawls", PATIENCE, || {
        worm.state().is_some_and(|state| state.mode == Mode::Crawling.code())
    });
    let output = worm.wormd(&calibrate).output();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    for (key, truth) in [
        ("dry_friction_n_m", DRY_N_M),
        ("viscous_friction_n_m_s_per_rad", VISCOUS_N_M_S_PER_RAD),
    ] {
        let number = |what: &str| found[key][what].as_f64().expect("a number");
        let off = (number("value") - truth) / number("sigma");
        assert!(off.abs() < 3.0 && number("sigma") < 0.06 * truth, "{key}: {found}");
        assert!(number("sigmas_off").abs() > 5.0, "{key} is not as configured: {found}");
    }
    assert_eq!(found["turns"].as_array().map(Vec::len), Some(6), "{found}");
    let state = worm.state().expect("it runs");
    assert_eq!(state.mode, Mode::Holding.code());

    let text = std::fs::read_to_string(&path).expect("a configuration");
    assert!(text.starts_with("# mine\n[gait]\ncycle_s = 1.25\n"), "{text}");
    let written = Config::load(&path).expect("it can be used");
    let known = &written.self_sensing;
    assert!((known.dry_friction_n_m - DRY_N_M).abs() < 1e-3, "{text}");
    let calibrated = known.calibrated.as_ref().expect("says when");
    assert_eq!(calibrated.mode, CalibrationMode::Lifted);
    assert_eq!(calibrated.misfit(&written, calibrated.temperature_c + 10.0), None);
    assert!(calibrated.misfit(&written, calibrated.temperature_c - 20.0).is_some());

    // Somebody who interrupts it finds a worm that holds, and no file.
    std::fs::remove_file(&path).expect("it is there");
    let interrupted = worm.wormd(&calibrate).start_silent();
    wait_for("the first turn", PATIENCE, || {
        worm.state().is_some_and(|state| state.mode == Mode::Crawling.code())
    });
    interrupted.signal(Signal::SIGINT);
    assert_eq!(interrupted.ends_within(PATIENCE).code(), Some(1));
    wait_for("a worm that holds", PATIENCE, || {
        worm.state().is_some_and(|state| state.mode == Mode::Holding.code())
    });
    assert!(!path.exists());
    up.signal(Signal::SIGINT);
    up.ends_within(PATIENCE);
}

#[test]
fn a_worm_in_its_canal_is_not_calibrated_as_a_lifted_one() {
    let worm = Worm::on_a_steady_computer("not-lifted");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("calibrated.toml");
    let out = path.to_string_lossy().into_owned();
    let config = worm.config("[gait]\ncycle_s = 1.25\n[canal]\nslope_deg = 15\n");
    let up = worm.wormd(&["up", "--config", &config]).start_silent();
    wait_for("a worm that crawls", PATIENCE, || {
        worm.state().is_some_and(|state| state.mode == Mode::Crawling.code())
    });
    let calibrate = ["calibrate", "--lifted", "--config", &config, "--out", &out];
    let output = worm.wormd(&calibrate).output();
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{error}");
    for part in [
        "is not lifted: the torque rises by",
        "in the step of each cell",
        "give --level",
        "nothing was written",
    ] {
        assert!(error.contains(part), "{error}");
    }
    assert!(!path.exists());
    let state = worm.state().expect("it runs");
    assert_eq!(state.mode, Mode::Holding.code());
    up.signal(Signal::SIGINT);
    up.ends_within(PATIENCE);
}
