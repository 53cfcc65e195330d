//! The three processes of a worm with a real pseudo-terminal, real topics and real signals. They pause together for 20 to 300 ms about
//! once a second, except in the tests of the latency benchmark, which measures the computer.
//!
//! These tests wait for conditions with a generous bound; they check what happens, never how fast a shared machine is.

mod any_order;
mod attending;
mod black_box;
mod calibration;
mod explaining;
mod faulting;
mod frozen_relay;
mod inferring;
mod kills;
mod latency;
mod leaks;
mod leaving;
mod process;
mod python_package;
mod recording;
mod recording_stops;
mod service;
mod stopping;
mod trips;
mod watching;
mod without_tracker;
mod worm;

use process::{Process, wait_for};
use std::time::Duration;
use testkit::process_pauses::Pause;
use worm::{Worm, late_ticks, soon};
use worm_estimator::message::{AlarmKind, CommandKind, CommandOutcome, Fault, Mode};
use wormd::link::servo::{WATCHDOG_LATCHED, register};

/// Longest wait for anything that a worm does.
const PATIENCE: Duration = Duration::from_secs(20);

/// A pause loses no gait cycle and no tick, and gives a healthy worm no fault and no alarm.
fn assert_main_job(worm: &Worm) {
    let output = worm.wormd(&["up", "--json", "--duration", "12"]).output();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}\n{error}", output.status);
    let summary: serde_json::Value =
        serde_json::from_slice(&output.stdout).expect("standard output is one JSON object");
    let number = |value: &serde_json::Value| value.as_f64().unwrap_or(f64::NAN);

    assert_eq!(summary["samples_lost"], 0);
    assert_eq!(
        (&summary["mode"], &summary["fault"]),
        (&"crawling".into(), &"none".into())
    );
    assert_eq!(summary["alarms"], serde_json::json!([]), "no alarm on a healthy worm");
    let timing = &summary["timing"];
    let (duration_s, paused_s) = (
        number(&summary["duration_s"]),
        number(&timing["host_pauses"]["total_s"]),
    );
    let deadlines = number(&summary["ticks"]) + number(&summary["overruns"]);
    let min_hz = number(&timing["rate_hz"]).min(1000.0);
    assert!(
        (0.97 * min_hz * duration_s..1030.0 * duration_s).contains(&deadlines),
        "{duration_s} s at {min_hz} Hz have {deadlines} deadlines"
    );

    let cycles = summary["cycles"].as_array().expect("a list");
    let max_cycles = duration_s / 2.5;
    assert!(
        (max_cycles - paused_s / 2.5 - 1.5..=max_cycles).contains(&(cycles.len() as f64)),
        "{} cycles of 2.5 s in {duration_s} s, {paused_s} s of them paused",
        cycles.len()
    );
    for cycle in cycles.iter().filter(|cycle| cycle["settled"] == true) {
        let (advance_mm, loss_mj) = (number(&cycle["advance_m"]) * 1e3, number(&cycle["energy_loss_j"]) * 1e3);
        assert!((advance_mm - 6.833).abs() < 0.25, "advance {advance_mm} mm");
        assert!(
            (loss_mj / 46.88 - 1.0).abs() < 0.03,
            "energy {loss_mj} mJ, with 1 % scatter of the friction"
        );
        let electrical_mj = number(&cycle["energy_electrical_j"]) * 1e3;
        assert!(
            (electrical_mj / 419.0 - 1.0).abs() < 0.03,
            "electrical {electrical_mj} mJ"
        );
        let parts = ["energy_copper_j", "energy_friction_inside_j", "energy_actuator_net_j"];
        let sum: f64 = parts.iter().map(|part| number(&cycle[part])).sum();
        assert!(
            (sum / number(&cycle["energy_electrical_j"]) - 1.0).abs() < 1e-9,
            "the electrical account closes"
        );
        assert_eq!(cycle["forward_slide_m"].as_array().map(Vec::len), Some(4));
    }
    let marked_s: f64 = cycles.iter().map(|cycle| number(&cycle["host_paused_s"])).sum();
    assert!(
        (0.0..=paused_s + 1e-9).contains(&marked_s),
        "cycles are marked with {marked_s} s of {paused_s} s of pauses"
    );
    assert_eq!(timing["worst_ticks"].as_array().map(Vec::len), Some(10));
    let late = late_ticks(&timing["culprits"]);
    assert!(
        late <= number(&summary["overruns"]),
        "a late tick costs a deadline at least: {timing}"
    );
    assert!(worm.pauses() > 0, "it was tried");
    assert_eq!(worm.stale_resources(), Vec::<String>::new());
}

