//! Logs in the hands of the official Python reader.
//!
//! `WORMD_PYTHON` names an interpreter with mcap (default `python3`); without one the test says so and passes.

use std::process::{Command, Stdio};
use std::time::UNIX_EPOCH;
use worm_estimator::message::{Alarm, AlarmKind, Cycle, Estimate, JsonMessage, Mode, Range, State, Timing};
use worm_log::{Origin, Writer};

/// Prints what the reader finds, by topic: schema, and time and content of each message.
const SCRIPT: &str = r#"
import json, sys
from mcap.reader import make_reader
with open(sys.argv[1], "rb") as file:
    reader = make_reader(file)
    topics = {}
    for channel in reader.get_summary().channels.values():
        schema = reader.get_summary().schemas[channel.schema_id]
        topics[channel.topic] = dict(encoding=channel.message_encoding, schema_encoding=schema.encoding,
            schema_name=schema.name, schema=json.loads(schema.data), messages=[])
    for schema, channel, message in reader.iter_messages():
        topics[channel.topic]["messages"].append([message.log_time, json.loads(message.data)])
    attachments = {found.name: found.data.decode() for found in reader.iter_attachments()}
    metadata = {found.name: found.metadata for found in reader.iter_metadata()}
print(json.dumps(dict(topics=topics, attachments=attachments, metadata=metadata)))
"#;

fn python() -> Option<Command> {
    let interpreter = std::env::var("WORMD_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let works = Command::new(&interpreter)
        .args(["-c", "import mcap"])
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success());
    if !works {
        println!("SKIPPED: {interpreter} cannot run `import mcap`; set WORMD_PYTHON to one that can");
        return None;
    }
    let mut command = Command::new(interpreter);
    command.args(["-c", SCRIPT]);
    Some(command)
}

fn states() -> Vec<State> {
    let state = |sequence: u64| State {
        sequence,
        time_ns: 83_726_154_119_000 + 1_000_003 * sequence,
        phase: sequence as f64 / 3.0,
        motor_current_a: f64::NAN,
        mode: Mode::Crawling.code(),
        position_m: std::array::from_fn(|cell| -0.04 * cell as f64 + 1e-7 * sequence as f64),
        samples_missed: u64::MAX,
        ..State::unknown(3)
    };
    (0..500).map(state).collect()
}

#[test]
fn the_official_reader_yields_named_series() {
    let Some(mut script) = python() else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("worm.mcap");
    let origin = Origin {
        worm: "snake".to_owned(),
        cells: 3,
        config: Some("[worm]\nname = \"snake\"\n".to_owned()),
        begun: UNIX_EPOCH,
        begun_ns: 1,
    };
    let file = std::fs::File::create(&path).expect("can be made");
    let mut writer = Writer::new(file, &path, &origin).expect("there is room");
    let states = states();
    for state in &states {
        writer.write(state).expect("there is room");
        if state.sequence % 100 == 0 {
            writer.flush().expect("there is room");
        }
    }
    let alarm = Alarm {
        time_ns: 83_726_154_119_007,
        kind: AlarmKind::JammedCell.code(),
        cell: 2,
        ..Alarm::NONE
    };
    writer.write(&alarm).expect("there is room");
    writer.finish().expect("there is room");

    let output = script.arg(&path).output().expect("python");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    for (topic, name, schema) in [
        ("/state", State::TYPE_NAME, State::schema()),
        ("/timing", Timing::TYPE_NAME, Timing::schema()),
        ("/estimate", Estimate::TYPE_NAME, Estimate::schema()),
        ("/cycle", Cycle::TYPE_NAME, Cycle::schema()),
        ("/alarm", Alarm::TYPE_NAME, Alarm::schema()),
        ("/range", Range::TYPE_NAME, Range::schema()),
    ] {
        let channel = &found["topics"][topic];
        assert_eq!(
            (&channel["encoding"], &channel["schema_encoding"]),
            (&"json".into(), &"jsonschema".into())
        );
        assert_eq!((&channel["schema_name"], &channel["schema"]), (&name.into(), &schema));
    }
    let messages = found["topics"]["/state"]["messages"].as_array().expect("a list");
    assert_eq!(messages.len(), states.len());
    for (state, message) in states.iter().zip(messages) {
        let (time, series) = (&message[0], &message[1]);
        assert_eq!(time.as_u64(), Some(state.time_ns));
        assert_eq!(series["phase"].as_f64(), Some(state.phase));
        assert_eq!(series["samples_missed"].as_u64(), Some(u64::MAX));
        assert_eq!(series["mode"], "crawling");
        assert!(series["motor_current_a"].is_null());
        let positions_m: Vec<_> = series["position_m"]
            .as_array()
            .into_iter()
            .flatten()
            .map(|x| x.as_f64())
            .collect();
        assert_eq!(
            positions_m,
            state.position_m[..3].iter().map(|&x| Some(x)).collect::<Vec<_>>()
        );
    }
    let alarm = &found["topics"]["/alarm"]["messages"][0][1];
    assert_eq!((&alarm["kind"], &alarm["cell"]), (&"jammed-cell".into(), &2.into()));
    assert_eq!(found["attachments"]["worm.toml"], origin.config.expect("was given"));
    assert_eq!(found["metadata"]["wormd"]["worm"], "snake");
}
