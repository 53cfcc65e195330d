//! A recorder that stops, is killed or ends in order.

use super::worm::Bench;
use crate::config::Config;
use crate::message::AlarmKind::RecordingStopped;
use crate::message::{Alarm, RecordingProblem, RecordingState, RecordingStatus};

fn report(bench: &mut Bench, state: RecordingState, problem: RecordingProblem) {
    bench.monitor.note_recording(&RecordingStatus {
        sequence: 0,
        time_ns: bench.state.time_ns,
        bytes: 0,
        messages: 0,
        messages_lost: 0,
        files: 1,
        state: state.code(),
        problem: problem.code(),
    });
}

/// Crawls for so many seconds with a recorder that reports once a second.
fn record(bench: &mut Bench, seconds: u32) {
    for _ in 0..seconds {
        report(bench, RecordingState::Recording, RecordingProblem::None);
        bench.run(1.0);
    }
}

fn crawling() -> Bench {
    let mut bench = Bench::new(Config::default(), 3);
    bench.crawl_cycles(0.5);
    bench
}

/// Changes of the alarm: raised, value, threshold.
fn changes(bench: &Bench) -> Vec<(u32, f64, f64)> {
    let ours = |alarm: &&Alarm| alarm.kind == RecordingStopped.code();
    let of_alarm = |alarm: &Alarm| (alarm.raised, alarm.value, alarm.threshold);
    bench.changes.iter().filter(ours).map(of_alarm).collect()
}

#[test]
fn without_a_recorder_there_is_nothing_to_watch() {
    let mut bench = crawling();
    bench.run(20.0);
    assert!(!bench.is_armed(RecordingStopped));
    record(&mut bench, 20);
    assert!(bench.is_armed(RecordingStopped));
    report(&mut bench, RecordingState::Ended, RecordingProblem::None);
    bench.run(20.0);
    assert!(!bench.is_armed(RecordingStopped));
    assert_eq!(changes(&bench), []);
}

#[test]
fn a_full_disk_raises_it_at_once_until_a_new_recorder_writes() {
    let mut bench = crawling();
    record(&mut bench, 3);
    report(&mut bench, RecordingState::Stopped, RecordingProblem::DiskFull);
    bench.run(0.01);
    assert_eq!(changes(&bench), [(1, 1.0, 0.0)]);
    bench.run(60.0);
    assert_eq!(
        bench.raised(),
        [RecordingStopped],
        "the recorder is gone, and the alarm stays"
    );
    bench.restart_controller();
    bench.run(1.0);
    assert_eq!(
        bench.raised(),
        [RecordingStopped],
        "a new controller changes nothing about it"
    );
    record(&mut bench, 3);
    assert_eq!(bench.raised(), []);
}

#[test]
fn a_killed_recorder_raises_it_after_its_silence_and_a_pause_is_no_silence() {
    let mut bench = crawling();
    record(&mut bench, 3);
    // The computer stands still for ten seconds.
    bench.state.time_ns += 10_000_000_000;
    bench.state.host_paused_ns += 10_000_000_000;
    bench.run(1.0);
    record(&mut bench, 3);
    assert_eq!(changes(&bench), []);
    let fell_silent_ns = bench.state.time_ns - 1_000_000_000;
    bench.run(3.9);
    assert_eq!(changes(&bench), []);
    bench.run(0.2);
    let (raised, value, threshold) = changes(&bench)[0];
    assert!(
        (raised, threshold) == (1, 5.0) && (5.0..5.1).contains(&value),
        "{value}"
    );
    let since_ns = bench.changes.iter().map(|alarm| alarm.since_ns).next_back();
    assert_eq!(since_ns, Some(fell_silent_ns), "since its last report");
    report(&mut bench, RecordingState::Ended, RecordingProblem::None);
    bench.run(2.0);
    assert_eq!(bench.raised(), []);
}
