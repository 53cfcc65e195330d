//! What the bridge refuses stands in the worm's record, with who asked.

use super::{PATIENCE, Robot, path, rogue};
use serde_json::{Value, json};
use std::time::{Duration, Instant};
use worm_estimator::message::{CommandKind, CommandOutcome, Mode};
use zenoh::Wait;

/// The senders of the recorded commands of this kind in frames.
fn senders(frame: &Value, kind: CommandKind) -> Vec<String> {
    let records = frame["commands"].as_array().into_iter().flatten();
    let of_kind = records.filter(|record| record["kind"] == kind.name());
    of_kind
        .filter_map(|record| record["sender"].as_str().map(str::to_owned))
        .collect()
}

#[test]
fn who_is_refused_by_the_bridge_is_recorded_by_its_certificate_and_not_at_any_rate() {
    let robot = Robot::start("b-ref", None);
    let name = robot.worm.name();
    let log = robot.files.path().join("run.mcap");
    let recorder = robot.worm.wormd(&["record", "--out", path(&log)]).start();
    for kind in [CommandKind::Arm, CommandKind::Crawl] {
        assert_eq!(robot.worm.order(kind), CommandOutcome::Accepted);
    }
    let [hall, anna] = [robot.laptop("keys", "hall"), robot.laptop("keys", "anna")];
    let mut passer_by = hall.watch("at the door");
    passer_by.hello(PATIENCE);
    assert_eq!(passer_by.ask("crawl", PATIENCE)["verdict"], "not-permitted");
    let frame = passer_by.frame(PATIENCE, |frame| {
        senders(frame, CommandKind::NotPermitted) == ["hall at the door: crawl"]
    });
    let words =
        "crawl from hall at the door was refused by the bridge: the certificate may watch and hold, and nothing else";
    let is_said = |frame: &Value| {
        let events = frame["events"].as_array().into_iter().flatten();
        events.filter(|event| event["text"] == words).count() == 1
    };
    // In that frame or, as the relay notes it before the controller has recorded it, the one before.
    assert!(
        is_said(&frame) || is_said(&hall.watch("another").hello(PATIENCE)),
        "{frame}"
    );

    // Who may drive, and whose commands cannot be known to be fresh, again and again.
    let session = zenoh::open(rogue(&robot.files.path().join("keys"), "anna", robot.port))
        .wait()
        .expect("opens");
    let mut watcher = anna.watch("anna");
    watcher.hello(PATIENCE);
    let up = json!({
        "version": 1,
        "echo": null,
        "requests": [{"worm": name, "watcher": 1, "name": "late", "line": {"id": 1, "command": "arm"}}],
    });
    let begun = Instant::now();
    let mut recorded = 0;
    while begun.elapsed() < Duration::from_secs(3) {
        session
            .put("wormd/1/up/anna/late", up.to_string())
            .wait()
            .expect("is sent");
        let frame = watcher.frame(PATIENCE, |_| true);
        let senders = senders(&frame, CommandKind::Stale);
        assert!(senders.iter().all(|sender| sender == "anna late: arm"), "{senders:?}");
        recorded += senders.len() as u64;
    }
    let most = begun.elapsed().as_secs() + 1;
    assert!((2..=most).contains(&recorded), "{recorded} in {:?}", begun.elapsed());

    // Nobody elsewhere writes the record.
    watcher.write(&json!({"id": 77, "command": "note_refusal", "name": "ben", "refused": "stop", "verdict": "stale"}));
    assert_eq!(watcher.answer(77, PATIENCE)["verdict"], "unusable");

    // A stop, which the log of the last seconds is to explain.
    assert_eq!(robot.worm.order(CommandKind::Stop), CommandOutcome::Accepted);
    robot.wait_for_mode(Mode::Disarmed);
    recorder.end();
    let arguments = ["why", path(&log), "--no-explain", "--json"];
    let output = robot.worm.plain_wormd(&arguments).output();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains(words), "{said} {output:?}");
    let user = nix::unistd::getuid();
    let late = format!("arm from anna late (user {user}) was refused: it came too late");
    assert!(said.contains(&late), "{said}");
}