#[test]
fn the_main_job_crawls_counts_and_leaves_nothing_behind() {
    assert_main_job(&Worm::new("main"));
}

#[test]
fn the_main_job_goes_on_when_one_process_pauses_alone() {
    assert_main_job(&Worm::with_pauses("alone", Pause::OneOf(20..60)));
}

#[test]
fn a_stalled_cam_is_reported_and_stops_the_worm() {
    let worm = Worm::new("stall");
    let output = worm
        .wormd(&["up", "--json", "--duration", "15", "--fault", "stall@1"])
        .output();
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("a summary even so");
    assert_eq!(output.status.code(), Some(1), "a run that ended in a fault failed");
    assert_eq!(
        (&summary["mode"], &summary["fault"]),
        (&"fault".into(), &"alarm".into())
    );
    let alarm = &summary["alarms"][0];
    assert_eq!(alarm["alarm"], AlarmKind::MotorStall.name(), "{}", summary["alarms"]);
}

/// A worm of separate processes, crawling.
struct Crawling {
    // In the order in which they are ended when a test is over: the motor is stopped first.
    controller: Process,
    estimator: Process,
    virtual_worm: Process,
    worm: Worm,
}

impl Crawling {
    fn start(name: &str) -> Self {
        Self::start_again(Worm::new(name))
    }

    fn start_again(worm: Worm) -> Self {
        let crawling = Self::at_rest(worm, &[]);
        crawling.make_crawl();
        crawling
    }

    /// The processes with these arguments, at rest.
    fn at_rest(worm: Worm, more: &[&str]) -> Self {
        let virtual_worm = worm.virtual_worm(&[]);
        let estimator = worm.wormd(&[&["estimate"], more].concat()).start();
        let port = worm.port();
        let controller = worm.wormd(&[&["control", "--port", &port], more].concat()).start();
        Self {
            worm,
            virtual_worm,
            estimator,
            controller,
        }
    }

    fn make_crawl(&self) {
        assert_eq!(self.worm.order(CommandKind::Arm), CommandOutcome::Accepted);
        self.wait_for_mode(Mode::Armed);
        wait_for("a crawl is accepted", PATIENCE, || {
            self.worm.order(CommandKind::Crawl) == CommandOutcome::Accepted
        });
        wait_for("the cam turns", PATIENCE, || {
            self.worm.state().is_some_and(|state| state.motor_velocity_rad_s > 2.0)
        });
    }

    /// kill -9, and no link is left: the system soon gives the number of its pseudo-terminal to another test's worm, and a
    /// controller that waits for its port to come back would take that.
    fn kill_virtual_worm(&mut self) {
        self.virtual_worm.kill();
        std::fs::remove_file(self.worm.port()).expect("the link is there");
    }

    fn wait_for_mode(&self, mode: Mode) {
        wait_for(mode.name(), PATIENCE, || {
            self.worm.state().is_some_and(|state| state.mode == mode.code())
        });
    }

    fn fault(&self) -> Option<Fault> {
        self.worm.state().and_then(|state| Fault::try_from(state.fault).ok())
    }

    /// Ends the processes that still live, then makes the same worm crawl again.
    fn restart(self) -> Self {
        let Self {
            worm,
            virtual_worm,
            estimator,
            controller,
        } = self;
        controller.end();
        estimator.end();
        virtual_worm.end();
        Self::start_again(worm)
    }
}

