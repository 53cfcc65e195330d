//! The contents of a log.

use super::text;
use std::fs;
use std::io::Cursor;
use testkit::log_sample::{ORIGIN_CONFIG, Sink, crawl, origin, write_log};
use worm_estimator::message::{Estimate, FieldAccess, Inferred, ProtobufMessage, State};
use worm_log::{Channel, Index, Note, Origin, Writer, messages, messages_from, scan};

#[test]
fn a_log_holds_what_was_written() {
    let crawl = crawl(5.0);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("worm.mcap");
    write_log(&path, &crawl);
    let log = messages(&path).expect("a log");
    assert_eq!(text(&log.states), text(&crawl.states));
    assert_eq!(text(&log.timings), text(&crawl.timings));
    assert_eq!(text(&log.estimates), text(&crawl.estimates));
    assert_eq!(text(&log.cycles), text(&crawl.cycles));
    assert_eq!(text(&log.alarms), text(&crawl.alarms));
    assert!(log.cycles.len() >= 2 && log.estimates.len() > 500);
    assert_eq!(log.config.as_deref(), Some(ORIGIN_CONFIG));
    assert_eq!(log.metadata["worm"], "tester");
    assert_eq!(log.metadata["begun_unix_ns"], "1500000000");
    assert_eq!(log.warnings, Vec::<String>::new());
}

#[test]
fn an_estimate_that_rests_on_nothing_takes_the_time_of_its_log() {
    let sink = Sink::default();
    let mut writer = Writer::new(sink.clone(), "x".as_ref(), &origin()).expect("memory takes all");
    let crawl = crawl(0.1);
    let nothing = Estimate {
        time_ns: 0,
        ..crawl.estimates[0]
    };
    writer.write(&nothing).expect("memory takes all");
    assert_eq!(writer.count(Channel::Estimate), 1);
    writer.finish().expect("memory takes all");
    let bytes = sink.bytes();
    let mut times = mcap::MessageStream::new(&bytes).expect("an MCAP file");
    let message = times.next().expect("one").expect("whole");
    assert_eq!(message.log_time, origin().begun_ns);
}

#[test]
fn a_log_without_an_index_is_smaller_and_says_as_much() {
    let crawl = crawl(1.0);
    let size = |index| {
        let sink = Sink::default();
        let mut writer = Writer::with_index(sink.clone(), "x".as_ref(), &origin(), index).expect("memory takes all");
        for state in &crawl.states {
            writer.write(state).expect("memory takes all");
        }
        writer.finish().expect("memory takes all");
        let bytes = sink.bytes();
        let summary = mcap::Summary::read(&bytes).expect("MCAP").expect("a summary");
        // Viewers take an index without messages for a log without messages, and then show nothing.
        assert_eq!(summary.chunk_indexes.is_empty(), index == Index::None);
        assert_eq!(summary.stats.expect("statistics").message_count, 1000);
        assert_eq!(mcap::MessageStream::new(&bytes).expect("MCAP").count(), 1000);
        bytes.len()
    };
    let (with, without) = (size(Index::Messages), size(Index::None));
    assert!(with - without >= 16 * 1000, "{with} and {without} bytes");
}

/// A log of one message that another program wrote.
fn foreign(topic: &str, type_name: &str, encoding: &str, message: impl AsRef<[u8]>) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let options = mcap::WriteOptions::new().compression(None);
    let mut writer = options.create(&mut bytes).expect("memory takes all");
    let schema = writer.add_schema(type_name, "jsonschema", b"{}").expect("a schema");
    let channel = writer
        .add_channel(schema, topic, encoding, &Default::default())
        .expect("a channel");
    let header = mcap::records::MessageHeader {
        channel_id: channel,
        sequence: 7,
        log_time: 1,
        publish_time: 1,
    };
    writer
        .write_to_known_channel(&header, message.as_ref())
        .expect("a message");
    writer.finish().expect("memory takes all");
    drop(writer);
    bytes.into_inner()
}

/// Bytes of the last field of a state, with its tag of two.
const PITCH_LEN: usize = 10;

#[test]
fn states_of_an_older_version_are_read_without_what_they_lack() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("worm.mcap");
    let state = crawl(0.1).states[0];
    let mut object: serde_json::Map<_, _> = serde_json::from_slice(&text(&[state])).expect("JSON");
    let mut read_as = |version: &str, lacking: &[&str]| {
        for member in lacking {
            object.remove(*member).expect("is new");
        }
        let older = serde_json::Value::from(object.clone()).to_string();
        fs::write(&path, foreign("/state", version, "json", &older)).expect("can be written");
        text(&messages(&path).expect("a log").states)
    };
    assert_eq!(read_as("wormd_state_v3", &["pitch_rad"]), text(&[state]));
    let new_in_v3 = ["hold_reason", "acknowledged_mask", "acknowledged_by", "emergency_stop"];
    assert_eq!(read_as("wormd_state_v2", &new_in_v3), text(&[state]));
    let expected = State {
        motor_time_s: f64::NAN,
        host_paused_ns: 0,
        ..state
    };
    assert_eq!(
        read_as("wormd_state_v1", &["motor_time_s", "host_paused_ns"]),
        text(&[expected])
    );
    // In Protocol Buffers what is left out would be a pitch of zero.
    let mut protobuf = Vec::new();
    state.write_protobuf(&mut protobuf);
    let without_pitch = &protobuf[..protobuf.len() - PITCH_LEN];
    fs::write(&path, foreign("/state", "wormd_state_v3", "protobuf", without_pitch)).expect("can be written");
    assert_eq!(text(&messages(&path).expect("a log").states), text(&[state]));
}

