//! The black box with real processes: a box around a stop, a black box that is killed while it writes, and one that cannot write.

use super::process::wait_for;
use super::worm::Worm;
use super::{Crawling, PATIENCE};
use std::path::PathBuf;
use worm_estimator::message::{AlarmKind, CommandKind, Estimate, Mode, RecordingProblem};
use worm_log::messages;
use wormd::topics::{Hub, Subscriber};

/// Short, so that a box is over soon.
const CONFIG: &str = "[gait]\ncycle_s = 1.25\n[black_box]\nbefore_s = 10.0\nafter_s = 2.0\nlongest_s = 30.0\n";

fn json(worm: &Worm, arguments: &[&str]) -> serde_json::Value {
    let output = worm.wormd(arguments).output();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {}\n{error}", output.status);
    serde_json::from_slice(&output.stdout).expect("JSON")
}

#[test]
fn a_stop_leaves_a_box_that_says_why() {
    let worm = Worm::new("boxed");
    let config = worm.config(CONFIG);
    let folder = tempfile::tempdir().expect("a folder");
    let boxes = folder.path().join("boxes").to_string_lossy().into_owned();
    let up = [
        "up",
        "--json",
        "--config",
        &config,
        "--duration",
        "14",
        "--fault",
        "jam:cell=2,share=0@8",
        "--black-box",
        &boxes,
    ];
    let output = worm.wormd(&up).output();
    assert_eq!(output.status.code(), Some(1), "a run that ended in a fault failed");
    let list = json(&worm, &["black-box", "list", "--folder", &boxes, "--json"]);
    let list = list.as_array().expect("a list");
    assert_eq!(list.len(), 1, "{list:?}");
    let entry = &list[0];
    assert_eq!((&entry["complete"], &entry["under_way"]), (&true.into(), &false.into()));
    assert_eq!(entry["reason"], "alarm jammed-cell", "{entry}");
    assert_eq!(entry["events"][1]["event"], "fault alarm jammed-cell", "{entry}");

    let path: PathBuf = [&boxes, entry["name"].as_str().expect("a name")].iter().collect();
    let log = messages(&path).expect("a log");
    assert_eq!(log.warnings, Vec::<String>::new());
    let event_ns = entry["events"][0]["time_ns"].as_u64().expect("a time");
    let whole = log
        .states
        .windows(2)
        .all(|pair| pair[1].sequence == pair[0].sequence + 1);
    assert!(whole, "no state is missing in between");
    let [first, last] = [log.states.first(), log.states.last()].map(|state| state.expect("states").time_ns);
    assert!(
        first + 7_000_000_000 < event_ns && last > event_ns + 1_000_000_000,
        "{first} {event_ns} {last}"
    );
    let kinds: Vec<u32> = log.commands.iter().map(|command| command.kind).collect();
    assert!(
        kinds.contains(&CommandKind::Crawl.code()),
        "what was commanded before it: {kinds:?}"
    );

    let why = json(&worm, &["why", "--folder", &boxes, "--json", "--no-explain"]);
    assert_eq!(
        (&why["stopped"], &why["reason"]["name"]),
        (&true.into(), &"jammed-cell".into())
    );
    assert_eq!((&why["reason"]["cell"], &why["worm"]), (&2.into(), &worm.name().into()));
    let replay = worm.replay(&path.to_string_lossy());
    assert!(replay.status.success(), "{}", String::from_utf8_lossy(&replay.stderr));
    // Who does not say where is shown what was kept last.
    let output = worm.wormd(&["why", "--json", "--no-explain"]).output();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success() && said.contains(&format!("wrote to {boxes} last")),
        "{said}"
    );
    assert_eq!(
        serde_json::from_slice::<serde_json::Value>(&output.stdout).ok(),
        Some(why)
    );
    let thin = json(&worm, &["black-box", "list", "--folder", &boxes, "--json", "--thin"]);
    assert_eq!(thin.as_array().map(Vec::len), Some(2), "{thin}");

    // Over a link that breaks.
    let copy = folder.path().join("copy.mcap");
    std::fs::write(
        folder.path().join("copy.mcap.part"),
        &std::fs::read(&path).expect("readable")[..70_000],
    )
    .expect("room");
    let get = [
        "black-box",
        "get",
        "last",
        "--folder",
        &boxes,
        "--out",
        &copy.to_string_lossy(),
    ];
    let output = worm.wormd(&get).output();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(std::fs::read(&copy).expect("readable") == std::fs::read(&path).expect("readable"));
    assert_eq!(worm.stale_resources(), Vec::<String>::new());
}

