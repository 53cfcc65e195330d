//! Logs as recordings, and recordings as logs.

use std::path::{Path, PathBuf};
use testkit::crawl::{Crawl, Scene, paper_worm};
use testkit::log_sample::{Telemetry, write_log};
use worm_analysis::recording::mcap::{read, write};
use worm_analysis::recording::{Motor, OpenOptions, ReadError, Recording, Wanted, open};
use worm_estimator::config::Config;
use worm_estimator::message::State;

/// The states of a crawl of so many seconds; every tick is 5 ms.
fn states(seconds: f64) -> (Crawl, Vec<State>) {
    let scene = Scene {
        tick_hz: 200.0,
        ripple: 0.0,
        noise_m: 0.0,
        cycles_per_s: 0.5,
        ..Scene::default()
    };
    let mut crawl = Crawl::new(paper_worm(0.0, false), scene);
    let states = (0..(seconds * 200.0) as usize).map(|_| crawl.tick()).collect();
    (crawl, states)
}

fn read_states(states: Vec<State>) -> Result<Recording, ReadError> {
    in_a_log(states, read)
}

/// What `of` makes of the log of some states.
fn in_a_log<T>(states: Vec<State>, of: impl FnOnce(&Path) -> T) -> T {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("worm.mcap");
    let telemetry = Telemetry {
        states,
        ..Telemetry::default()
    };
    write_log(&path, &telemetry);
    of(&path)
}

#[test]
fn a_recording_has_each_sample_with_its_position_and_time() {
    let (crawl, mut states) = states(8.3);
    let unseen = states.iter().position(|state| state.sample == 100).expect("is there");
    states[unseen].valid_mask = 0b1101;
    let recording = read_states(states).expect("a recording");
    assert_eq!((recording.cells(), recording.samples()), (4, 996));
    assert_eq!(recording.cell_names, ["x1_m", "x2_m", "x3_m", "x4_m"]);
    assert!(recording.position_m[1][99].is_nan() && recording.position_m[2][99].is_finite());
    let phase = recording.gait_phase.as_ref().expect("is recorded");
    for (sample, (&time_s, &phase)) in recording.time_s.iter().zip(phase).enumerate() {
        assert!(
            (time_s - 77.0 - (sample as f64 + 0.5) / 120.0).abs() < 1e-12,
            "the tracker's own clock"
        );
        // A tick later the cam would be 0.0025 cycles further; the encoder has steps of 1/4096.
        assert!(
            (phase - 0.5 * (time_s - 77.0)).abs() < 6e-4,
            "sample {sample} at phase {phase}"
        );
    }
    // Two cycles later every cell is where the model says.
    let truth_m = crawl.milestones[3].mean_m - crawl.milestones[1].mean_m;
    let ledger = crawl.milestones[3].ledger.since(&crawl.milestones[1].ledger);
    assert!(ledger.loss_j() > 0.0);
    let at = |cycles: f64| phase.iter().position(|&phase| phase >= cycles).expect("is reached");
    let mean_m = |sample: usize| recording.position_m.iter().map(|cell| cell[sample]).sum::<f64>() / 4.0;
    assert!((mean_m(at(3.0)) - mean_m(at(1.0)) - truth_m).abs() < 2e-4);
    let motor = recording.motor.expect("is recorded");
    assert_eq!((motor.current_a[500], motor.voltage_v[500]), (0.2, 5.0));
}

/// As a log that was recorded over a network has them.
#[test]
fn of_a_log_with_few_of_the_ticks_each_has_its_sample() {
    let (_, mut states) = states(8.3);
    let mut tick = 0;
    states.retain(|_| {
        tick += 1;
        tick % 7 == 3
    });
    let count = states.len();
    let flagged = states.iter().filter(|state| state.sample_is_new == 1).count();
    assert!(
        flagged < count * 2 / 3,
        "many come with ticks that are not there: {flagged} of {count}"
    );
    let recording = read_states(states).expect("a recording");
    assert!(recording.samples() + 2 >= count, "{} of {count}", recording.samples());
    let phase = recording.gait_phase.as_ref().expect("is recorded");
    for (&time_s, &phase) in recording.time_s.iter().zip(phase) {
        assert!((phase - 0.5 * (time_s - 77.0)).abs() < 3e-3, "{time_s} s: {phase}");
    }
}

