//! A recording that is bounded, and one that cannot go on: the worm crawls on, and an alarm says so.

use super::process::wait_for;
use super::worm::Worm;
use super::{Crawling, PATIENCE};
use std::path::PathBuf;
use worm_estimator::message::{Alarm, AlarmKind, Estimate, Mode, RecordingProblem};
use worm_log::messages;
use wormd::topics::{Hub, Subscriber};

/// The recorder's silence counts sooner than by default.
const CONFIG: &str = "[gait]\ncycle_s = 1.25\n[alarms]\nrecording_stopped = { policy = \"warn\", threshold = 3.0 }\n";

#[test]
fn a_recording_in_several_files_loses_and_doubles_nothing() {
    let worm = Worm::new("rotate");
    let folder = tempfile::tempdir().expect("a folder");
    let first = folder.path().join("run.mcap").to_string_lossy().into_owned();
    let arguments = [
        "up",
        "--json",
        "--duration",
        "6",
        "--record",
        &first,
        "--max-age",
        "1s",
        "--keep",
        "20",
    ];
    let output = worm.wormd(&arguments).output();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}\n{error}", output.status);
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("a summary");
    assert_eq!(
        summary["alarms"],
        serde_json::json!([]),
        "a recorder that ends in order is no alarm"
    );
    assert_eq!(worm.stale_resources(), Vec::<String>::new());

    let names = (1..).map(|number| folder.path().join(format!("run.{number}.mcap")));
    let files: Vec<PathBuf> = std::iter::once(PathBuf::from(&first))
        .chain(names.take_while(|path| path.exists()))
        .collect();
    assert!(files.len() >= 4, "{} files", files.len());
    let mut states = Vec::new();
    for file in &files {
        let log = messages(file).expect("a log");
        assert_eq!(log.warnings, Vec::<String>::new(), "{} is complete", file.display());
        states.extend(log.states.iter().map(|state| state.sequence));
    }
    let count = states.len() as u64;
    assert!(states.into_iter().eq(0..count), "every state once, from the first on");
    assert!(Some(count) >= summary["ticks"].as_u64(), "and to the last");
    let replay = worm.replay(&first);
    assert!(replay.status.success(), "{}", String::from_utf8_lossy(&replay.stdout));
}

/// What the test hears of the worm.
struct Listener {
    estimates: Subscriber<Estimate>,
    alarms: Subscriber<Alarm>,
    changes: Vec<Alarm>,
    newest: Option<Estimate>,
}

impl Listener {
    fn open(worm: &Worm) -> Self {
        let hub = Hub::open(&worm.instance()).expect("the topics open");
        Self {
            estimates: hub.subscriber().expect("a subscriber"),
            alarms: hub.subscriber().expect("a subscriber"),
            changes: Vec::new(),
            newest: None,
        }
    }

    fn listen(&mut self) {
        while let Some(estimate) = self.estimates.next().expect("readable") {
            self.newest = Some(*estimate);
        }
        while let Some(alarm) = self.alarms.next().expect("readable") {
            self.changes.push(*alarm);
        }
    }

    /// Waits until the alarm is raised or not, also by the estimate; gives its last change.
    fn wait_for_alarm(&mut self, raised: bool) -> Alarm {
        let kind = AlarmKind::RecordingStopped.code();
        wait_for("a change of the alarm", PATIENCE, || {
            self.listen();
            let last = self.changes.iter().rfind(|alarm| alarm.kind == kind);
            let is_raised = |estimate: Estimate| estimate.raised_mask >> kind & 1 == 1;
            last.is_some_and(|alarm| alarm.raised == u32::from(raised)) && self.newest.map(is_raised) == Some(raised)
        });
        *self
            .changes
            .iter()
            .rfind(|alarm| alarm.kind == kind)
            .expect("was there")
    }
}

#[test]
fn a_full_disk_or_a_killed_recorder_raises_an_alarm_and_the_worm_crawls_on() {
    let worm = Worm::new("full");
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let config = worm.config(CONFIG);
    let crawling = Crawling::at_rest(worm, &["--config", &config]);
    crawling.make_crawl();
    let worm = &crawling.worm;
    let mut listener = Listener::open(worm);

    // No room for more than 400 kB.
    let full = path("full.mcap");
    let recorder = worm
        .wormd(&["record", "--out", &full])
        .with_file_size_limit(400_000)
        .start_with_log();
    let alarm = listener.wait_for_alarm(true);
    assert_eq!(
        (alarm.value, alarm.threshold),
        (f64::from(RecordingProblem::DiskFull.code()), 0.0)
    );
    let (status, error) = recorder.log_at_its_end();
    assert_eq!(status.code(), Some(1), "{error}");
    assert!(
        error.contains("full.mcap: cannot be written: File too large"),
        "{error}"
    );
    let log = messages(full.as_ref()).expect("what was recorded can be read");
    assert!(log.states.len() > 500, "{} states", log.states.len());
    assert!(log.warnings[0].starts_with("cut off after"), "{:?}", log.warnings);
    let consecutive = log
        .states
        .windows(2)
        .all(|pair| pair[1].sequence == pair[0].sequence + 1);
    assert!(consecutive, "none is missing in between");

    // A recorder with room clears it; killed, it raises it again.
    let second = path("second.mcap");
    let mut recorder = worm.wormd(&["record", "--out", &second]).start();
    listener.wait_for_alarm(false);
    recorder.kill();
    let alarm = listener.wait_for_alarm(true);
    assert!(
        alarm.value > 3.0 && alarm.threshold == 3.0,
        "a silence of 3 s: {alarm:?}"
    );
    let log = messages(second.as_ref()).expect("what was recorded can be read");
    assert!(log.states.len() > 100, "{} states", log.states.len());

    // Its file removed, and one that ends in order.
    let third = path("third.mcap");
    let recorder = worm.wormd(&["record", "--out", &third]).start_with_log();
    listener.wait_for_alarm(false);
    std::fs::remove_file(&third).expect("is there");
    let alarm = listener.wait_for_alarm(true);
    assert_eq!(alarm.value, f64::from(RecordingProblem::FileRemoved.code()));
    let (status, error) = recorder.log_at_its_end();
    assert_eq!(status.code(), Some(1), "{error}");
    let recorder = worm.wormd(&["record", "--out", &third]).start();
    listener.wait_for_alarm(false);
    recorder.end();
    let log = messages(third.as_ref()).expect("a log");
    assert_eq!(log.warnings, Vec::<String>::new());
    let was_raised = |estimate: &Estimate| estimate.raised_mask >> AlarmKind::RecordingStopped.code() & 1 == 1;
    assert!(log.estimates.iter().any(was_raised), "the alarm of the recorder before");

    listener.listen();
    let newest = listener.newest.expect("was heard");
    assert_eq!(
        newest.states_lost, 0,
        "the loop has published every state, and the estimator has received it"
    );
    let state = worm.state().expect("was heard");
    assert!(newest.state_sequence > 1000, "{newest:?}");
    assert_eq!(state.mode, Mode::Crawling.code(), "the worm has crawled all the time");
}
