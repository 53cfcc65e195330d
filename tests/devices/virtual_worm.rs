//! The virtual worm in real time, as the controller's own link sees it through a pseudo-terminal.

use dynamixel_bus::packet::DeviceId;
use std::io::{Read, Write};
use std::path::Path;
use std::time::{Duration, Instant};
use worm_estimator::config::Config;
use wormd::link::virtual_worm::{Options, VirtualWorm};
use wormd::link::{LinkSettings, ReadMode, ReadPlan, StartupError, TrackerSettings, Tty, WormBus, prepare, tracker};

const BAUD: u32 = 1_000_000;

fn spawn(faults: &[&str], baud: Option<u32>) -> VirtualWorm {
    let faults = faults.iter().map(|text| text.parse().expect("a fault")).collect();
    let options = Options {
        faults,
        baud,
        ..Options::default()
    };
    VirtualWorm::spawn(&Config::default(), &options).expect("a virtual worm")
}

fn tracker_settings(emergency_stop_mask: Option<u8>) -> TrackerSettings {
    TrackerSettings {
        id: DeviceId::new(100).expect("an ID"),
        model: tracker::MODEL,
        cells: 4,
        emergency_stop_mask,
        pitch: false,
        may_be_silent: false,
    }
}

fn settings() -> LinkSettings {
    LinkSettings {
        baud: BAUD,
        servo_id: DeviceId::new(1).expect("an ID"),
        servo_model: 1200,
        tracker: Some(tracker_settings(None)),
        read: ReadMode::Auto,
        watchdog_ms: 100,
        current_limit_a: 1.0,
        winding_resistance_ohm: 3.4,
        velocity_limit_rad_s: 6.0,
        temperature_limit_c: 70.0,
        accept_unsafe_watchdog: false,
    }
}

fn open(path: &Path, baud: u32) -> WormBus<Tty> {
    WormBus::new(Tty::open(path, baud).expect("a port").0)
}

/// A whole run of a controller: prepare, arm, crawl at 1 kHz, and compare the readings with the ground truth.
#[test]
fn link_and_virtual_worm_understand_each_other() {
    let worm = spawn(&[], None);
    let mut bus = open(worm.path(), BAUD);
    let mut findings = Vec::new();
    let settings = LinkSettings {
        watchdog_ms: 2540, // a pause of this computer must not stop the motor
        ..settings()
    };
    let prepared = prepare(&mut bus, &settings, &mut findings).expect("a worm that is ready");
    assert_eq!(prepared.plan.read, ReadPlan::FastBulk);
    assert!(findings.iter().all(|finding| finding.corrected), "{findings:?}");
    bus.set_torque(prepared.plan.servo, true).expect("torque");
    let mut took_us = Vec::new();
    let mut lost = 0;
    let (mut first, mut last) = (None, None);
    let began = Instant::now();
    let ticks = 1500;
    for tick in 0..ticks {
        let due = began + Duration::from_millis(tick);
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        let asked = Instant::now();
        let outcome = bus.exchange(&prepared.plan, 2.5, asked + Duration::from_millis(5));
        took_us.push(asked.elapsed().as_micros());
        lost += outcome.lost;
        last = outcome.servo.ok().or(last);
        first = first.or(last);
    }
    took_us.sort_unstable();
    let fraction = |fraction: f64| took_us[(fraction * (took_us.len() - 1) as f64) as usize];
    println!(
        "exchange at 1 kHz: median {} us, 99 % {} us, worst {} us",
        fraction(0.5),
        fraction(0.99),
        fraction(1.0)
    );
    assert_eq!(lost, 0, "each question is answered, late at worst");
    let (began, seen) = (first.expect("a reading"), last.expect("a reading"));
    let motor_s = f64::from(seen.realtime_tick_ms.wrapping_sub(began.realtime_tick_ms) % 32_768) * 1e-3;
    let turned_rad = seen.position_rad - began.position_rad;
    assert!(
        (turned_rad - 2.5 * motor_s).abs() < 0.2,
        "{turned_rad} rad in {motor_s} s of the servo's time at 2.5 rad/s"
    );
    drop(bus);
    let devices = worm.stop().expect("it ran");
    let turned_rad = devices.plant().motor().angle_rad();
    assert!(
        (seen.position_rad - turned_rad).abs() < 0.5,
        "{} of {turned_rad}",
        seen.position_rad
    );
    assert!(devices.report().total.electrical_j > 0.2);
}

