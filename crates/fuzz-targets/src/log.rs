//! Logs of the topics, and the messages in them.

use crate::{MAX_WARNINGS_LEN, readable, recording};
use std::io::Cursor;
use std::path::Path;
use worm_analysis::recording::{OpenOptions, Wanted, mcap, read_from};
use worm_estimator::config::Config;
use worm_estimator::message::{
    Alarm, CommandRecord, Cycle, Estimate, Inferred, JsonMessage, ProtobufMessage, Range, RecordingStatus, State,
    Timing, TripStatus,
};
use worm_log::{Log, compare, messages_from, outline, replay};

/// A log: as its messages, as a recording, and through the estimator.
pub(crate) fn mcap_log(data: &[u8]) {
    let path = Path::new("worm.mcap");
    match messages_from(Cursor::new(data), path) {
        Ok(log) => check(&log),
        Err(error) => drop(readable(error)),
    }
    if let Ok(held) = outline(&mut Cursor::new(data)) {
        assert!(held.metadata.len() <= data.len(), "a record takes room");
    }
    match mcap::read_from(Cursor::new(data), path) {
        Ok(read) => assert!(read.time_s.iter().all(|time_s| time_s.is_finite()), "a time"),
        Err(error) => drop(readable(error)),
    }
    let window_s = Wanted::USUAL_WINDOW_S;
    for wanted in [
        Wanted::Positions,
        Wanted::PositionsOrMotor { window_s },
        Wanted::Motor { window_s: 0.0 },
    ] {
        let options = OpenOptions {
            wanted,
            ..OpenOptions::default()
        };
        match read_from(
            Cursor::new(data),
            data.len() as u64,
            path,
            &options,
            &mut |_fraction| {},
        ) {
            Ok(opened) => recording::check(&opened),
            Err(error) => drop(readable(error)),
        }
    }
}

/// Messages as JSON, one a line, and the log that they make.
pub(crate) fn log_messages(data: &[u8]) {
    let mut log = Log::default();
    for line in data.split(|&byte| byte == b'\n') {
        log.states.extend(read::<State>(line));
        log.estimates.extend(read::<Estimate>(line));
        log.cycles.extend(read::<Cycle>(line));
        log.alarms.extend(read::<Alarm>(line));
        log.ranges.extend(read::<Range>(line));
        log.commands.extend(read::<CommandRecord>(line));
        log.trips.extend(read::<TripStatus>(line));
        log.inferred.extend(read::<Inferred>(line));
        read::<Timing>(line);
    }
    check(&log);
}

/// One message in Protocol Buffers, of the type that the first byte names.
pub(crate) fn protobuf_message(data: &[u8]) {
    let Some((of_type, bytes)) = data.split_first() else {
        return;
    };
    match of_type {
        0 => read_bytes::<State>(bytes),
        1 => read_bytes::<Timing>(bytes),
        2 => read_bytes::<Estimate>(bytes),
        3 => read_bytes::<Cycle>(bytes),
        4 => read_bytes::<Alarm>(bytes),
        5 => read_bytes::<CommandRecord>(bytes),
        6 => read_bytes::<TripStatus>(bytes),
        7 => read_bytes::<Inferred>(bytes),
        _ => read_bytes::<RecordingStatus>(bytes),
    }
}

/// Reads a message, if it is one; then it is the same when it was written and read again.
fn read_bytes<T: ProtobufMessage>(bytes: &[u8]) {
    let message = match T::read_protobuf(bytes) {
        Ok(message) => message,
        Err(error) => return drop(readable(error)),
    };
    let mut once = Vec::new();
    message.write_protobuf(&mut once);
    let again = T::read_protobuf(&once).expect("what was written can be read");
    for (place, field) in T::FIELDS.iter().enumerate() {
        // As text, for `NaN` is not equal to itself.
        let text = |message: &T| format!("{:?}", message.field(place));
        assert_eq!(text(&message), text(&again), "{}", field.name);
    }
    // Whatever came in Protocol Buffers has a form in JSON.
    written(&message);
}

/// Reads a message, if it is one; then it is written and read to the same text again.
fn read<T: JsonMessage>(text: &[u8]) -> Option<T> {
    let message = T::read_json(text).ok()?;
    let once = written(&message);
    let again = T::read_json(&once).expect("what was written can be read");
    assert_eq!(once, written(&again), "read and written again");
    Some(message)
}

fn written<T: JsonMessage>(message: &T) -> Vec<u8> {
    let mut text = Vec::new();
    message.write_json(&mut text).expect("every message can be written");
    text
}

fn check(log: &Log) {
    let warnings: usize = log.warnings.iter().map(String::len).sum();
    assert!(warnings <= MAX_WARNINGS_LEN, "{warnings} bytes of warnings");
    for state in log.states.iter().take(8) {
        assert_eq!(
            written(state),
            written(&read::<State>(&written(state)).expect("a state"))
        );
    }
    let config = match log.config() {
        Ok(config) => config,
        Err(error) => {
            readable(error);
            Config::default()
        }
    };
    let replayed = replay(log, &config).expect("a checked configuration has an estimator");
    assert!(
        replayed.estimates.len() <= log.states.len(),
        "an estimate for a state at most"
    );
    let comparison = compare(log, &replayed);
    assert!(
        comparison.estimates_identical <= comparison.estimates_compared,
        "{comparison:?}"
    );
    serde_json::to_string(&comparison).expect("a comparison is written as JSON");
}
