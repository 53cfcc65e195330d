//! Logs in other forms.

use super::text;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use testkit::log_sample::{ORIGIN_CONFIG, Telemetry, crawl, write_log};
#[cfg(feature = "tables")]
use worm_estimator::message::{
    Alarm, AlarmKind, Command, CommandKind, CommandOutcome, CommandRecord, Estimate, Mode, Reply, ShortText, State,
};
use worm_log::export::copy;
use worm_log::{Logged, messages, replay};

/// A log as versions before Protocol Buffers wrote it: JSON in lz4 chunks.
fn write_json_log(path: &Path, telemetry: &Telemetry) {
    fn all<T: Logged>(mcap: &mut mcap::Writer<fs::File>, messages: &[T]) {
        let schema = mcap.add_schema(T::TYPE_NAME, "jsonschema", T::schema().to_string().as_bytes());
        let channel = mcap.add_channel(schema.expect("a schema"), &T::CHANNEL.topic(), "json", &BTreeMap::new());
        let channel_id = channel.expect("a channel");
        for (sequence, message) in (0..).zip(messages) {
            let mut text = Vec::new();
            message.write_json(&mut text).expect("can be written");
            let header = mcap::records::MessageHeader {
                channel_id,
                sequence,
                log_time: message.made_ns(),
                publish_time: message.made_ns(),
            };
            mcap.write_to_known_channel(&header, &text).expect("there is room");
        }
    }
    let file = fs::File::create(path).expect("can be made");
    let options = mcap::WriteOptions::new().compression(Some(mcap::Compression::Lz4));
    let mut mcap = options.create(file).expect("there is room");
    let metadata = [
        ("worm", "older"),
        ("begun_unix_ns", "1700000000000000000"),
        ("begun_monotonic_ns", "5"),
    ];
    let metadata = metadata.map(|(key, value)| (key.to_owned(), value.to_owned()));
    let record = mcap::records::Metadata {
        name: "wormd".to_owned(),
        metadata: metadata.into(),
    };
    mcap.write_metadata(&record).expect("there is room");
    all(&mut mcap, &telemetry.states);
    all(&mut mcap, &telemetry.estimates);
    all(&mut mcap, &telemetry.cycles);
    mcap.finish().expect("there is room");
}

#[test]
fn an_older_log_replays_as_it_is_and_as_a_copy() {
    let folder = tempfile::tempdir().expect("a folder");
    let (old, new) = (folder.path().join("old.mcap"), folder.path().join("new.mcap"));
    let telemetry = crawl(5.0);
    write_json_log(&old, &telemetry);
    let (count, warnings) = copy(&old, &new, false).expect("a whole log");
    let expected = telemetry.states.len() + telemetry.estimates.len() + telemetry.cycles.len();
    assert_eq!((count, warnings), (expected as u64, Vec::new()));
    let size = |path: &Path| fs::metadata(path).expect("is there").len();
    assert!(size(&new) < size(&old), "{} of {} bytes", size(&new), size(&old));
    for path in [&old, &new] {
        let log = messages(path).expect("a log");
        assert_eq!(log.metadata["worm"], "older");
        assert_eq!(text(&log.states), text(&telemetry.states));
        assert_eq!(text(&log.estimates), text(&telemetry.estimates));
        let replayed = replay(&log, &telemetry.config).expect("a valid configuration");
        let comparison = worm_log::compare(&log, &replayed);
        assert!(comparison.is_identical() && comparison.complete, "{comparison:?}");
        assert!(comparison.estimates_compared > 500 && comparison.cycles_compared >= 2);
    }
}

#[test]
fn a_copy_of_a_log_that_was_cut_off_is_complete() {
    let folder = tempfile::tempdir().expect("a folder");
    let (cut, whole) = (folder.path().join("cut.mcap"), folder.path().join("whole.mcap"));
    write_log(&cut, &crawl(2.0));
    let length = fs::metadata(&cut).expect("is there").len();
    let file = fs::File::options().write(true).open(&cut).expect("is there");
    file.set_len(length / 2).expect("can be cut");
    let (count, warnings) = copy(&cut, &whole, false).expect("a log");
    assert!(count > 500, "{count} messages");
    assert!(warnings[0].starts_with("cut off after"), "{warnings:?}");
    let log = messages(&whole).expect("a log");
    assert_eq!((log.warnings.len(), log.config.as_deref()), (0, Some(ORIGIN_CONFIG)));
    assert_eq!(text(&log.states), text(&messages(&cut).expect("a log").states));
    let bytes = fs::read(&whole).expect("is there");
    let summary = mcap::Summary::read(&bytes).expect("MCAP").expect("an index");
    assert_eq!(summary.stats.expect("statistics").message_count, count);

    let error = copy(&cut, &whole, false).expect_err("is there already").to_string();
    assert!(error.contains("exists already") && error.contains("--force"), "{error}");
    copy(&cut, &whole, true).expect("it may be overwritten");
    let nowhere = folder.path().join("none").join("x.mcap");
    let error = copy(&cut, &nowhere, false)
        .expect_err("there is no such folder")
        .to_string();
    assert!(error.contains("x.mcap: cannot be written: No such file"), "{error}");
    fs::write(&cut, "time_s,x1_m\n").expect("can be written");
    copy(&cut, &folder.path().join("y.mcap"), false).expect_err("is no log");
    let left: Vec<_> = fs::read_dir(folder.path()).expect("a folder").flatten().collect();
    assert_eq!(left.len(), 2, "nothing unfinished is left: {left:?}");
}