#[test]
fn peers_may_come_and_go() {
    let worm = spawn(&[], None);
    for _ in 0..50 {
        let mut bus = open(worm.path(), BAUD);
        prepare(&mut bus, &settings(), &mut Vec::new()).expect("a worm that is ready");
    }
    worm.stop().expect("it ran");
}

#[test]
fn babble_and_silence_are_survived() {
    let worm = spawn(&[], None);
    {
        let mut file = std::fs::OpenOptions::new()
            .read(true)
            .write(true)
            .open(worm.path())
            .expect("a port");
        let noise: Vec<u8> = (0..20_000u32).map(|byte| (byte * 7 + byte / 255) as u8).collect();
        for chunk in noise.chunks(500) {
            file.write_all(chunk).expect("sent");
        }
        // Pings whose answers are not read.
        let ping = [0xFF, 0xFF, 0xFD, 0, 1, 3, 0, 1, 0x19, 0x4E];
        for _ in 0..5000 {
            file.write_all(&ping).expect("sent");
        }
        let mut some = [0; 14];
        file.read_exact(&mut some).expect("answers");
    }
    let mut bus = open(worm.path(), BAUD);
    prepare(&mut bus, &settings(), &mut Vec::new()).expect("a worm that is ready");
    worm.stop().expect("it ran");
}

#[test]
fn strict_baud_rate_is_heard_only_at_that_rate() {
    let worm = spawn(&[], Some(57_600));
    let mut bus = open(worm.path(), BAUD);
    let refused = prepare(&mut bus, &settings(), &mut Vec::new());
    assert!(
        matches!(refused, Err(StartupError::OtherBaudRate { found: 57_600, .. })),
        "{refused:?}"
    );
    drop(bus);
    let mut bus = open(worm.path(), 57_600);
    let settings = LinkSettings {
        baud: 57_600,
        ..settings()
    };
    prepare(&mut bus, &settings, &mut Vec::new()).expect("a worm that is ready");
    drop(bus);
    worm.stop().expect("it ran");
}

#[test]
fn faults_reach_the_link() {
    let worm = spawn(&["wrong-model:number=1190"], None);
    let refused = prepare(&mut open(worm.path(), BAUD), &settings(), &mut Vec::new());
    assert!(
        matches!(refused, Err(StartupError::WrongModel { found: 1190, .. })),
        "{refused:?}"
    );
    worm.stop().expect("it ran");
    let worm = spawn(&["silence:device=tracker"], None);
    let refused = prepare(&mut open(worm.path(), BAUD), &settings(), &mut Vec::new());
    assert!(
        matches!(refused, Err(StartupError::Silent { device: "tracker", .. })),
        "{refused:?}"
    );
    worm.stop().expect("it ran");
}

#[test]
fn emergency_stop_comes_with_each_reading_of_the_tracker() {
    for read in [ReadPlan::FastBulk, ReadPlan::Bulk, ReadPlan::Separate] {
        for (bits, pressed) in [(2, true), (5, false)] {
            let worm = spawn(&[&format!("emergency-stop:bits={bits}@0.2")], None);
            let mut bus = open(worm.path(), BAUD);
            let settings = LinkSettings {
                read: ReadMode::Always(read),
                tracker: Some(tracker_settings(Some(2))),
                watchdog_ms: 2540,
                ..settings()
            };
            let prepared = prepare(&mut bus, &settings, &mut Vec::new()).expect("a worm that is ready");
            bus.set_torque(prepared.plan.servo, true).expect("torque");
            let began = Instant::now();
            let mut seen = Vec::new();
            while began.elapsed() < Duration::from_millis(500) {
                let outcome = bus.exchange(&prepared.plan, 2.5, Instant::now() + Duration::from_millis(50));
                assert_eq!(outcome.emergency_stop.is_some(), outcome.tracker.is_ok());
                if let (Some(pressed), Ok(tracker)) = (outcome.emergency_stop, outcome.tracker) {
                    assert_eq!((tracker.cell_count, tracker.valid), (4, 0b1111));
                    seen.push(pressed);
                }
            }
            assert_eq!((seen.first(), seen.last()), (Some(&false), Some(&pressed)), "{read:?}");
            worm.stop().expect("it ran");
        }
    }
}
