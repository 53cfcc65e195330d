//! `wormd foxglove` from outside: a real worm, and a client of the published protocol.
//!
//! `WORMD_PYTHON` names an interpreter with websockets and protobuf (default `python3`); without one the test of the stream says so and
//! passes.

#[path = "../processes/process.rs"]
#[allow(
    dead_code,
    reason = "the harness of another test binary, of which this one uses a part"
)]
mod process;
#[path = "../processes/worm.rs"]
#[allow(
    dead_code,
    reason = "the harness of another test binary, of which this one uses a part"
)]
mod worm;

use nix::sys::signal::Signal;
use serde_json::Value;
use std::collections::BTreeSet;
use std::io::{BufRead, BufReader};
use std::process::Stdio;
use std::time::{SystemTime, UNIX_EPOCH};
use testkit::python::python;
use worm::Worm;

const CLIENT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/foxglove/client.py");

#[test]
fn a_client_decodes_every_state_and_learns_that_the_worm_is_silent() {
    let Some(mut python) = python("import google.protobuf, websockets") else {
        return;
    };
    const STATES: usize = 500;
    let worm = Worm::on_a_steady_computer("foxglove");
    let mut stream = worm
        .wormd(&["foxglove", "--listen", "127.0.0.1:0"])
        .into_command()
        .stdout(Stdio::piped())
        .spawn()
        .expect("the binary starts");
    let mut line = String::new();
    let mut stdout = BufReader::new(stream.stdout.take().expect("is piped"));
    stdout.read_line(&mut line).expect("it says where it is");
    let address = line.split_whitespace().find(|word| word.starts_with("ws://"));
    let address = address.unwrap_or_else(|| panic!("{line:?}")).to_owned();
    let _virtual_worm = worm.virtual_worm(&[]);
    let controller = worm.wormd(&["control", "--port", &worm.port()]).start();
    let mut client = python
        .args([CLIENT, &address, &STATES.to_string()])
        .stdout(Stdio::piped())
        .spawn()
        .expect("python");
    let mut lines = BufReader::new(client.stdout.take().expect("is piped")).lines();
    let mut next = || -> Value {
        let line = lines
            .next()
            .expect("the client goes on")
            .expect("its output can be read");
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error}: {line}"))
    };

    let seen = next();
    assert!(
        seen["info"]["name"]
            .as_str()
            .is_some_and(|name| name.starts_with("wormd: foxglove-")),
        "{}",
        seen["info"]
    );
    assert_eq!(seen["info"]["capabilities"], serde_json::json!([]), "it only gives");
    let topics: BTreeSet<&str> = seen["topics"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(Value::as_str)
        .collect();
    let expected = [
        "/alarm",
        "/command",
        "/cycle",
        "/estimate",
        "/inferred",
        "/range",
        "/state",
        "/timing",
        "/trip",
    ];
    assert_eq!(topics, BTreeSet::from(expected));
    let states = seen["states"].as_array().expect("a list");
    assert_eq!(states.len(), STATES);
    let number = |state: &Value, field: &str| -> u64 {
        let text = state["content"][field]
            .as_str()
            .unwrap_or_else(|| panic!("{field} in {state}"));
        text.parse().expect("a number")
    };
    for pair in states.windows(2) {
        assert_eq!(
            number(&pair[1], "sequence"),
            number(&pair[0], "sequence") + 1,
            "none is left out"
        );
    }
    let now_ns = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .expect("the clock is set")
        .as_nanos();
    let log_time_ns = u128::from(states[STATES - 1]["log_time"].as_u64().expect("a time"));
    assert!(
        now_ns.abs_diff(log_time_ns) < 60_000_000_000,
        "wall-clock time: {log_time_ns} at {now_ns}"
    );
    assert_eq!(states[0]["content"]["cell_count"], 4);

    controller.signal(Signal::SIGSTOP);
    let status = next();
    assert!(
        status["message"]
            .as_str()
            .is_some_and(|text| text.contains("what is shown is old")),
        "{status}"
    );
    controller.signal(Signal::SIGCONT);
    assert!(client.wait().expect("the client ends").success());
    nix::sys::signal::kill(nix::unistd::Pid::from_raw(stream.id() as i32), Signal::SIGTERM).expect("it runs");
    assert!(stream.wait().expect("it ends").success());
}

#[test]
fn addresses_that_cannot_be_used_are_refused() {
    let worm = Worm::on_a_steady_computer("fg-refused");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a free port");
    let taken = taken.local_addr().expect("is bound").to_string();
    for (arguments, part) in [
        (["--listen", "0.0.0.0:0"], "knows no password"),
        (["--listen", &taken], "a free port"),
        (["--listen", "8765"], "invalid socket address"),
        (["--rate", "0"], "from 0.1 to 10000 Hz"),
        (["--topics", "states"], "no topic of this name"),
    ] {
        let output = worm.wormd(&[["foxglove"].as_slice(), &arguments].concat()).output();
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        assert!(message.contains(part), "{arguments:?}: {message}");
    }
}
