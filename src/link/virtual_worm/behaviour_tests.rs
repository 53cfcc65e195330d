//! What the devices do: modes, watchdog, shutdown, faults.

use super::device_harness::*;
use super::{Devices, Options};
use crate::link::Register;
use crate::link::servo::{ServoReading, WATCHDOG_LATCHED, register, scale};
use crate::link::tracker::TrackerReading;
use dynamixel_bus::packet::{BackupAction, Instruction};
use worm_estimator::config::Config;

#[test]
fn blocks_of_a_tick_say_what_the_plant_does() {
    let mut harness = harness(&[]);
    harness.crawl(105);
    harness.wait(1.0);
    let (_, block) = harness.ask_one(
        SERVO,
        Instruction::Read {
            address: 98,
            length: 49,
        },
    );
    let block: [u8; 49] = block.try_into().expect("49 bytes");
    let reading = ServoReading::from_block(&block, false);
    let plant = harness.devices.plant();
    assert!((reading.position_rad - plant.motor().angle_rad()).abs() < 0.01);
    assert!((reading.velocity_rad_s - 2.518).abs() < 0.03, "{reading:?}");
    assert!((reading.current_a - plant.motor().current_a()).abs() < 0.02);
    assert!((reading.voltage_v - 5.0).abs() < 0.11 && reading.moving && reading.duty > 0.2);
    let (_, block) = harness.ask_one(
        TRACKER,
        Instruction::Read {
            address: 128,
            length: 27,
        },
    );
    let seen = TrackerReading::from_block(&block).expect("a block");
    assert_eq!((seen.cell_count, seen.valid), (4, 0b1111));
    for (seen_m, true_m) in seen
        .positions_m
        .iter()
        .zip(harness.devices.plant().body().positions_m())
    {
        assert!((seen_m - true_m).abs() < 1e-3);
    }
    assert_eq!(harness.devices.crawl_began_s().map(|s| s < 0.01), Some(true));
}

#[test]
fn positive_may_be_backward_and_home_anywhere() {
    let mut config = Config::default();
    config.servo.positive_is_forward = false;
    config.servo.home_position = 5000;
    let mut harness = harness_with(&config, &[]);
    assert_eq!(harness.read(register::PRESENT_POSITION), 5000 - 4096);
    harness.crawl(-100);
    harness.wait(1.0);
    assert!(harness.devices.plant().motor().velocity_rad_per_s() > 2.0, "forward");
    assert!(harness.read(register::PRESENT_POSITION) < 0);
    assert!(harness.read(register::PRESENT_CURRENT) < 0);
}

#[test]
fn extended_position_mode_arrives() {
    let mut harness = harness(&[]);
    assert_eq!(harness.write(register::OPERATING_MODE, 4), 0);
    assert_eq!(harness.write(register::TORQUE_ENABLE, 1), 0);
    assert_eq!(harness.write(Register::new(116, 4, "goal position"), 6000), 0);
    harness.wait(3.0);
    assert!((harness.read(register::PRESENT_POSITION) - 6000).abs() < 20);
    assert_eq!(harness.write(register::TORQUE_ENABLE, 0), 0);
    // Without torque the worm's tips turn the cam until friction holds it.
    harness.wait(1.0);
    let rested = harness.read(register::PRESENT_POSITION);
    assert_eq!(harness.ask_one(SERVO, Instruction::ClearMultiTurn).0, 0);
    assert_eq!(harness.read(register::PRESENT_POSITION), rested - 4096);
}

#[test]
fn watchdog_stops_the_motor_and_locks_the_goal_until_it_is_cleared() {
    let mut harness = harness(&[]);
    harness.crawl(105);
    assert_eq!(harness.write(register::BUS_WATCHDOG, 5), 0); // 100 ms
    for _ in 0..100 {
        harness.wait(0.01);
        harness.ask(TRACKER, Instruction::Ping); // any instruction packet on the bus will do
    }
    assert_eq!(harness.read(register::BUS_WATCHDOG), 5);
    harness.wait(0.09);
    assert!(harness.devices.plant().motor().velocity_rad_per_s() > 2.0);
    harness.wait(0.2);
    assert_eq!(harness.devices.plant().motor().velocity_rad_per_s(), 0.0);
    assert_eq!(harness.read(register::BUS_WATCHDOG) as u8, WATCHDOG_LATCHED);
    assert_eq!(harness.write(register::GOAL_VELOCITY, 105), 4);
    assert_eq!(harness.write(register::BUS_WATCHDOG, 5), 4);
    assert_eq!(harness.write(register::BUS_WATCHDOG, 0), 0);
    harness.wait(0.2);
    assert_eq!(
        harness.devices.plant().motor().velocity_rad_per_s(),
        0.0,
        "it waits for a new goal"
    );
    assert_eq!(harness.write(register::GOAL_VELOCITY, 105), 0);
    harness.wait(0.2);
    assert!(harness.devices.plant().motor().velocity_rad_per_s() > 2.0);
}