/// A crawl of four cells in which some things are not known.
#[cfg(feature = "tables")]
fn with_gaps() -> Telemetry {
    let mut telemetry = crawl(1.0);
    let state = &mut telemetry.states[7];
    (state.position_m[1], state.motor_current_a) = (f64::NAN, f64::INFINITY);
    (state.fault_alarm, state.emergency_stop) = (AlarmKind::JammedCell.code(), 0);
    state.hold_reason = 77;
    state.samples_missed = u64::MAX;
    telemetry.states[8].phase = -0.0;
    telemetry.alarms = vec![Alarm {
        time_ns: 1_000_000_000,
        kind: AlarmKind::JammedCell.code(),
        cell: 2,
        ..Alarm::NONE
    }];
    telemetry.timings.clear();
    let crawl = Command {
        cycles_per_s: -0.5,
        sender: ShortText::new("änn"),
        ..Command::new(CommandKind::Crawl)
    };
    let reply = Reply {
        sequence: 7,
        verdict: CommandOutcome::AlarmStands.code(),
        mode: Mode::Armed.code(),
        fault: 0,
        alarm_mask: 1 << AlarmKind::JammedCell.code(),
    };
    telemetry.commands = vec![CommandRecord::new(3, (1_000_000_001, 2.5), true, &crawl, &reply)];
    telemetry
}

#[cfg(feature = "tables")]
mod tables {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;
    use worm_log::Channel;
    use worm_log::export::{TableFormat, tables};

    #[test]
    fn a_parquet_file_holds_a_topic_to_the_last_bit() {
        let folder = tempfile::tempdir().expect("a folder");
        let (log, out) = (folder.path().join("worm.mcap"), folder.path().join("deep/tables"));
        let telemetry = with_gaps();
        write_log(&log, &telemetry);
        let (written, warnings) = tables(&log, &out, TableFormat::Parquet, Channel::ALL, false).expect("a log");
        let names: Vec<_> = written.iter().filter_map(|table| table.file.file_name()).collect();
        assert_eq!(
            names,
            ["state.parquet", "estimate.parquet", "alarm.parquet", "command.parquet"],
            "no empty ones"
        );
        assert_eq!((written[0].rows, warnings), (1000, Vec::new()));
        let file = fs::File::open(&written[3].file).expect("is there");
        let mut rows = SerializedFileReader::new(file).expect("Parquet").into_iter();
        let row: BTreeMap<String, Field> = rows
            .next()
            .expect("a row")
            .expect("readable")
            .into_columns()
            .into_iter()
            .collect();
        assert_eq!(row["sender"], Field::Str("änn".to_owned()));

        let file = fs::File::open(&written[0].file).expect("is there");
        let reader = SerializedFileReader::new(file).expect("Parquet");
        let facts = reader.metadata().file_metadata().key_value_metadata().expect("facts");
        let fact = |key: &str| {
            facts
                .iter()
                .find(|fact| fact.key == key)
                .and_then(|fact| fact.value.clone())
        };
        assert_eq!(fact("worm.toml").as_deref(), Some(ORIGIN_CONFIG));
        assert!(fact("schema").is_some_and(|schema| schema.contains("Gait cycles done")));
        let rows = reader.get_row_iter(None).expect("rows").map(|row| row.expect("a row"));
        let rows: Vec<BTreeMap<String, Field>> = rows.map(|row| row.into_columns().into_iter().collect()).collect();
        assert_eq!(rows.len(), 1000);
        for (state, row) in telemetry.states.iter().zip(&rows) {
            // Begun at 0.9 s of the monotonic clock, which was 1.5 s after 1970.
            let (Field::TimestampMicros(_) | Field::Long(_)) = row["wall_time"] else {
                panic!("{:?}", row["wall_time"]);
            };
            assert_eq!(row["time_ns"], Field::Long(state.time_ns as i64));
            let number = |name: &str, value: f64| match &row[name] {
                Field::Double(read) => assert_eq!(read.to_bits(), value.to_bits(), "{name}"),
                Field::Null => assert!(value.is_nan(), "{name}"),
                other => panic!("{name}: {other:?}"),
            };
            number("phase", state.phase);
            number("motor_current_a", state.motor_current_a);
            for cell in 0..4 {
                number(&format!("position_m_{}", cell + 1), state.position_m[cell]);
            }
            assert!(!row.contains_key("position_m_5"));
        }
        let text = |text: &str| Field::Str(text.to_owned());
        assert_eq!(rows[7]["fault_alarm"], text("jammed-cell"));
        assert_eq!(
            (&rows[7]["hold_reason"], &rows[6]["hold_reason"]),
            (&text("77"), &text("none"))
        );
        assert_eq!(
            (&rows[7]["emergency_stop"], &rows[6]["emergency_stop"]),
            (&Field::Long(0), &Field::Null)
        );
        assert_eq!(
            (&rows[7]["samples_missed"], &rows[6]["fault_alarm"]),
            (&Field::Null, &Field::Null)
        );
    }

