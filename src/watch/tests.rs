mod fixture;
mod words;

use super::app::Seat;
use super::*;
use crate::relay::source::{Seen, Worm as RelayedWorm};
use crate::relay::wire::{Driver, Line, Network, Request, Subject};
use fixture::{NOW_NS, alarm, drawn, inferred, painted, received, screen, screen_over};
use ratatui::style::Color;
use worm_estimator::config::Config;
use worm_estimator::message::{
    Alarm, AlarmKind, Cycle, Estimate, Mode, RecordingProblem, RecordingState, RecordingStatus, Severity, State,
};

#[test]
fn the_picture_shows_what_was_heard() {
    let picture = painted(110, 34, &received(3.4));
    println!("{picture}");
    for part in [
        "worm1",
        "crawling",
        "cycle 3.40",
        "jammed-cell cell 2",
        "6.83",
        "46.9±0.2",
        "101 ticks",
        "a line of the log",
    ] {
        assert!(picture.contains(part), "{part:?} is missing in\n{picture}");
    }
    let canal = picture
        .lines()
        .find(|line| line.contains("▐1▌"))
        .expect("cell 1 is drawn");
    for cell in ["▐4▌", "▐3▌", "▐2▌"] {
        assert!(canal.contains(cell), "{cell} is missing in {canal}");
    }
}

#[test]
fn a_worm_that_nobody_sees_is_drawn_hollow_where_it_should_be() {
    let mut telemetry = received(3.4);
    telemetry.take_inferred(&inferred());
    // The tracker has been silent since the worm began: the estimate is repeated, and old.
    let unseen = painted(110, 34, &telemetry);
    println!("{unseen}");
    for part in [
        "[1]",
        "[4]",
        "~1.71±0.06",
        "~972±31",
        "at ~64±4 mm, ~6.7±0.2 mm and ~47±2 mJ a cycle",
        "not seen",
    ] {
        assert!(unseen.contains(part), "{part:?} is missing in\n{unseen}");
    }
    assert!(!unseen.contains("▐1▌"), "{unseen}");
    // With a sample of now, what is measured is drawn, and what is inferred stands beside it.
    let now_ns = telemetry.state.map_or(0, |state| state.time_ns);
    telemetry.estimate = telemetry.estimate.map(|estimate| Estimate {
        time_ns: now_ns,
        ..estimate
    });
    let seen = painted(130, 34, &telemetry);
    for part in ["▐1▌", "~1.71±0.06", "at ~64±4 mm"] {
        assert!(seen.contains(part), "{part:?} is missing in\n{seen}");
    }
    let summary = serde_json::to_value(Summary::new(&Config::default(), &telemetry, Mode::Crawling)).expect("JSON");
    assert_eq!(summary["inferred"]["friction_n"][3], 1.71);
    assert_eq!(summary["inferred"]["standing"], "fitted");
}

/// The terminal that everybody has shows the worm, its tips, its alarms and its cycles.
#[test]
fn the_usual_terminal_shows_the_worm() {
    let picture = painted(80, 24, &received(3.4));
    for part in [
        "▐1▌",
        "Ctrl-C",
        "│4 ",
        "jammed-cell cell 2",
        "46.9±0.2",
        "COT",
        "101 ticks",
        "slides backward",
    ] {
        assert!(picture.contains(part), "{part:?} is missing in\n{picture}");
    }
}

/// What is not known yet is not shown as a number.
#[test]
fn an_unsettled_cycle_has_no_energy() {
    let mut telemetry = received(2.4);
    telemetry.take_cycle(&Cycle {
        settled: 0,
        cot: 0.0,
        energy_loss_sigma_j: f64::NAN,
        ..*telemetry.cycles.last().expect("two cycles")
    });
    let summary = Summary::new(&Config::default(), &telemetry, Mode::Crawling);
    assert_eq!(summary.cycles[2].cot, None);
    for text in [summary.to_string(), painted(110, 34, &telemetry)] {
        assert!(!text.contains("NaN"), "{text}");
    }
}

/// A terminal of any size, and a worm of which nothing is known yet, must not end the run.
#[test]
fn no_terminal_is_too_small() {
    for (width, height) in [(1, 1), (10, 3), (40, 12), (79, 24), (250, 80)] {
        for telemetry in [Telemetry::default(), received(1.5)] {
            let mut app = screen(Seat::Watch, &telemetry, None);
            for key in "1n2e a?c".chars() {
                app.key(key, NOW_NS);
                drawn(width, height, &app, NOW_NS);
                drawn(width, height, &app, 3 * NOW_NS);
            }
        }
    }
}