#[test]
fn a_killed_controller_leaves_a_stopped_motor_and_a_clean_restart() {
    let mut crawling = Crawling::start("kill-c");
    crawling.controller.kill();
    // Silence is what the watchdog waits for: every question would feed it.
    let (mut bus, servo) = crawling.worm.bus();
    wait_for("the servo's watchdog stops the motor", PATIENCE, || {
        std::thread::sleep(Duration::from_millis(300));
        let watchdog = bus.read_register(servo, register::BUS_WATCHDOG, soon());
        let velocity = bus.read_register(servo, register::PRESENT_VELOCITY, soon());
        (watchdog, velocity) == (Ok(u32::from(WATCHDOG_LATCHED)), Ok(0))
    });
    drop(bus);
    crawling.restart().worm.order(CommandKind::Stop);
}

#[test]
fn a_killed_estimator_stops_the_worm_and_restarts_beside_it() {
    let mut crawling = Crawling::start("kill-e");
    crawling.estimator.kill();
    crawling.wait_for_mode(Mode::Fault);
    assert_eq!(crawling.fault(), Some(Fault::EstimatorSilent));
    wait_for("the motor stands", PATIENCE, || {
        crawling
            .worm
            .state()
            .is_some_and(|state| state.motor_velocity_rad_s == 0.0)
    });
    crawling.estimator = crawling.worm.wormd(&["estimate"]).start();
    assert_eq!(crawling.worm.order(CommandKind::Reset), CommandOutcome::Accepted);
    crawling.wait_for_mode(Mode::Armed);
    wait_for("a crawl is accepted", PATIENCE, || {
        crawling.worm.order(CommandKind::Crawl) == CommandOutcome::Accepted
    });
    crawling.wait_for_mode(Mode::Crawling);
}

#[test]
fn a_pulled_cable_is_a_lost_link_until_it_is_back() {
    let mut crawling = Crawling::start("kill-w");
    crawling.kill_virtual_worm();
    crawling.wait_for_mode(Mode::Fault);
    assert_eq!(crawling.fault(), Some(Fault::LinkLost));
    crawling.virtual_worm = crawling.worm.virtual_worm(&[]);
    wait_for("a reset finds the worm again", PATIENCE, || {
        crawling.worm.order(CommandKind::Reset);
        crawling
            .worm
            .state()
            .is_some_and(|state| state.mode == Mode::Armed.code())
    });
    crawling.restart().worm.order(CommandKind::Stop);
}

#[test]
fn a_controller_that_pauses_for_longer_than_the_watchdog_waits_blames_neither_servo_nor_link() {
    let crawling = Crawling::start_again(Worm::on_a_steady_computer("pause-c"));
    // The computer as a whole may pause at the same time; then the servo has waited less.
    wait_for("the servo's watchdog stops the motor", PATIENCE, || {
        crawling.controller.pause(Duration::from_millis(250));
        std::thread::sleep(Duration::from_millis(50));
        crawling.fault() != Some(Fault::None)
    });
    assert_eq!(crawling.fault(), Some(Fault::HostPaused));
    let paused_ns = crawling.worm.state().map_or(0, |state| state.host_paused_ns);
    assert!(paused_ns > 200_000_000, "{paused_ns} ns of pauses are counted");
    assert_eq!(crawling.worm.order(CommandKind::Reset), CommandOutcome::Accepted);
    crawling.wait_for_mode(Mode::Armed);
}

#[test]
fn one_worm_has_one_controller() {
    let crawling = Crawling::start("two");
    let second = crawling
        .worm
        .wormd(&["control", "--port", &crawling.worm.port()])
        .output();
    let error = String::from_utf8_lossy(&second.stderr);
    assert_eq!(second.status.code(), Some(2), "{error}");
    assert!(
        error.contains(&crawling.controller.id().to_string()),
        "the other process is named: {error}"
    );
    // Another name, the same port: the port itself is locked.
    let other = Worm::new("two-b");
    let third = other.wormd(&["control", "--port", &crawling.worm.port()]).output();
    let error = String::from_utf8_lossy(&third.stderr);
    assert_eq!(third.status.code(), Some(2), "{error}");
    assert!(error.contains("already in use"), "{error}");
}

