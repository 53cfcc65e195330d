//! The drive stops the motor whatever ends it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};
use worm_estimator::config::Config;
use wormd::control::{Drive, Service, link_settings};
use wormd::link::servo::{register, scale};
use wormd::link::virtual_worm::{Options, VirtualWorm};
use wormd::link::{Tty, WormBus};

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