proptest::proptest! {
    /// Whatever a broken controller or estimator publishes, no page panics or hangs.
    #[test]
    fn any_value_can_be_painted(
        values in proptest::array::uniform16(proptest::num::f64::ANY),
        codes in proptest::array::uniform8(proptest::num::u32::ANY),
        time_ns in proptest::num::u64::ANY,
    ) {
        let mut telemetry = received(1.5);
        let [mode, fault, cells, mask, kind, cell, severity, state] = codes;
        telemetry.take_state(&State {
            time_ns, mode, fault, fault_alarm: kind, phase: values[0], motor_current_a: values[1], position_m: values,
            acknowledged_mask: mask, ..telemetry.state.expect("a state")
        });
        telemetry.take_estimate(&Estimate {
            time_ns, cell_count: cells % 17, position_m: values, contact_m: values, deformation_m: values, force_n: values,
            battery_fraction: values[2], sliding_mask: mask, raised_mask: mask, ..telemetry.estimate.expect("an estimate")
        });
        telemetry.take_cycle(&Cycle {
            advance_m: values[3], energy_electrical_j: values[4], energy_copper_j: values[5], energy_loss_j: values[6], cot: values[7],
            ..*telemetry.cycles.last().expect("a cycle")
        });
        telemetry.take_alarm(&Alarm { time_ns, kind, cell, severity, phase: values[8], ..alarm(9, 1_000_000_000, 1) });
        telemetry.take_recording(&RecordingStatus {
            sequence: 0, time_ns, bytes: time_ns, messages: 0, messages_lost: time_ns, files: time_ns, state, problem: kind,
        });
        let mut app = screen(Seat::Watch, &telemetry, None);
        for key in "1e a?".chars() {
            app.key(key, NOW_NS);
            drawn(80, 24, &app, NOW_NS);
        }
    }
}

fn network(frames_lost: u64) -> Network {
    Network {
        robot: "robot1".to_owned(),
        may_drive: true,
        frames_lost,
        round_trip_ms: Some(20),
        boot_id: String::new(),
        synchronised: None,
        wall_offset_ns: 0,
    }
}

#[test]
fn frames_that_a_network_lost_are_not_laid_to_the_screen() {
    for (network, words) in [
        (None, "3 frames were left out: this screen did not take them"),
        (Some(network(3)), "3 frames were lost on the way"),
    ] {
        let mut app = screen_over(network, Seat::Watch, &received(3.4), None);
        app.take(Line::Lost { frames: 3 }, NOW_NS);
        assert!(app.take_log().any(|line| line.starts_with(words)), "{words}");
    }
}

/// As after a fleet process that was suspended: what it held comes first when it goes on.
#[test]
fn a_frame_that_waited_on_the_way_is_not_compared_with_the_ghost() {
    const MS: u64 = 1_000_000;
    let telemetry = received(3.4);
    let mut app = screen_over(Some(network(0)), Seat::Watch, &telemetry, None);
    let began_ns = telemetry.state.expect("a state").time_ns;
    let mut scores = |made_ms: u64, comes_ms: u64| {
        let time_ns = began_ns + made_ms * MS;
        let mut worm = RelayedWorm::new(Subject::of(&Config::default()));
        worm.telemetry = telemetry.clone();
        let (state, estimate) = (
            telemetry.state.expect("a state"),
            telemetry.estimate.expect("an estimate"),
        );
        worm.telemetry.take_state(&State { time_ns, ..state });
        worm.telemetry.take_estimate(&Estimate { time_ns, ..estimate });
        let mut frame = worm.frame(2, time_ns, Seen::default(), 1, None);
        frame.network = Some(network(0));
        app.take(Line::Frame(Box::new(frame)), NOW_NS + comes_ms * MS);
        app.take_log().filter(|line| line.contains("from its ghost")).count()
    };
    assert_eq!([scores(50, 60), scores(100, 115)], [0, 0], "there was no silence");
    assert_eq!(scores(150, 10_160), 0, "it was made ten seconds ago");
    assert_eq!(
        scores(10_200, 10_220),
        1,
        "the worm as it is now, after ten seconds of silence"
    );
}

/// Each page has what it is for, in the usual terminal and in a large one.
#[test]
fn every_page_shows_what_it_is_for() {
    let mut telemetry = received(3.4);
    telemetry.take_estimate(&Estimate {
        time_ns: telemetry.state.map_or(0, |state| state.time_ns),
        ..telemetry.estimate.expect("an estimate")
    });
    for (width, height) in [(80, 24), (120, 40)] {
        for (key, parts) in [
            ('2', ["cell 2: position", "it slides at 1.75", "60 s ago"]),
            ('e', ["copper", "200.0", "370.0"]),
            ('a', ["jammed-cell cell 2", "critical", "free the cell, then reset"]),
            ('?', ["asks once more", "take over", "q leaves"]),
        ] {
            let mut app = screen(Seat::Watch, &telemetry, None);
            assert_eq!(app.key(key, NOW_NS), None);
            let picture = drawn(width, height, &app, NOW_NS).backend().to_string();
            for part in parts {
                assert!(
                    picture.contains(part),
                    "{part:?} is missing on page {key} in\n{picture}"
                );
            }
            app.key(key, NOW_NS);
            let picture = drawn(width, height, &app, NOW_NS).backend().to_string();
            assert!(picture.contains("gait cycles"), "its key leaves a page:\n{picture}");
        }
    }
}

