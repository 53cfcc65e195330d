//! Logs and their tables in the hands of the official Python packages.
//!
//! `WORMD_PYTHON` names an interpreter with mcap, mcap-protobuf-support, pyarrow and pandas (default `python3`); without one the tests
//! say so and pass.

use std::path::Path;
use std::process::Command;
use std::time::UNIX_EPOCH;
use worm_estimator::message::{
    Alarm, AlarmKind, Cycle, Estimate, Inferred, JsonMessage, Mode, Range, State, Timing, TripStatus,
};
use worm_log::{Origin, Writer};

/// Prints what the readers find, by topic: schema, and time and content of each message.
const READ_LOG: &str = r#"
import json, sys
from google.protobuf.json_format import MessageToDict
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
with open(sys.argv[1], "rb") as file:
    reader = make_reader(file, decoder_factories=[DecoderFactory()])
    topics = {}
    for channel in reader.get_summary().channels.values():
        schema = reader.get_summary().schemas[channel.schema_id]
        topics[channel.topic] = dict(encoding=channel.message_encoding, schema_encoding=schema.encoding,
            schema_name=schema.name, messages=[])
    for schema, channel, message, content in reader.iter_decoded_messages():
        content = MessageToDict(content, preserving_proto_field_name=True, always_print_fields_with_no_presence=True)
        topics[channel.topic]["messages"].append([message.log_time, content])
    attachments = {found.name: found.data.decode() for found in reader.iter_attachments()}
    metadata = {found.name: found.metadata for found in reader.iter_metadata()}
print(json.dumps(dict(topics=topics, attachments=attachments, metadata=metadata)))
"#;

/// Prints what pandas makes of a table: the types of its columns, and the rows.
const READ_TABLE: &str = r#"
import json, sys
import pandas, pyarrow.parquet
table = pyarrow.parquet.read_table(sys.argv[1])
frame = table.to_pandas()
columns = {name: str(of_type) for name, of_type in frame.dtypes.items()}
rows = [{key: None if pandas.isna(value) else float(value).hex() if isinstance(value, float) else str(value)
    for key, value in row.items()} for row in frame.to_dict("records")]
facts = {key.decode(): value.decode() for key, value in table.schema.metadata.items()}
print(json.dumps(dict(columns=columns, rows=rows, facts=facts)))
"#;