#[test]
fn a_black_box_that_is_killed_while_it_writes_loses_nothing_older() {
    let worm = Worm::new("killedbox");
    let config = worm.config(&CONFIG.replace("after_s = 2.0", "after_s = 20.0"));
    let folder = tempfile::tempdir().expect("a folder");
    let boxes = folder.path().to_string_lossy().into_owned();
    let mut crawling = Crawling::at_rest(worm, &["--config", &config]);
    let worm = &crawling.worm;
    let record = ["record", "--config", &config, "--black-box", &boxes];
    let mut black_box = worm.wormd(&record).start();
    crawling.make_crawl();
    wait_for("some time of crawling", PATIENCE, || {
        worm.state().is_some_and(|state| state.phase.abs() > 2.0)
    });
    let second = worm.wormd(&record).output();
    assert_eq!(second.status.code(), Some(2), "one black box for a worm");
    crawling.controller.kill();
    let under_way = || {
        let found = std::fs::read_dir(&boxes).expect("a folder").flatten();
        let mut names = found.map(|entry| entry.file_name().to_string_lossy().into_owned());
        names.any(|name| name.starts_with("box-") && name.ends_with("controller-silent.mcap.part"))
    };
    wait_for("a box of a controller that is gone", PATIENCE, under_way);
    black_box.kill();
    // The next one completes it.
    worm.wormd(&record).start().end();
    let list = json(worm, &["black-box", "list", "--folder", &boxes, "--json"]);
    let entry = &list[0];
    assert_eq!(
        (&entry["complete"], &entry["under_way"]),
        (&false.into(), &false.into()),
        "{entry}"
    );
    let why = json(worm, &["why", "--folder", &boxes, "--json", "--no-explain"]);
    assert_eq!(why["reason"]["kind"], "controller-gone", "{why}");
}

#[test]
fn a_black_box_that_cannot_write_raises_an_alarm_and_goes_on() {
    let worm = Worm::new("fullbox");
    let config = worm.config(CONFIG);
    let folder = tempfile::tempdir().expect("a folder");
    let boxes = folder.path().join("boxes").to_string_lossy().into_owned();
    let crawling = Crawling::at_rest(worm, &["--config", &config]);
    crawling.make_crawl();
    let worm = &crawling.worm;
    let hub = Hub::open(&worm.instance()).expect("the topics open");
    let mut estimates: Subscriber<Estimate> = hub.subscriber().expect("a subscriber");
    let mut alarms = hub
        .subscriber::<worm_estimator::message::Alarm>()
        .expect("a subscriber");
    let mut black_box = worm
        .wormd(&["record", "--config", &config, "--black-box", &boxes])
        .start();
    // Something else is in the place of its folder.
    std::fs::remove_dir_all(&boxes).expect("it is there");
    std::fs::write(&boxes, b"").expect("room");
    let kind = AlarmKind::RecordingStopped.code();
    wait_for("the alarm", PATIENCE, || {
        let newest = estimates
            .latest()
            .expect("readable")
            .map(|estimate| estimate.raised_mask);
        newest.is_some_and(|mask| mask >> kind & 1 == 1)
    });
    let mut raised = None;
    while let Some(alarm) = alarms.next().expect("readable") {
        raised = (alarm.kind == kind && alarm.raised == 1).then_some(*alarm).or(raised);
    }
    let raised = raised.expect("the alarm's message");
    assert_eq!(
        raised.value,
        f64::from(RecordingProblem::WriteError.code()),
        "{raised:?}"
    );
    assert!(black_box.exit_status().is_none(), "it goes on");
    assert_eq!(worm.state().map(|state| state.mode), Some(Mode::Crawling.code()));
    // It is tried again, and nothing of what waited is lost.
    std::fs::remove_file(&boxes).expect("it is there");
    wait_for("the alarm's end", PATIENCE, || {
        let newest = estimates
            .latest()
            .expect("readable")
            .map(|estimate| estimate.raised_mask);
        newest.is_some_and(|mask| mask >> kind & 1 == 0)
    });
    black_box.end();
    let list = json(worm, &["black-box", "list", "--folder", &boxes, "--json", "--thin"]);
    assert_eq!(
        (&list[0]["kind"], &list[0]["complete"]),
        (&"thin".into(), &true.into()),
        "{list}"
    );
}