/// What is old is grey, and says how old it is; the same values a moment before are not.
#[test]
fn what_is_old_looks_old() {
    let telemetry = received(3.4);
    let app = screen(Seat::Watch, &telemetry, None);
    let grey = |now_ns| {
        let terminal = drawn(80, 24, &app, now_ns);
        let buffer = terminal.backend().buffer();
        let worm = (0..80).map(|column| buffer[(column, 3)].fg);
        let is_grey = worm.clone().filter(|colour| *colour == Color::DarkGray).count() == 80;
        (is_grey, terminal.backend().to_string())
    };
    let (is_grey, picture) = grey(NOW_NS + 900_000_000);
    assert!(!is_grey && !picture.contains("nothing heard"), "{picture}");
    let (is_grey, picture) = grey(NOW_NS + 3_000_000_000);
    assert!(
        is_grey && picture.contains("nothing heard of the relay for 3 s"),
        "{picture}"
    );
    // The relay is there, the controller is not.
    let mut old = telemetry.clone();
    old.take_state(&State {
        time_ns: 1_000_000_000,
        ..old.state.expect("a state")
    });
    let mut app = screen(Seat::Watch, &old, None);
    let frame = |time_ns: u64| {
        let mut worm = RelayedWorm::new(Subject::of(&Config::default()));
        worm.telemetry = old.clone();
        Line::Frame(Box::new(worm.frame(2, time_ns, Seen::default(), 1, None)))
    };
    app.take(frame(4_000_000_000), NOW_NS);
    let picture = drawn(80, 24, &app, NOW_NS).backend().to_string();
    assert!(picture.contains("no state for 3 s"), "{picture}");
    app.lose("the connection to the relay was lost".to_owned(), NOW_NS);
    let picture = drawn(80, 24, &app, NOW_NS + 2_000_000_000).backend().to_string();
    assert!(
        picture.contains("2 s old: the connection to the relay was lost"),
        "{picture}"
    );
}

/// What moves the worm is asked for once more; what halts it is not; and who drives is said.
#[test]
fn keys_ask_for_what_they_say() {
    let telemetry = received(3.4);
    let mut app = screen(Seat::Watch, &telemetry, None);
    let mut pressed = |keys: &[(char, u64)]| -> Vec<Request> {
        let asked = keys
            .iter()
            .filter_map(|(key, at_ms)| app.key(*key, NOW_NS + at_ms * 1_000_000));
        asked.map(|(_, request)| request).collect()
    };
    let crawl = Request::Crawl { cycles_per_s: None };
    assert_eq!(pressed(&[('c', 0)]), []);
    assert_eq!(pressed(&[('c', 4_999)]), [crawl]);
    assert_eq!(
        pressed(&[('c', 5_000), ('c', 10_001), ('r', 10_002)]),
        [],
        "too late, or another"
    );
    assert_eq!(
        pressed(&[('r', 10_003), ('c', 10_004), ('x', 10_005), ('c', 10_006)]),
        [Request::Reset]
    );
    assert_eq!(
        pressed(&[('h', 0), (' ', 0), ('s', 0), ('t', 0)]),
        [Request::Hold, Request::Hold, Request::Stop, Request::TakeOver]
    );

    let mut disarmed = telemetry.clone();
    disarmed.take_state(&State {
        mode: Mode::Disarmed.code(),
        ..disarmed.state.expect("a state")
    });
    let mut app = screen(Seat::Watch, &disarmed, None);
    app.key('c', NOW_NS);
    let picture = drawn(80, 24, &app, NOW_NS).backend().to_string();
    assert!(picture.contains("c once more to arm the worm"), "{picture}");
    assert_eq!(app.key('c', NOW_NS), Some((1, Request::Arm)));

    let driver = |watcher, name: &str| Driver {
        watcher,
        name: name.to_owned(),
        user: 1000,
        since_ms: 12_345,
        attends: true,
    };
    for (driver, parts) in [
        (
            driver(7, "me"),
            ["you drive since 12 s", "q leaves, and the worm holds"],
        ),
        (
            driver(8, "ann"),
            ["ann drives since 12 s", "q leaves; the worm goes on"],
        ),
    ] {
        let app = screen(Seat::Watch, &telemetry, Some(driver));
        let picture = drawn(80, 24, &app, NOW_NS).backend().to_string();
        for part in parts {
            assert!(picture.contains(part), "{part:?} is missing in\n{picture}");
        }
    }
}