/// What the script prints about the file; nothing where the interpreter does not have the packages.
fn python(packages: &str, script: &str, file: &Path) -> Option<serde_json::Value> {
    let mut python = testkit::python::python(&format!("import {packages}"))?;
    let output = python.args(["-c", script]).arg(file).output();
    let output = output.expect("python");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(serde_json::from_slice(&output.stdout).expect("JSON"))
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

/// A log of these states and an alarm, for a worm of three cells.
fn write_log(path: &Path, states: &[State]) {
    let origin = Origin {
        worm: "snake".to_owned(),
        cells: 3,
        config: Some(CONFIG.to_owned()),
        begun: UNIX_EPOCH + std::time::Duration::from_secs(1_700_000_000),
        begun_ns: 83_726_154_119_000,
    };
    let file = std::fs::File::create(path).expect("can be made");
    let mut writer = Writer::new(file, path, &origin).expect("there is room");
    for state in states {
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
}

const CONFIG: &str = "[worm]\nname = \"snake\"\n";

#[test]
fn the_official_reader_yields_named_series() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("worm.mcap");
    let states = states();
    write_log(&path, &states);
    let Some(found) = python("mcap, mcap_protobuf", READ_LOG, &path) else {
        return;
    };
    for (topic, name) in [
        ("/state", State::TYPE_NAME),
        ("/timing", Timing::TYPE_NAME),
        ("/estimate", Estimate::TYPE_NAME),
        ("/cycle", Cycle::TYPE_NAME),
        ("/alarm", Alarm::TYPE_NAME),
        ("/range", Range::TYPE_NAME),
        ("/trip", TripStatus::TYPE_NAME),
        ("/inferred", Inferred::TYPE_NAME),
    ] {
        let channel = &found["topics"][topic];
        assert_eq!(
            (&channel["encoding"], &channel["schema_encoding"]),
            (&"protobuf".into(), &"protobuf".into())
        );
        assert_eq!(channel["schema_name"], name);
    }
    let messages = found["topics"]["/state"]["messages"].as_array().expect("a list");
    assert_eq!(messages.len(), states.len());
    for (state, message) in states.iter().zip(messages) {
        let (time, series) = (&message[0], &message[1]);
        assert_eq!(time.as_u64(), Some(state.time_ns));
        assert_eq!(series["phase"].as_f64(), Some(state.phase));
        assert_eq!(series["samples_missed"], u64::MAX.to_string());
        assert_eq!(series["mode"], "MODE_CRAWLING");
        assert_eq!(series["motor_current_a"], "NaN");
        assert!(series.get("fault_alarm").is_none(), "{series}");
        let positions_m = series["position_m"].as_array().expect("a list").iter();
        let positions_m: Vec<_> = positions_m.map(|x| x.as_f64().expect("a number")).collect();
        assert_eq!(positions_m, state.position_m[..3]);
    }
    let alarm = &found["topics"]["/alarm"]["messages"][0][1];
    assert_eq!(
        (&alarm["kind"], &alarm["cell"]),
        (&"ALARM_KIND_JAMMED_CELL".into(), &2.into())
    );
    assert_eq!(found["attachments"]["worm.toml"], CONFIG);
    assert_eq!(found["metadata"]["wormd"]["worm"], "snake");
}

#[cfg(feature = "tables")]
#[test]
fn pandas_reads_the_exported_tables() {
    let folder = tempfile::tempdir().expect("a folder");
    let (log, out) = (folder.path().join("worm.mcap"), folder.path().join("tables"));
    let states = states();
    write_log(&log, &states);
    let exported = Command::new(env!("CARGO_BIN_EXE_wormd"))
        .args([
            "export".as_ref(),
            log.as_os_str(),
            "--parquet".as_ref(),
            out.as_os_str(),
        ])
        .output()
        .expect("the binary runs");
    assert!(
        exported.status.success(),
        "{}",
        String::from_utf8_lossy(&exported.stderr)
    );
    let printed = String::from_utf8(exported.stdout).expect("text");
    assert!(printed.contains("state.parquet: 500 rows\n"), "{printed}");
    let Some(found) = python("pandas, pyarrow", READ_TABLE, &out.join("state.parquet")) else {
        return;
    };
    let of_type = |column: &str| found["columns"][column].as_str().unwrap_or_default().to_owned();
    assert_eq!(of_type("wall_time"), "datetime64[ns, UTC]");
    assert_eq!(
        (of_type("time_ns").as_str(), of_type("phase").as_str()),
        ("int64", "float64")
    );
    assert_eq!(found["facts"]["worm"], "snake");
    let rows = found["rows"].as_array().expect("rows");
    assert_eq!(rows.len(), states.len());
    let hex = |value: &serde_json::Value| value.as_str().map(str::to_owned);
    for (state, row) in states.iter().zip(rows) {
        assert_eq!(row["time_ns"], state.time_ns.to_string());
        let nanoseconds = 1_000_003 * state.sequence;
        let fraction = format!(
            "{:02}.{:09}",
            20 + nanoseconds / 1_000_000_000,
            nanoseconds % 1_000_000_000
        );
        let wall_time = row["wall_time"].as_str().expect("a time");
        let expected = format!("2023-11-14 22:13:{fraction}");
        assert!(
            wall_time.starts_with(expected.trim_end_matches('0').trim_end_matches('.')),
            "{wall_time}, {expected}"
        );
        assert_eq!(
            (row["mode"].as_str(), row["fault_alarm"].is_null()),
            (Some("crawling"), true)
        );
        assert!(row["motor_current_a"].is_null() && row["samples_missed"].is_null());
        // The same bits: Python writes a float in hexadecimal without rounding.
        assert_eq!(hex(&row["position_m_2"]), Some(as_hex(state.position_m[1])));
    }
}

/// A number as Python's `float.hex` writes it.
#[cfg(feature = "tables")]
fn as_hex(value: f64) -> String {
    let (sign, bits) = (if value.is_sign_negative() { "-" } else { "" }, value.to_bits());
    let (exponent, mantissa) = ((bits >> 52) & 0x7ff, bits & ((1 << 52) - 1));
    assert!(exponent > 0, "no subnormal number");
    format!("{sign}0x1.{mantissa:013x}p{:+}", exponent as i64 - 1023)
}
