//! The Python package in `python/`: its messages have the layout of the Rust ones, and every field of them is read live.
//!
//! `WORMD_PYTHON` names an interpreter with iceoryx2 0.10.0 (default `python3`); without one the tests say so and pass.

use super::home::{Home, segments};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use worm_estimator::message::{
    Alarm, BlackBoxStatus, CommandRecord, Cycle, Estimate, FieldAccess, FieldKind, FieldValue, Inferred, Range,
    RecordingStatus, State, Timing, TripStatus,
};
use wormd::topics::{BlackBox, Controller, Estimator, Hub, Recorder, RoleLock, Trip, describe_topics};

const FOLDER: &str = env!("CARGO_MANIFEST_DIR");

/// The interpreter with the package, if it can run `probe`.
fn python(probe: &str) -> Option<Command> {
    let mut command = testkit::python::python(probe)?;
    command.current_dir(FOLDER).env("PYTHONPATH", "python/src");
    Some(command)
}

#[test]
fn the_committed_files_are_what_the_binary_says() {
    let header = Command::new(env!("CARGO_BIN_EXE_wormd"))
        .args(["topics", "--c-header"])
        .output()
        .expect("the binary runs");
    let committed = std::fs::read(format!("{FOLDER}/include/wormd.h")).expect("include/wormd.h");
    assert!(
        header.stdout == committed,
        "include/wormd.h is not what `wormd topics --c-header` says: run python/generate.py"
    );
    let Some(mut generate) = python("import json") else {
        return;
    };
    let output = generate
        .args(["python/generate.py", env!("CARGO_BIN_EXE_wormd"), "--check"])
        .output();
    let output = output.expect("python");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Two messages in which every field has a value of its own: in the first one everything is there and known, and in the second one
/// what may be missing is missing, and numbers are extreme or not known.
fn two_messages<T: FieldAccess>() -> [T; 2] {
    const CELLS: usize = 3;
    [false, true].map(|is_second| {
        let mut message = T::empty();
        for (place, field) in T::FIELDS.iter().enumerate() {
            let number = place as f64;
            let per_cell = [number + 0.25, if is_second { f64::NAN } else { 0.1 }, -1e-9 * number];
            let value = match field.kind {
                _ if field.is_optional && is_second => FieldValue::Missing,
                _ if field.name == "cell_count" => FieldValue::U32(CELLS as u32),
                FieldKind::Number if is_second && place % 3 == 0 => FieldValue::Number(f64::NAN),
                FieldKind::Number => FieldValue::Number(number / 3.0 - 5.0),
                FieldKind::PerCell => FieldValue::PerCell(&per_cell),
                FieldKind::U64 if is_second => FieldValue::U64(u64::MAX - place as u64),
                FieldKind::U64 => FieldValue::U64(1000 + place as u64),
                FieldKind::U32 => FieldValue::U32(place as u32 + u32::from(is_second)),
                FieldKind::I32 => FieldValue::I32(-(place as i32)),
                FieldKind::Code(codes) => {
                    let values = codes.values;
                    FieldValue::Code(values[(place + usize::from(is_second)) % values.len()].code)
                }
                FieldKind::Text if is_second => FieldValue::Text("ääääääääääääääää"),
                FieldKind::Text => FieldValue::Text("bên"),
            };
            assert!(message.set_field(place, value), "{} takes {value:?}", field.name);
        }
        message
    })
}

fn as_json<T: FieldAccess>(message: &T) -> Value {
    let mut text = Vec::new();
    message.write_json(&mut text).expect("every message can be written");
    serde_json::from_slice(&text).expect("JSON")
}

#[test]
fn every_field_of_every_topic_is_read_as_it_was_published() {
    let Some(mut script) = python("import iceoryx2") else {
        return;
    };
    let home = Home::new();
    let instance = home.instance("worm1");
    let config = home.root().join("worm.toml");
    let text = format!("[worm]\nname = \"worm1\"\n[topics]\nroot = {:?}\n", home.root());
    std::fs::write(&config, text).expect("a temporary file");
    let controller = RoleLock::<Controller>::take(&instance).expect("role");
    let estimator = RoleLock::<Estimator>::take(&instance).expect("role");
    let recorder = RoleLock::<Recorder>::take(&instance).expect("role");
    let trip = RoleLock::<Trip>::take(&instance).expect("role");
    let black_box = RoleLock::<BlackBox>::take(&instance).expect("role");
    let hub = Hub::open(&instance).expect("hub");
    let mut expected = Vec::new();
    let mut publish: Vec<Box<dyn Fn()>> = Vec::new();
    macro_rules! prepare {
        ($($message:ident of $role:ident),+) => {$(
            let publisher = hub.publisher::<$message>(&$role).expect("publisher");
            let pair = two_messages::<$message>();
            let topic = <$message as wormd::topics::Topic>::NAME;
            expected.extend(pair.iter().map(|message| json!({"topic": topic, "message": as_json(message)})));
            publish.push(Box::new(move || pair.iter().for_each(|it| publisher.publish(it).expect("publish"))));
        )+};
    }
    prepare! {
        State of controller, Timing of controller, Estimate of estimator, Cycle of estimator, Alarm of estimator,
        Range of estimator, CommandRecord of controller, RecordingStatus of recorder, TripStatus of trip,
        BlackBoxStatus of black_box, Inferred of estimator
    }
    assert_eq!(publish.len(), describe_topics().len(), "every topic is tried");

    let mut reader = script
        .arg("tests/topics/read_messages.py")
        .arg(&config)
        .stdout(Stdio::piped())
        .spawn()
        .expect("python");
    let mut lines = BufReader::new(reader.stdout.take().expect("a pipe")).lines();
    let mut line = || -> Value {
        let line = lines.next().expect("another line").expect("text");
        serde_json::from_str(&line).expect("JSON")
    };
    let layouts = line();
    for topic in describe_topics() {
        let (python, layout) = (&layouts[topic.name], &topic.layout);
        assert_eq!(python["type"], layout.type_name);
        assert_eq!(python["size"], layout.size, "{}", topic.name);
        let fields = layout.fields.iter();
        let fields: serde_json::Map<_, _> = fields
            .map(|field| (field.name.to_owned(), json!([field.offset, field.size])))
            .collect();
        assert_eq!(python["fields"], Value::Object(fields), "{}", topic.name);
    }
    assert_eq!(line(), "ready");
    for publish in &publish {
        publish();
    }
    for expected in expected {
        assert_eq!(line(), expected);
    }
    assert!(reader.wait().expect("python").success());
    drop((publish, hub));
    assert!(segments(&instance).is_empty(), "{:?}", segments(&instance));
}
