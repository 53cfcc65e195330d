//! `examples/read_state.py` against a running publisher.
//!
//! `WORMD_PYTHON` names an interpreter with iceoryx2 0.10.0 (default `python3`); without one the tests say so and pass.

use super::home::{Home, segments};
use std::mem::{offset_of, size_of_val};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use worm_estimator::message::State;
use wormd::topics::{Controller, Hub, RoleLock};

const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/read_state.py");

/// The interpreter, if it can run `probe`.
fn python(probe: &str) -> Option<Command> {
    let interpreter = std::env::var("WORMD_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let works = Command::new(&interpreter)
        .args(["-c", probe])
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success());
    if !works {
        println!("SKIPPED: {interpreter} cannot run `{probe}`; set WORMD_PYTHON to one that can");
        return None;
    }
    let mut command = Command::new(interpreter);
    command.arg(SCRIPT);
    Some(command)
}

#[test]
fn the_python_structure_has_the_layout_of_the_rust_one() {
    let Some(mut script) = python("import ctypes") else {
        return;
    };
    let output = script.arg("--layout").output().expect("python");
    let python: serde_json::Map<_, _> = serde_json::from_slice(&output.stdout).expect("JSON");
    let state = State::unknown(4);
    let mut bytes = 0;
    macro_rules! compare {
        ($($field:ident)+) => {$(
            let here = serde_json::json!([offset_of!(State, $field), size_of_val(&state.$field)]);
            assert_eq!(python.get(stringify!($field)), Some(&here), stringify!($field));
            bytes += size_of_val(&state.$field);
        )+};
    }
    compare! {
        sequence time_ns phase motor_angle_rad motor_velocity_rad_s goal_velocity_rad_s motor_current_a motor_duty
        bus_voltage_v motor_temperature_c motor_time_s sample_time_s position_m sample samples_missed link_failures host_paused_ns
        cell_count valid_mask sample_is_new motor_is_new mode fault fault_alarm hardware_error hold_reason
        acknowledged_mask acknowledged_by emergency_stop
    }
    assert_eq!(
        bytes,
        size_of::<State>(),
        "every field is compared, and there is no padding"
    );
    let python_bytes: u64 = python.values().filter_map(|field| field[1].as_u64()).sum();
    assert_eq!(python_bytes, bytes as u64);
}

#[test]
fn a_python_process_reads_every_state() {
    let Some(mut script) = python("import iceoryx2") else {
        return;
    };
    let home = Home::new();
    let instance = home.instance("worm1");
    let controller = RoleLock::<Controller>::take(&instance).expect("role");
    let hub = Hub::open(&instance).expect("hub");
    let publisher = hub.publisher::<State>(&controller).expect("publisher");
    let notifier = hub.notifier::<State>(&controller).expect("notifier");
    let mut reader = script
        .args(["--worm", "worm1", "--count", "50", "--root"])
        .arg(home.root())
        .stdout(Stdio::piped())
        .spawn()
        .expect("python");
    let mut state = State::unknown(3);
    state.position_m[..3].copy_from_slice(&[0.001, 0.002, 0.003]);
    let begun = Instant::now();
    while reader.try_wait().expect("python").is_none() {
        assert!(begun.elapsed() < Duration::from_secs(20), "it does not end");
        state.sequence += 1;
        state.phase = 0.5 * state.sequence as f64;
        publisher.publish(&state).expect("publish");
        notifier.notify().expect("notify");
        std::thread::sleep(Duration::from_millis(1));
    }
    let output = reader.wait_with_output().expect("python");
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).expect("text");
    let states: Vec<serde_json::Value> = text
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    assert_eq!(states.len(), 50);
    let first = states[0]["sequence"].as_u64().expect("a number");
    for (sequence, state) in (first..).zip(&states) {
        assert_eq!(state["sequence"].as_u64(), Some(sequence), "none is lost");
        assert_eq!(state["phase"].as_f64(), Some(0.5 * sequence as f64));
        assert_eq!(state["positions_mm"], serde_json::json!([1.0, 2.0, 3.0]));
    }
    drop((publisher, notifier, hub));
    assert!(segments(&instance).is_empty(), "{:?}", segments(&instance));
}