#[test]
fn what_an_older_version_did_not_infer_is_no_number() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("worm.mcap");
    // Zeros are left out in Protocol Buffers, as fields are that a version does not know.
    let mut protobuf = Vec::new();
    Inferred::empty().write_protobuf(&mut protobuf);
    for version in ["wormd_inferred_v1", "wormd_inferred_v2"] {
        fs::write(&path, foreign("/inferred", version, "protobuf", &protobuf)).expect("can be written");
        let inferred = messages(&path).expect("a log").inferred[0];
        let new = [
            inferred.slide_sigma_m,
            inferred.friction_loss_sigma,
            inferred.load_rise_sigma_n,
        ];
        assert!(
            new.iter()
                .chain(&[inferred.mark_off_m, inferred.mark_off_sigma_m])
                .all(|value| value.is_nan())
        );
        assert_eq!(
            (inferred.advance_m, inferred.contradicting_marks),
            (0.0, 0),
            "{version}"
        );
    }
}

#[test]
fn other_files_are_refused_with_what_to_do() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("worm.mcap");
    for (bytes, parts) in [
        (Vec::new(), &["cut off after 0 bytes"][..]),
        (b"time_s,x1_m\n0,0\n".to_vec(), &["is no MCAP file"]),
        (b"\x89MC".to_vec(), &["cut off after 3 bytes"]),
        (b"\x89MCAP0\r\n".to_vec(), &["channel /state: has no channel at all"]),
        (
            foreign("/tf", "tf", "cdr", "x"),
            &["channel /state: has no channel of a worm, only /tf"],
        ),
        (
            foreign("/state", "wormd_state_v4", "cdr", "x"),
            &[
                "channel /state: holds messages encoded as 'cdr', not as 'protobuf' or 'json'",
                "wormd record",
            ],
        ),
        (
            foreign("/state", "wormd_state_v2", "protobuf", ""),
            &["channel /state: holds 'wormd_state_v2', and this version of wormd reads 'wormd_state_v4'"],
        ),
        (
            foreign("/state", "wormd_state_v4", "protobuf", [0x90, 1, 2]),
            &["channel /state, message 1 of the file: cannot be read: position_m has 0 values for 2 cells"],
        ),
        (
            foreign("/state", "wormd_state_v9", "json", "{}"),
            &["channel /state: holds 'wormd_state_v9', and this version of wormd reads 'wormd_state_v4'"],
        ),
        (
            foreign("/state", "wormd_state_v3", "json", "{\"sequence\": -1}"),
            &[
                "channel /state, message 1 of the file: cannot be read: invalid value: integer `-1`",
                "line 1 column",
            ],
        ),
    ] {
        fs::write(&path, &bytes).expect("can be written");
        let error = messages(&path).expect_err(parts[0]).to_string();
        for part in parts {
            assert!(error.contains(part), "{part} is not in {error}");
        }
    }
    let error = messages(&folder.path().join("none.mcap")).expect_err("is not there");
    assert!(error.to_string().contains("check that the file is there"), "{error}");
}

#[test]
fn notes_are_repeated_among_the_warnings_and_stay_in_a_copy() {
    let folder = tempfile::tempdir().expect("a folder");
    let [path, copied] = ["worm.mcap", "copy.mcap"].map(|name| folder.path().join(name));
    let crawl = crawl(0.5);
    let file = fs::File::create(&path).expect("can be made");
    let mut writer = Writer::new(file, &path, &origin()).expect("there is room");
    let states = crawl.states.iter().enumerate();
    for (place, state) in states {
        // In the middle of a chunk, too.
        if place % 20 == 10 {
            let text = format!("note {}", place / 20);
            let values = [("place".to_owned(), place.to_string())].into();
            writer.write_note(&Note { text, values }).expect("there is room");
        }
        writer.write(state).expect("there is room");
    }
    writer.write_note(&Note::of("x".repeat(5000))).expect("there is room");
    writer.finish().expect("there is room");
    worm_log::export::copy(&path, &copied, false).expect("can be copied");
    for path in [&path, &copied] {
        let log = messages(path).expect("a log");
        assert_eq!(text(&log.states), text(&crawl.states));
        assert_eq!((log.warnings.len(), log.warnings[0].as_str()), (21, "note 0"));
        assert_eq!(log.warnings[20], "the log has 6 notes more");
        let contents = scan(path, |_, _| Ok(())).expect("a log");
        assert_eq!(contents.notes.len(), 26);
        assert_eq!(contents.notes[24].values["place"], "490");
        assert_eq!(contents.notes[25].text.len(), 5000);
    }
}

#[test]
fn what_was_found_out_later_of_a_worm_replaces_what_the_log_began_with() {
    let sink = Sink::default();
    let unknown = Origin {
        config: None,
        ..origin()
    };
    let mut writer = Writer::new(sink.clone(), "x".as_ref(), &unknown).expect("memory takes all");
    let known = Origin { cells: 5, ..origin() };
    writer.write_origin(&known).expect("memory takes all");
    writer.write(&crawl(0.1).states[0]).expect("memory takes all");
    writer.finish().expect("memory takes all");
    let log = messages_from(Cursor::new(sink.bytes()), "x".as_ref()).expect("a log");
    assert_eq!(log.config.as_deref(), Some(ORIGIN_CONFIG));
    assert_eq!((log.metadata["cells"].as_str(), log.states.len()), ("5", 1));
    assert_eq!(log.warnings, Vec::<String>::new());
}