    #[test]
    fn a_csv_file_holds_a_topic_to_the_last_bit() {
        let folder = tempfile::tempdir().expect("a folder");
        let log = folder.path().join("worm.mcap");
        let telemetry = with_gaps();
        write_log(&log, &telemetry);
        let topics = [Channel::State, Channel::Alarm, Channel::CommandRecord];
        let (written, _) = tables(&log, folder.path(), TableFormat::Csv, &topics, false).expect("a log");
        assert_eq!(written.len(), 3);
        let mut reader = csv::Reader::from_path(&written[0].file).expect("CSV");
        let rows: Vec<BTreeMap<String, String>> = reader.deserialize().map(|row| row.expect("a row")).collect();
        assert_eq!(rows.len(), telemetry.states.len());
        for (state, row) in telemetry.states.iter().zip(&rows) {
            let wall_ns = state.time_ns as i64 - 900_000_000 + 1_500_000_000;
            assert_eq!(row["wall_time"], wall_ns.to_string());
            let phase: f64 = row["phase"].parse().expect("a number");
            assert_eq!(phase.to_bits(), state.phase.to_bits());
        }
        assert_eq!(
            (rows[7]["position_m_2"].as_str(), rows[7]["motor_current_a"].as_str()),
            ("", "inf")
        );
        assert_eq!(
            (rows[7]["mode"].as_str(), rows[6]["emergency_stop"].as_str()),
            ("disarmed", "")
        );
        let alarms = fs::read_to_string(&written[1].file).expect("is there");
        assert!(alarms.contains(",jammed-cell,warning,0,2\n"), "{alarms}");
        let commands = fs::read_to_string(&written[2].file).expect("is there");
        let row = ",3,1000000001,7,-0.5,0.0,crawl,alarm-stands,0,2,armed,none,1,0,änn,2.5,,\n";
        assert!(commands.contains(row), "{commands}");

        let error = tables(&log, folder.path(), TableFormat::Csv, &topics, false).expect_err("are there already");
        assert!(error.to_string().contains("state.csv exists already"), "{error}");
    }

    /// What is not in the metadata is not in the table either.
    #[test]
    fn a_log_without_its_moment_has_no_wall_time() {
        let folder = tempfile::tempdir().expect("a folder");
        let log = folder.path().join("worm.mcap");
        let mut writer = worm_log::Writer::with_contents(
            fs::File::create(&log).expect("can be made"),
            &log,
            &worm_log::Contents::default(),
            worm_log::Index::None,
        )
        .expect("there is room");
        writer.write(&State::unknown(2)).expect("there is room");
        writer
            .write(&Estimate {
                time_ns: 0,
                ..crawl(0.1).estimates[0]
            })
            .expect("there is room");
        writer.finish().expect("there is room");
        let (written, _) = tables(&log, folder.path(), TableFormat::Csv, Channel::ALL, false).expect("a log");
        for table in written {
            let text = fs::read_to_string(table.file).expect("is there");
            assert!(text.lines().nth(1).is_some_and(|row| row.starts_with(',')), "{text}");
        }
    }
}

#[cfg(feature = "tables")]
#[test]
fn exports_at_once_leave_whole_tables_and_no_other_file_is_touched() {
    use worm_log::Channel;
    use worm_log::export::{TableFormat, tables};
    let folder = tempfile::tempdir().expect("a folder");
    let (log, out) = (folder.path().join("worm.mcap"), folder.path().join("tables"));
    let telemetry = crawl(1.0);
    write_log(&log, &telemetry);
    fs::create_dir(&out).expect("room");
    let own = out.join("state.csv.part");
    fs::write(&own, "mine").expect("room");
    let export = || tables(&log, &out, TableFormat::Csv, Channel::ALL, true).map(drop);
    let outcomes = std::thread::scope(|scope| {
        let exports = [scope.spawn(export), scope.spawn(export)];
        exports.map(|export| export.join().expect("no panic"))
    });
    assert!(outcomes.iter().all(Result::is_ok), "{outcomes:?}");
    assert_eq!(fs::read_to_string(&own).expect("is there"), "mine");
    let states = fs::read_to_string(out.join("state.csv")).expect("a table");
    assert_eq!(states.lines().count(), telemetry.states.len() + 1);
}