#[test]
fn the_log_of_a_worm_that_nobody_sees_has_the_motor_alone() {
    let (_, seen) = states(8.3);
    let mut unseen = seen.clone();
    for (tick, state) in unseen.iter_mut().enumerate() {
        (state.sample, state.sample_is_new, state.valid_mask) = (0, 0, 0);
        state.position_m.fill(f64::NAN);
        // A current that the mean over any readings has right; every fifth reading fails, and some have none.
        state.motor_current_a = if tick % 7 == 3 { f64::NAN } else { state.phase };
        state.motor_is_new = u32::from(tick % 5 != 4);
    }
    let window_s = Wanted::USUAL_WINDOW_S;
    let opened = |states: &[State], wanted: Wanted| {
        let options = OpenOptions {
            wanted,
            ..OpenOptions::default()
        };
        in_a_log(states.to_vec(), |path| open(path, &options))
    };
    let refused = opened(&unseen, Wanted::Positions)
        .expect_err("there are none")
        .to_string();
    assert!(
        refused.contains("no sample of the tracker") && refused.contains("wormd explain --current"),
        "{refused}"
    );
    for wanted in [Wanted::PositionsOrMotor { window_s }, Wanted::Motor { window_s }] {
        let recording = opened(&unseen, wanted).expect("the motor is there");
        assert!(!recording.has_positions() && recording.cells() == 4, "{wanted:?}");
        assert!((900..=996).contains(&recording.samples()), "{}", recording.samples());
        let phase = recording.gait_phase.expect("is recorded");
        let motor = recording.motor.expect("is recorded");
        for (phase, current_a) in phase.iter().zip(&motor.current_a) {
            // A window without one of its two readings is a quarter of a window off.
            assert!(
                current_a.is_nan() || (current_a - phase).abs() < 2e-3,
                "{current_a} at {phase}"
            );
        }
        let unread = motor.current_a.iter().filter(|current_a| current_a.is_nan());
        assert!(unread.count() < 100);
    }
    let recording = opened(&seen, Wanted::PositionsOrMotor { window_s }).expect("a recording");
    assert!(recording.has_positions() && recording.samples() == 996);
    assert!(
        !opened(&seen, Wanted::Motor { window_s })
            .expect("a recording")
            .has_positions()
    );
}

#[test]
fn a_failed_motor_reading_does_not_distort_the_gait_phase() {
    let (_, mut states) = states(8.3);
    // Ticks without a reading repeat what was last read, singly and three in a row.
    for tick in (40..1600).filter(|tick| tick % 7 == 3 || tick % 50 < 3) {
        let before = states[tick - 1];
        let state = &mut states[tick];
        (state.motor_angle_rad, state.phase, state.motor_is_new) = (before.motor_angle_rad, before.phase, 0);
    }
    let recording = read_states(states).expect("a recording");
    let phase = recording.gait_phase.expect("is recorded");
    assert!(phase.is_sorted(), "the cam never turned back");
    for (&time_s, &phase) in recording.time_s.iter().zip(&phase) {
        assert!(
            (phase - 0.5 * (time_s - 77.0)).abs() < 6e-4,
            "phase {phase} at {time_s} s"
        );
    }
}

#[test]
fn the_longest_run_of_the_controller_is_taken() {
    let (_, first) = states(1.0);
    let (_, second) = states(2.0);
    let repeated = [&second[..200], &second[190..]].concat();
    let recording = read_states([first, repeated].concat()).expect("a recording");
    // Repeated ticks count as a restart too: the longest run has the last 210 ticks of the second.
    assert_eq!(recording.samples(), 126);
    assert!(recording.time_s.is_sorted_by(|before, after| before < after));
    assert!(
        recording.warnings[0].contains("the controller was started 3 times"),
        "{:?}",
        recording.warnings
    );
}