/// A file system without room for a single byte, but for names.
struct FullDisk(PathBuf);

impl FullDisk {
    fn mount(folder: &std::path::Path) -> Option<Self> {
        std::fs::create_dir_all(folder).expect("a folder");
        let mut mount = std::process::Command::new("mount");
        let mounted = mount
            .args(["-t", "tmpfs", "-o", "size=4k", "tmpfs"])
            .arg(folder)
            .status();
        if !mounted.is_ok_and(|status| status.success()) {
            return None;
        }
        std::fs::write(folder.join("full"), [0; 4096]).expect("its only page");
        Some(Self(folder.to_owned()))
    }
}

impl Drop for FullDisk {
    fn drop(&mut self) {
        // A process may be ending there still.
        let _ = std::process::Command::new("umount").arg("--lazy").arg(&self.0).status();
    }
}

#[test]
fn a_box_that_waits_for_room_is_said_and_the_fault_it_is_of() {
    let worm = Worm::new("waitbox");
    let config = worm.config(CONFIG);
    let folder = tempfile::tempdir().expect("a folder");
    let Some(full) = FullDisk::mount(&folder.path().join("boxes")) else {
        println!("SKIPPED: a disk that is full needs root");
        return;
    };
    let boxes = full.0.to_string_lossy().into_owned();
    let mut crawling = Crawling::at_rest(worm, &["--config", &config]);
    crawling.make_crawl();
    let record = ["record", "--config", &config, "--black-box", &boxes];
    let mut black_box = crawling.worm.wormd(&record).start();
    crawling.kill_virtual_worm();
    crawling.wait_for_mode(Mode::Fault);
    let worm = &crawling.worm;
    let part = || {
        let mut found = std::fs::read_dir(&boxes).expect("a folder").flatten();
        found.any(|entry| entry.file_name().to_string_lossy().ends_with("link-lost.mcap.part"))
    };
    wait_for("the file of the box", PATIENCE, part);
    let bundle = folder.path().join("bundle.tar.zst").to_string_lossy().into_owned();
    for (arguments, code) in [
        (&["why"][..], 2),
        (&["black-box", "list"], 0),
        (&["bundle", "--out", &bundle], 0),
    ] {
        let place = ["--config", &config, "--folder", &boxes];
        let output = worm.wormd(&[arguments, &place].concat()).output();
        let said = [output.stdout.as_slice(), &output.stderr].concat();
        let said = String::from_utf8_lossy(&said);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
        for part in [
            "the fault link-lost is latched",
            "link-lost.mcap.part could not be written yet",
            "cannot write (disk-full)",
        ] {
            assert!(said.contains(part), "{arguments:?} does not say {part:?}: {said}");
        }
        for wrong in ["nothing has happened", "no MCAP file"] {
            assert!(!said.contains(wrong), "{arguments:?}: {said}");
        }
    }
    black_box.kill();
}
