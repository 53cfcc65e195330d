//! The trials of `wormd check`, which turn the cam of a virtual worm.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use worm_estimator::config::Config;
use wormd::control::{Drive, DriveError, link_settings};
use wormd::link::servo::register;
use wormd::link::virtual_worm::{Options, VirtualWorm};
use wormd::link::{EmergencyStopInput, StopInputs, TrialError, Tty, WormBus};

fn spawn(config: &Config, faults: &[&str]) -> VirtualWorm {
    let options = Options {
        faults: faults.iter().map(|text| text.parse().expect("a fault")).collect(),
        ..Options::default()
    };
    VirtualWorm::spawn(config, &options).expect("a virtual worm")
}

/// With a watchdog that leaves a busy computer time to talk.
fn patient() -> Config {
    let mut config = Config::default();
    config.servo.watchdog_ms = 400;
    config.servo.accept_unsafe_watchdog = true;
    config
}

fn open(path: &Path, config: &Config) -> Drive {
    let settings = link_settings(config, 1_000_000).expect("valid IDs");
    Drive::open(path, settings).expect("the devices are ready").0
}

fn torque_is_off(path: &Path, config: &Config) -> bool {
    let mut bus = WormBus::new(Tty::open(path, 1_000_000).expect("the port is free").0);
    let servo = link_settings(config, 1_000_000).expect("valid IDs").servo_id;
    let deadline = Instant::now() + Duration::from_secs(1);
    bus.read_register(servo, register::TORQUE_ENABLE, deadline) == Ok(0)
}

/// Nothing ends the trial.
fn unattended() -> StopInputs<'static> {
    StopInputs::new(&[], None)
}

#[test]
fn watchdog_trial_tells_a_servo_that_stops_from_one_that_does_not() {
    let config = patient();
    for (faults, passes) in [(&[][..], true), (&["watchdog-defect:firmware=53"][..], false)] {
        let worm = spawn(&config, faults);
        let mut drive = open(worm.path(), &config);
        let trial = drive.try_watchdog(&mut unattended()).expect("a trial");
        assert!(trial.latched, "{trial:?}");
        assert_eq!((trial.is_passed(), trial.stopped), (passes, passes), "{trial:?}");
        if passes {
            assert!((0.3..0.46).contains(&trial.turned_for_s), "{trial:?}");
        } else {
            assert!(trial.turned_for_s > 0.45, "{trial:?}");
        }
        drop(drive);
        assert!(torque_is_off(worm.path(), &config));
        worm.stop().expect("it ran");
    }
}

#[test]
fn motion_trial_turns_there_and_back_and_sees_the_direction() {
    for positive_is_forward in [true, false] {
        let config = patient();
        let worm = spawn(&config, &[]); // positive is forward
        let mut drive = open(worm.path(), &config);
        let trial = drive
            .try_motion(positive_is_forward, &mut unattended())
            .expect("a trial");
        let sixteenth = std::f64::consts::TAU / 16.0;
        assert!((sixteenth..1.5 * sixteenth).contains(&trial.there_rad), "{trial:?}");
        assert!((sixteenth..1.5 * sixteenth).contains(&trial.back_rad), "{trial:?}");
        assert!(trial.greatest_a < 0.7, "{trial:?}");
        let moved_m = trial.cell_moved_m.expect("cells that are seen");
        assert_eq!(moved_m > 0.0, positive_is_forward, "{trial:?}");
        assert!(moved_m.abs() > 5e-4, "{trial:?}");
        drop(drive);
        assert!(torque_is_off(worm.path(), &config));
        let turned_rad = worm.stop().expect("it ran").plant().motor().angle_rad();
        assert!(turned_rad.abs() < 0.15, "{turned_rad} rad from where it began");
    }
}

#[test]
fn motion_trial_of_a_blocked_cam_fails_with_little_current() {
    let config = patient();
    let worm = spawn(&config, &["stall"]);
    let mut drive = open(worm.path(), &config);
    let failed = drive.try_motion(true, &mut unattended()).expect_err("it cannot turn");
    let cannot_turn =
        matches!(&failed, DriveError::Trial { source, .. } if matches!(**source, TrialError::NoMotion { .. }));
    assert!(cannot_turn, "{failed}");
    drop(drive);
    assert!(torque_is_off(worm.path(), &config));
}

/// Makes one trial on a bus whose end switches nothing off; returns why it ended, and makes sure that the servo stands without torque.
fn ended_trial(config: &Config, worm: VirtualWorm, is_motion: bool, stops: &mut StopInputs<'_>) -> TrialError {
    let settings = link_settings(config, 1_000_000).expect("valid IDs");
    let mut bus = WormBus::new(Tty::open(worm.path(), 1_000_000).expect("the port is free").0);
    let ended = if is_motion {
        bus.try_motion(&settings, 1.0, stops).expect_err("it ends early")
    } else {
        bus.try_watchdog(&settings, stops).expect_err("it ends early")
    };
    let mut read = |register| {
        let deadline = Instant::now() + Duration::from_secs(1);
        let value = bus.read_register(settings.servo_id, register, deadline);
        value.expect("an answer")
    };
    assert_eq!(read(register::TORQUE_ENABLE), 0, "{ended}");
    // It coasts: without torque a rotor runs out over some tenths of a second.
    let patience = Instant::now() + Duration::from_secs(3);
    let mut position = read(register::PRESENT_POSITION);
    loop {
        std::thread::sleep(Duration::from_millis(200));
        let later = read(register::PRESENT_POSITION);
        if later == position {
            break;
        }
        assert!(Instant::now() < patience, "it turns on: {ended}");
        position = later;
    }
    worm.stop().expect("it ran");
    ended
}

#[test]
fn a_signal_in_the_middle_of_a_trial_leaves_a_servo_without_torque() {
    let config = patient();
    // The watchdog trial is met while the cam turns, and in the silence.
    for (is_motion, after_ms) in [(true, 0), (true, 500), (false, 500), (false, 1_200)] {
        // Only torque off stops this one: its watchdog does nothing.
        let worm = spawn(&config, &["watchdog-defect:firmware=53"]);
        let signals = [Arc::new(AtomicBool::new(false))];
        let signal = Arc::clone(&signals[0]);
        let sender = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(after_ms));
            signal.store(true, Ordering::Relaxed);
        });
        let mut stops = StopInputs::new(&signals, None);
        let ended = ended_trial(&config, worm, is_motion, &mut stops);
        assert_eq!(ended, TrialError::Signal, "after {after_ms} ms");
        sender.join().expect("the flag is set");
    }
}

#[test]
fn a_pressed_emergency_stop_ends_a_trial() {
    let text = "[servo]\nwatchdog_ms = 400\n[emergency_stop]\nsource = \"tracker\"\n";
    let config = Config::from_toml(text, Path::new("test")).expect("a configuration");
    // Pressed from the beginning, and once the cam turns.
    for fault in ["emergency-stop", "emergency-stop@0.2"] {
        for is_motion in [true, false] {
            let worm = spawn(&config, &[fault]);
            let input = EmergencyStopInput::open(&config).expect("it needs nothing");
            let ended = ended_trial(&config, worm, is_motion, &mut StopInputs::new(&[], input));
            assert_eq!(ended, TrialError::EmergencyStop, "{fault}");
        }
    }
}

#[test]
fn a_hardware_error_ends_a_trial() {
    let config = patient();
    let worm = spawn(&config, &["hardware-error:bits=1@0.2"]);
    let ended = ended_trial(&config, worm, true, &mut unattended());
    assert_eq!(ended, TrialError::Alert);
}
