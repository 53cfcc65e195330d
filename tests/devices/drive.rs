//! The drive stops the motor whatever ends it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};
use worm_estimator::config::Config;
use wormd::control::{Drive, DriveError, Service, link_settings};
use wormd::link::servo::{register, scale};
use wormd::link::virtual_worm::{Options, VirtualWorm};
use wormd::link::{Register, StartupError, Tty, WormBus};

/// Turns the cam until it is seen to turn, then panics with the drive in hand.
fn crawl_and_panic(port: &Path, config: &Config) {
    let settings = link_settings(config, 1_000_000).expect("valid IDs");
    let (mut drive, _, _) = Drive::open(port, settings).expect("the devices are ready");
    drive.serve(Service::Arm).expect("torque comes on");
    let begun = Instant::now();
    loop {
        let outcome = drive.exchange(100, Instant::now() + Duration::from_millis(20));
        let turns = outcome
            .servo
            .is_ok_and(|servo| servo.velocity_rad_s > 50.0 * scale::VELOCITY_RAD_S);
        assert!(!turns, "the panic that is asked for");
        assert!(
            begun.elapsed() < Duration::from_secs(20),
            "waited in vain for the cam to turn"
        );
    }
}

#[test]
fn a_panic_switches_torque_off() {
    let config = Config::default();
    let worm = VirtualWorm::spawn(&config, &Options::default()).expect("a virtual worm");
    let panic = catch_unwind(AssertUnwindSafe(|| crawl_and_panic(worm.path(), &config))).expect_err("panics");
    let message = panic.downcast_ref::<&str>().copied().unwrap_or_default();
    assert!(message.contains("is asked for"), "{message}");

    // Asked well before the servo's watchdog could have acted, and torque is not what the watchdog switches off.
    let (port, _) = Tty::open(worm.path(), 1_000_000).expect("the port is free again");
    let mut bus = WormBus::new(port);
    let servo = link_settings(&config, 1_000_000).expect("valid IDs").servo_id;
    let soon = || Instant::now() + Duration::from_secs(1);
    assert_eq!(bus.read_register(servo, register::TORQUE_ENABLE, soon()), Ok(0));
    assert_eq!(bus.read_register(servo, register::GOAL_VELOCITY, soon()), Ok(0));
    worm.stop().expect("the virtual worm ends");
}

/// Writes registers of the servo as another program did before.
fn spoil(port: &Path, registers: &[(Register, u32)]) {
    let (port, _) = Tty::open(port, 1_000_000).expect("the port is free");
    let mut bus = WormBus::new(port);
    let servo = link_settings(&Config::default(), 1_000_000)
        .expect("valid IDs")
        .servo_id;
    for &(register, value) in registers {
        bus.write_register(servo, register, value, Instant::now() + Duration::from_secs(1))
            .expect("written");
    }
}

/// Turns the cam of an armed drive with a positive goal until the servo has turned on by `counts`.
fn turn_by(drive: &mut Drive, counts: f64) {
    let begun = Instant::now();
    let mut first_rad = None;
    while begun.elapsed() < Duration::from_secs(20) {
        let outcome = drive.exchange(100, Instant::now() + Duration::from_millis(20));
        if let Ok(servo) = outcome.servo {
            let first_rad = *first_rad.get_or_insert(servo.position_rad);
            if servo.position_rad - first_rad > counts * scale::POSITION_RAD {
                return;
            }
        }
    }
    panic!("waited in vain for the cam to turn by {counts} counts");
}

#[test]
fn a_servo_that_was_left_in_reverse_turns_the_worm_forward() {
    let config = Config::default();
    let worm = VirtualWorm::spawn(&config, &Options::default()).expect("a virtual worm");
    spoil(
        worm.path(),
        &[
            (register::DRIVE_MODE, 1),
            (register::HOMING_OFFSET, 700),
            (register::PROFILE_ACCELERATION, 1),
        ],
    );
    let settings = link_settings(&config, 1_000_000).expect("valid IDs");
    let (mut drive, prepared, findings) = Drive::open(worm.path(), settings).expect("the devices are ready");
    assert!(prepared.servo_reading.position_rad.abs() < 10.0 * scale::POSITION_RAD);
    let named = ["drive mode", "homing offset", "profile acceleration"].map(|name| {
        let is_named = |what: &str| what.starts_with(name);
        findings
            .iter()
            .any(|finding| finding.corrected && is_named(&finding.what))
    });
    assert_eq!(named, [true; 3], "{findings:?}");
    drive.serve(Service::Arm).expect("torque comes on");
    turn_by(&mut drive, 300.0);
    drop(drive);
    let devices = worm.stop().expect("the virtual worm ends");
    let turned_rad = devices.plant().motor().angle_rad();
    assert!(turned_rad > 0.3, "{turned_rad} rad");
}

#[test]
fn a_blocked_motor_draws_no_more_than_the_current_limit() {
    for limit_a in [0.4, 1.0] {
        let mut config = Config::default();
        config.servo.current_limit_a = limit_a;
        let options = Options {
            faults: vec!["stall".parse().expect("a fault")],
            ..Options::default()
        };
        let worm = VirtualWorm::spawn(&config, &options).expect("a virtual worm");
        let settings = link_settings(&config, 1_000_000).expect("valid IDs");
        let (mut drive, _, _) = Drive::open(worm.path(), settings).expect("the devices are ready");
        drive.serve(Service::Arm).expect("torque comes on");
        let currents = (0..300).filter_map(|_| {
            let outcome = drive.exchange(100, Instant::now() + Duration::from_millis(20));
            std::thread::sleep(Duration::from_millis(1));
            outcome.servo.ok().map(|servo| servo.current_a)
        });
        let greatest_a = currents.fold(0.0, f64::max);
        assert!(
            (0.9 * limit_a..1.01 * limit_a).contains(&greatest_a),
            "{greatest_a} A of {limit_a} A"
        );
    }
}