#[test]
fn a_summary_is_what_was_heard() {
    let summary = Summary::new(&Config::default(), &received(3.4), Mode::Crawling);
    let json = serde_json::to_value(&summary).expect("serialises");
    assert_eq!(json["ticks"], 101);
    assert_eq!(json["cycles"].as_array().map(Vec::len), Some(3));
    assert_eq!(json["cycles"][1]["forward_slide_m"].as_array().map(Vec::len), Some(4));
    let alarms: Vec<_> = summary
        .alarms
        .iter()
        .map(|alarm| (alarm.cell, alarm.cleared_s.is_some()))
        .collect();
    assert_eq!(alarms, [(Some(2), true), (Some(2), false)]);
    assert!(
        (80.0..=121.0).contains(&summary.timing.wake_us.p99),
        "{:?}",
        summary.timing.wake_us
    );
    assert!(summary.to_string().contains("model    6.833    46.88"), "{summary}");
}

/// A model mismatch says where it is, in the picture, in the summary and in its JSON; no other alarm has a place.
#[test]
fn a_mismatch_comes_with_its_place() {
    let mut telemetry = received(7.4);
    telemetry.take_alarm(&Alarm {
        value: 3.1e-4,
        threshold: 1.5e-4,
        phase: 6.55,
        kind: AlarmKind::ModelMismatch.code(),
        severity: Severity::Warning.code(),
        ..alarm(3, 6_000_000_000, 1)
    });
    let words = "cell 2 while cell 3 steps, phase 0.55: +0.31 mm a cycle unexplained";
    let summary = Summary::new(&Config::default(), &telemetry, Mode::Crawling);
    assert!(summary.to_string().contains(words), "{summary}");
    let places: Vec<_> = summary.alarms.iter().map(|alarm| alarm.place.is_some()).collect();
    assert_eq!(places, [false, false, true]);
    let json = serde_json::to_value(&summary).expect("serialises");
    assert_eq!(json["alarms"][2]["place"]["stepping_cell"], 3);
    let picture = painted(250, 34, &telemetry);
    assert!(picture.contains("phase 0.55: +0.31"), "{picture}");
}

/// The picture shows how far a recording is, and why it stopped; the alarm says it in words.
#[test]
fn a_recording_is_shown() {
    let mut telemetry = received(2.4);
    let mut status = RecordingStatus {
        sequence: 3,
        time_ns: 0,
        bytes: 12_345_678,
        messages: 4000,
        messages_lost: 0,
        files: 2,
        state: RecordingState::Recording.code(),
        problem: RecordingProblem::None.code(),
    };
    telemetry.take_recording(&status);
    let picture = painted(110, 34, &telemetry);
    assert!(picture.contains("recording 12.3 MB, file 2"), "{picture}");
    status.state = RecordingState::Stopped.code();
    status.problem = RecordingProblem::DiskFull.code();
    telemetry.take_recording(&status);
    telemetry.take_alarm(&Alarm {
        value: 1.0,
        threshold: 0.0,
        kind: AlarmKind::RecordingStopped.code(),
        severity: Severity::Warning.code(),
        cell: u32::MAX,
        ..alarm(3, 6_000_000_000, 1)
    });
    let picture = painted(250, 34, &telemetry);
    for part in ["recording stopped: disk-full", "recording-stopped: disk-full"] {
        assert!(picture.contains(part), "{part} is not in {picture}");
    }
    let summary = Summary::new(&Config::default(), &telemetry, Mode::Crawling).to_string();
    assert!(summary.contains("recording-stopped (disk-full): warning"), "{summary}");
}

/// An alarm stays shown as raised, however many other changes came since.
#[test]
fn what_is_raised_does_not_depend_on_what_is_kept() {
    let mut telemetry = Telemetry::default();
    telemetry.take_alarm(&alarm(0, 1_000_000_000, 1));
    for number in 1..20_000 {
        telemetry.take_alarm(&Alarm {
            kind: AlarmKind::LinkFault.code(),
            ..alarm(number, 1_000_000_000 + number, (number % 2) as u32)
        });
    }
    let raised: Vec<u32> = telemetry.raised().iter().map(|alarm| alarm.kind).collect();
    assert_eq!(raised, [AlarmKind::JammedCell.code(), AlarmKind::LinkFault.code()]);
    let summary = Summary::new(&Config::default(), &telemetry, Mode::Crawling);
    assert_eq!(
        (summary.alarm_changes_dropped, summary.alarms.len()),
        (20_000 - 8_192, 4_096)
    );
}