#[test]
fn watchdog_bites_only_while_torque_is_on() {
    let mut harness = harness(&[]);
    assert_eq!(harness.write(register::BUS_WATCHDOG, 1), 0);
    harness.wait(1.0);
    assert_eq!(harness.read(register::BUS_WATCHDOG), 1);
}

#[test]
fn hardware_error_raises_the_alert_and_shuts_down_until_a_reboot() {
    let mut harness = harness(&["hardware-error:bits=0x20@1..2"]);
    harness.crawl(105);
    harness.wait(0.9);
    assert_eq!(harness.ask_one(SERVO, Instruction::Ping).0, 0);
    harness.wait(0.2);
    assert_eq!(harness.ask_one(SERVO, Instruction::Ping).0, 0x80);
    assert_eq!(harness.read(register::HARDWARE_ERROR_STATUS), 0x20);
    assert_eq!(harness.read(register::TORQUE_ENABLE), 0);
    assert_eq!(harness.write(register::TORQUE_ENABLE, 1), 0x80 | 1);
    harness.wait(1.0);
    assert_eq!(harness.ask_one(SERVO, Instruction::Reboot).0, 0x80);
    assert_eq!(harness.ask(SERVO, Instruction::Ping), [], "it starts");
    harness.wait(0.2);
    assert_eq!(harness.ask_one(SERVO, Instruction::Ping).0, 0);
    assert_eq!(harness.write(register::TORQUE_ENABLE, 1), 0);
}

#[test]
fn heat_stall_and_weak_supply_are_hardware_errors() {
    for (fault, bits) in [
        ("overheat:ambient=90@0.5", 4),
        ("stall@0.5", 0x20),
        ("sag:volts=2@0.5", 1),
    ] {
        let mut harness = harness(&[fault]);
        harness.crawl(105);
        harness.wait(5.0);
        assert_eq!(harness.read(register::HARDWARE_ERROR_STATUS), bits, "{fault}");
    }
}

#[test]
fn brownout_loses_torque_goal_watchdog_and_turns() {
    let mut harness = harness(&["reboot:off=0.2@5"]);
    harness.crawl(105);
    assert_eq!(harness.write(register::BUS_WATCHDOG, 127), 0);
    for _ in 0..54 {
        harness.wait(0.1);
        harness.ask(TRACKER, Instruction::Ping);
    }
    let counts = [register::TORQUE_ENABLE, register::GOAL_VELOCITY, register::BUS_WATCHDOG].map(|r| harness.read(r));
    assert_eq!(counts, [0, 0, 0]);
    assert_eq!(harness.read(register::OPERATING_MODE), 1, "EEPROM is kept");
    let position = harness.read(register::PRESENT_POSITION);
    assert!((0..4096).contains(&position), "{position}");
    assert!(harness.devices.plant().motor().angle_rad() > 2.0 * std::f64::consts::PI);
}

#[test]
fn empty_battery_silences_the_servo() {
    let mut config = Config::default();
    config.battery = Some(worm_estimator::config::Battery {
        capacity_j: 9000.0,
        full_v: 5.6,
        empty_v: 4.0,
        internal_resistance_ohm: 0.2,
        hotel_power_w: 0.5,
        reserve_share: 0.1,
        ..worm_estimator::config::Battery::default()
    });
    let mut harness = harness_with(&config, &["battery:charge=0.0002@1"]);
    harness.crawl(105);
    harness.wait(0.9);
    assert_eq!(harness.ask(SERVO, Instruction::Ping).len(), 1);
    harness.wait(5.0);
    assert_eq!(harness.ask(SERVO, Instruction::Ping), []);
    assert_eq!(
        harness.ask(TRACKER, Instruction::Ping).len(),
        1,
        "the tracker has its own supply"
    );
}

#[test]
fn faults_of_the_line() {
    let answered = |fault: &str| {
        let mut harness = harness(&[fault]);
        (0..400)
            .filter(|_| harness.ask(SERVO, Instruction::Ping).len() == 1)
            .count()
    };
    assert!((340..380).contains(&answered("drop:share=0.1")));
    assert!((340..380).contains(&answered("corrupt:share=0.1")));
    assert_eq!(answered("silence:device=servo"), 0);
    let mut harness = harness(&["delay:ms=3"]);
    assert_eq!(harness.ask(SERVO, Instruction::Ping), []);
    harness.wait(0.002);
    let mut late = Vec::new();
    harness.devices.take_due(harness.now_s, &mut late);
    assert_eq!(statuses(&late).len(), 1);
}