#[test]
fn a_servo_whose_watchdog_is_known_not_to_stop_the_motor_is_not_armed() {
    let mut config = Config::default();
    let faults = vec!["watchdog-defect".parse().expect("a fault")];
    let options = Options {
        faults,
        ..Options::default()
    };
    let worm = VirtualWorm::spawn(&config, &options).expect("a virtual worm");
    let settings = link_settings(&config, 1_000_000).expect("valid IDs");
    let refused = Drive::open(worm.path(), settings).err();
    let unsafe_watchdog = |error: &DriveError| {
        matches!(
            error,
            DriveError::Startup {
                source: StartupError::UnsafeWatchdog { firmware: 51 },
                ..
            }
        )
    };
    assert!(refused.as_ref().is_some_and(unsafe_watchdog), "{refused:?}");
    config.servo.accept_unsafe_watchdog = true;
    let settings = link_settings(&config, 1_000_000).expect("valid IDs");
    let (mut drive, _, _) = Drive::open(worm.path(), settings).expect("accepted");
    drive.serve(Service::Arm).expect("torque comes on");
}

/// A link with a lasting name to the port of a virtual worm, which can be pulled and plugged in again.
struct Plug {
    folder: tempfile::TempDir,
}

impl Plug {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        Self { folder }
    }

    fn path(&self) -> std::path::PathBuf {
        self.folder.path().join("port")
    }

    fn plug_in(&self, worm: &VirtualWorm) {
        std::os::unix::fs::symlink(worm.path(), self.path()).expect("a link");
    }

    fn unplug(&self) {
        std::fs::remove_file(self.path()).expect("the link is there");
    }
}

#[test]
fn a_port_that_is_gone_is_closed_and_used_again_when_it_is_back() {
    let config = Config::default();
    let plug = Plug::new();
    let settings = || link_settings(&config, 1_000_000).expect("valid IDs");
    let spawn = || VirtualWorm::spawn(&config, &Options::default()).expect("a virtual worm");
    let worm = spawn();
    plug.plug_in(&worm);
    let (mut drive, _, _) = Drive::open(&plug.path(), settings()).expect("the devices are ready");
    drive.serve(Service::Arm).expect("torque comes on");
    turn_by(&mut drive, 50.0);

    plug.unplug();
    let old_path = worm.path().to_owned();
    worm.stop().expect("it ran");
    let soon = || Instant::now() + Duration::from_millis(20);
    let begun = Instant::now();
    while !drive.is_gone() {
        drive.exchange(100, soon());
        assert!(begun.elapsed() < Duration::from_secs(20), "the port never goes");
    }
    let refused = drive.serve(Service::Arm);
    assert!(matches!(refused, Err(DriveError::Gone { .. })), "{refused:?}");
    // The kernel gives the number of a terminal away again only when nobody holds it open.
    while std::fs::metadata(&old_path).is_ok() {
        assert!(begun.elapsed() < Duration::from_secs(20), "the port is still held open");
        std::thread::sleep(Duration::from_millis(5));
    }
    let asked = Instant::now();
    assert!(drive.exchange(0, soon()).is_disconnected());
    assert!(
        asked.elapsed() < Duration::from_millis(500),
        "a tick without a port waits for nothing"
    );

    let worm = spawn();
    plug.plug_in(&worm);
    let back = Instant::now();
    while drive.exchange(0, soon()).servo.is_err() {
        std::thread::sleep(Duration::from_millis(1));
        assert!(back.elapsed() < Duration::from_secs(20), "the port never comes back");
    }
    println!("readings {:?} after the port was back", back.elapsed());
    drive.serve(Service::Arm).expect("one reset is enough");
    turn_by(&mut drive, 50.0);
    drop(drive);
    worm.stop().expect("it ran");
}

#[test]
fn a_servo_that_restarts_shows_it_in_its_first_reading() {
    let mut config = Config::default();
    // A pause of a busy computer must not make it act.
    config.servo.watchdog_ms = 400;
    let options = Options {
        faults: vec!["reboot:off=0.05@0.3".parse().expect("a fault")],
        ..Options::default()
    };
    let worm = VirtualWorm::spawn(&config, &options).expect("a virtual worm");
    let settings = link_settings(&config, 1_000_000).expect("valid IDs");
    let (mut drive, _, _) = Drive::open(worm.path(), settings).expect("the devices are ready");
    drive.serve(Service::Arm).expect("torque comes on");
    let begun = Instant::now();
    loop {
        let outcome = drive.exchange(100, Instant::now() + Duration::from_millis(5));
        if let Ok(servo) = outcome.servo {
            // It had been set when torque came on.
            match servo.watchdog {
                20 => {}
                found => return assert_eq!((found, servo.current_a), (0, 0.0), "torque is off, and the watchdog"),
            }
        }
        assert!(begun.elapsed() < Duration::from_secs(20), "it never restarts");
    }
}