#[test]
fn a_log_without_samples_is_refused() {
    let (_, mut silent) = states(0.5);
    silent.iter_mut().for_each(|state| state.sample_is_new = 0);
    for (states, part) in [
        (Vec::new(), "channel /state: holds no message"),
        (silent, "holds no sample of the tracker"),
    ] {
        let error = read_states(states).expect_err(part).to_string();
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn a_recording_written_is_read_back() {
    let samples = 500;
    let series = |scale: f64| {
        (0..samples)
            .map(|sample| scale * (sample as f64).sqrt())
            .collect::<Vec<f64>>()
    };
    let mut recording = Recording {
        source: PathBuf::new(),
        cell_names: ["x1_m", "x2_m", "x3_m"].map(str::to_owned).to_vec(),
        time_s: (0..samples).map(|sample| -1.0 + sample as f64 / 120.0).collect(),
        position_m: vec![series(1e-2), series(2e-2), series(3e-2)],
        gait_phase: None,
        motor: None,
        warnings: Vec::new(),
        repairs: Vec::new(),
    };
    recording.position_m[1][7] = f64::NAN;
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("worm.mcap");
    let config = Config::default();
    for with_more in [false, true] {
        if with_more {
            recording.gait_phase = Some(series(0.1));
            recording.motor = Some(Motor {
                angle_rad: series(1.0),
                velocity_rad_s: series(2.0),
                current_a: series(3.0),
                voltage_v: series(4.0),
                duty: series(5.0),
                temperature_c: series(6.0),
            });
        }
        write(&recording, &config, Some("[worm]"), &path).expect("there is room");
        let read = read(&path).expect("a recording");
        assert_eq!(read.time_s, recording.time_s);
        assert_eq!(format!("{:?}", read.position_m), format!("{:?}", recording.position_m));
        assert_eq!(read.motor, recording.motor);
        assert_eq!(read.warnings, recording.warnings);
        let phases = read
            .gait_phase
            .iter()
            .flatten()
            .zip(recording.gait_phase.iter().flatten());
        assert_eq!(phases.clone().count(), if with_more { samples } else { 0 });
        for (read, written) in phases {
            // The capture's delay is known to the nanosecond.
            assert!((read - written).abs() < 1e-8, "{read} {written}");
        }
    }
}

/// The tracker is silent from a time on, until another; a gait cycle takes two seconds.
#[test]
fn what_a_tracker_that_died_did_not_see_is_told_and_not_proposed_to_be_bridged() {
    let opened = |from_s: f64, to_s: f64| {
        let (_, mut states) = states(8.3);
        let mut last = (0, f64::NAN);
        for (tick, state) in states.iter_mut().enumerate() {
            let time_s = tick as f64 / 200.0;
            if time_s < from_s {
                last = (state.sample, state.sample_time_s);
            } else if time_s < to_s {
                (state.sample, state.sample_time_s) = last;
                state.sample_is_new = 0;
            }
        }
        in_a_log(states, |path| open(path, &OpenOptions::default()))
    };
    let died = opened(3.0, 9.0).expect("a recording").warnings;
    let note = "nobody saw the 2 gait cycles after it: `wormd infer` and `wormd analyze --current=alone` have them";
    assert!(died.iter().any(|warning| warning.contains(note)), "{died:?}");
    let at_the_end = opened(8.0, 9.0).expect("a recording").warnings;
    assert!(at_the_end.is_empty(), "{at_the_end:?}");
    for (to_s, proposes_to_bridge) in [(3.4, true), (4.8, true), (5.2, false), (6.0, false)] {
        let refused = opened(3.0, to_s).expect_err("a gap").to_string();
        assert_eq!(refused.contains("give --max-gap"), proposes_to_bridge, "{refused}");
        assert_eq!(refused.contains("--current=alone"), !proposes_to_bridge, "{refused}");
        assert!(refused.contains("leave it out with --from or --to"), "{refused}");
    }
}