#[test]
fn faults_of_sight_and_identity() {
    let mut harness = harness(&["blind:cell=3", "wrong-model:number=1190"]);
    assert_eq!(harness.ask_one(SERVO, Instruction::Ping).1[..2], 1190u16.to_le_bytes());
    harness.wait(0.1);
    assert_eq!(
        harness
            .ask_one(
                TRACKER,
                Instruction::Read {
                    address: 137,
                    length: 2
                }
            )
            .1,
        [0b1011, 0]
    );
}

#[test]
fn faults_that_do_not_fit_the_worm_are_refused() {
    for (fault, expected) in [
        ("jam:cell=5", "the fault jam names cell 5, but the worm has 4 cells"),
        ("battery:charge=0.1", "the fault battery needs a battery"),
    ] {
        let options = Options {
            faults: vec![fault.parse().expect("a fault")],
            ..Options::default()
        };
        let error = Devices::new(&Config::default(), &options).expect_err(fault).to_string();
        assert!(error.starts_with(expected), "{error}");
    }
}

#[test]
fn stall_at_a_time_counts_from_the_crawl() {
    let mut harness = harness(&["stall@1"]);
    harness.wait(3.0);
    harness.crawl(105);
    harness.wait(0.9);
    assert!(harness.devices.plant().motor().velocity_rad_per_s() > 2.0);
    harness.wait(0.2);
    assert_eq!(harness.devices.plant().motor().velocity_rad_per_s(), 0.0);
    assert!(scale::CURRENT_A * harness.read(register::PRESENT_CURRENT) as f64 > 1.0);
}

#[test]
fn settings_of_an_earlier_use_act_as_the_manual_says() {
    let mut harness = harness(&[]);
    // A ramp: 3 counts of 214.577 rev/min² are 1.12 rad/s².
    assert_eq!(harness.write(register::PROFILE_ACCELERATION, 3), 0);
    harness.crawl(105);
    harness.wait(1.0);
    let velocity_rad_s = harness.devices.plant().motor().velocity_rad_per_s();
    assert!((velocity_rad_s - 1.12).abs() < 0.1, "{velocity_rad_s}");
    // A PWM limit is all that the motor gets.
    assert_eq!(harness.write(register::TORQUE_ENABLE, 0), 0);
    assert_eq!(harness.write(register::PWM_LIMIT, 100), 0);
    assert_eq!(harness.write(register::PROFILE_ACCELERATION, 0), 0);
    harness.crawl(105);
    harness.wait(0.5);
    assert!((harness.devices.plant().motor().duty() - 0.113).abs() < 1e-3);
    // A goal switches torque on.
    assert_eq!(harness.write(register::TORQUE_ENABLE, 0), 0);
    assert_eq!(harness.write(register::DRIVE_MODE, 8), 0);
    assert_eq!(harness.write(register::GOAL_VELOCITY, 10), 0);
    assert_eq!(harness.read(register::TORQUE_ENABLE), 1);
    // Torque and the profile of the backup come back with the power.
    assert_eq!(harness.write(register::TORQUE_ENABLE, 0), 0);
    assert_eq!(harness.write(register::STARTUP_CONFIGURATION, 3), 0);
    assert_eq!(harness.write(register::PROFILE_VELOCITY, 77), 0);
    let store = Instruction::ControlTableBackup(BackupAction::Store);
    assert_eq!(harness.ask_one(SERVO, store).0, 0);
    assert_eq!(harness.ask_one(SERVO, Instruction::Reboot).0, 0);
    harness.wait(0.3);
    assert_eq!(harness.read(register::TORQUE_ENABLE), 1);
    assert_eq!(harness.read(register::PROFILE_VELOCITY), 77);
}

#[test]
fn watchdog_with_the_defect_latches_and_the_motor_turns_on() {
    for (faults, turns_on) in [(&[][..], false), (&["watchdog-defect"][..], true)] {
        let mut harness = harness(faults);
        assert_eq!(harness.write(register::BUS_WATCHDOG, 5), 0);
        harness.crawl(105);
        harness.wait(0.5);
        assert_eq!(harness.read(register::BUS_WATCHDOG) as u8, WATCHDOG_LATCHED);
        let turns = harness.devices.plant().motor().velocity_rad_per_s() > 2.0;
        assert_eq!(turns, turns_on);
        let firmware = if turns_on { 51 } else { 53 };
        assert_eq!(harness.read(register::FIRMWARE_VERSION), firmware);
    }
}
