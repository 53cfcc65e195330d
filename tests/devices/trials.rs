//! The trials of `wormd check`, which turn the cam of a virtual worm.

use std::path::Path;
use worm_estimator::config::Config;
use wormd::control::{Drive, DriveError, link_settings};
use wormd::link::servo::register;
use wormd::link::virtual_worm::{Options, VirtualWorm};
use wormd::link::{TrialError, Tty, WormBus};

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
    let deadline = std::time::Instant::now() + std::time::Duration::from_secs(1);
    bus.read_register(servo, register::TORQUE_ENABLE, deadline) == Ok(0)
}

#[test]
fn watchdog_trial_tells_a_servo_that_stops_from_one_that_does_not() {
    let config = patient();
    for (faults, passes) in [(&[][..], true), (&["watchdog-defect:firmware=53"][..], false)] {
        let worm = spawn(&config, faults);
        let mut drive = open(worm.path(), &config);
        let trial = drive.try_watchdog().expect("a trial");
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
        let trial = drive.try_motion(positive_is_forward).expect("a trial");
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
    let failed = drive.try_motion(true).expect_err("it cannot turn");
    let cannot_turn =
        matches!(&failed, DriveError::Trial { source, .. } if matches!(**source, TrialError::NoMotion { .. }));
    assert!(cannot_turn, "{failed}");
    drop(drive);
    assert!(torque_is_off(worm.path(), &config));
}