#[test]
fn check_tries_motion_and_watchdog() {
    // (fault, exit code, level of the watchdog's finding)
    for (name, fault, code, level) in [
        ("sound", &[][..], 0, "good"),
        ("unsafe", &["--fault", "watchdog-defect"][..], 1, "error"),
    ] {
        let worm = Worm::new(name);
        let _devices = worm.virtual_worm(fault);
        let config = format!("[port]\npath = \"{}\"\n[servo]\nwatchdog_ms = 400\n", worm.port());
        let config = worm.config(&config);
        let output = worm
            .wormd(&["check", "--json", "--try-motion", "--try-watchdog", "--config", &config])
            .output();
        let text = String::from_utf8_lossy(&output.stdout);
        assert_eq!(output.status.code(), Some(code), "{text}");
        let report: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        let findings = report["findings"].as_array().expect("a list");
        let level_of = |subject: &str| {
            findings
                .iter()
                .find(|finding| finding["subject"] == subject)
                .map(|finding| &finding["level"])
        };
        for subject in ["home", "motor current"] {
            assert_eq!(level_of(subject), Some(&"good".into()), "{subject}: {text}");
        }
        // A servo that would not be armed is turned only to try its watchdog.
        let direction = (level == "good").then(|| serde_json::Value::from(level));
        assert_eq!(level_of("motion"), Some(&level.into()), "{text}");
        assert_eq!(level_of("direction").cloned(), direction, "{text}");
        assert_eq!(level_of("watchdog"), Some(&level.into()), "{text}");
    }
}

#[test]
fn check_turns_nothing_while_the_emergency_stop_cannot_be_read() {
    let worm = Worm::new("no-stop");
    let _devices = worm.virtual_worm(&[]);
    let config = format!(
        "[port]\npath = \"{}\"\n[emergency_stop]\nsource = \"gpio\"\nchip = \"/dev/null\"\nline = 17\n",
        worm.port()
    );
    let config = worm.config(&config);
    let output = worm
        .wormd(&["check", "--json", "--try-motion", "--try-watchdog", "--config", &config])
        .output();
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(1), "{text}");
    let report: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    for subject in ["motion", "watchdog"] {
        let mut findings = report["findings"].as_array().expect("a list").iter();
        let finding = findings.find(|finding| finding["subject"] == subject).expect(subject);
        assert_eq!(
            (&finding["level"], &finding["found"]),
            (&"error".into(), &"was not tried".into())
        );
    }
}

#[test]
fn devices_that_do_not_fit_are_refused_by_name() {
    // (arguments of the virtual worm, configuration of the controller, what the error says)
    let table = [
        (
            "baud",
            &["--baud", "57600"][..],
            "[port]\npath = \"PORT\"\nbaud = 1000000\n",
            "57600",
        ),
        (
            "cells",
            &[][..],
            "[worm]\ncells = 6\nstep_order = [1, 2, 3, 4, 5, 6]\n[port]\npath = \"PORT\"\n",
            "cells",
        ),
        (
            "model",
            &["--fault", "wrong-model:number=1190"][..],
            "[port]\npath = \"PORT\"\n",
            "1190",
        ),
        (
            "watchdog",
            &["--fault", "watchdog-defect"][..],
            "[port]\npath = \"PORT\"\n",
            "accept_unsafe_watchdog",
        ),
        (
            "mute",
            &["--fault", "silence:device=tracker"][..],
            "[port]\npath = \"PORT\"\n",
            "tracker",
        ),
    ];
    for (name, arguments, config, part) in table {
        let worm = Worm::new(name);
        let _devices = worm.virtual_worm(arguments);
        let config = worm.config(&config.replace("PORT", &worm.port()));
        let output = worm.wormd(&["control", "--config", &config]).output();
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{name}: {error}");
        assert!(error.contains(part), "{name}: {error}");
    }
}
