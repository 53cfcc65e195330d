//! Recordings on a bench: in virtual time from the virtual servo to the name of its hidden effect, and the command with a real port.

use super::workspace::{Workspace, said, wormd};
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use worm_analysis::bench::BenchCampaign;
use worm_analysis::explain::servo::answer::ServoAnswer;
use worm_analysis::explain::servo::{self, Measures, explain_servo};
use worm_analysis::explain::{Options as SearchOptions, Verdict};
use worm_estimator::config::Config;
use worm_physics::servo::Pendulum;
use wormd::control::link_settings;
use wormd::link::servo::register;
use wormd::link::virtual_worm::{Devices, Options, VirtualPort};
use wormd::link::{Bus, StopInputs, Tty, WormBus, packet::DeviceId};
use wormd::servo_bench::{Bench, BenchFiles, BenchServo, BenchSettings, RecordingError, Trajectory};

const ARM: Pendulum = Pendulum {
    mass_kg: 0.3,
    length_m: 0.1,
    arm_mass_kg: 0.0,
    zero_rad: 0.0,
};

fn config(virtual_worm: &str) -> Config {
    let text = format!(
        "servo.current_limit_a = 1.75\n[virtual_worm]\nsupply_v = 6.0\nsupply_resistance_ohm = 0.0\n{virtual_worm}\n"
    );
    Config::from_toml(&text, Path::new("worm.toml")).expect("a valid configuration")
}

fn bus(config: &Config) -> WormBus<VirtualPort> {
    let options = Options {
        arm: Some(ARM),
        ..Options::default()
    };
    WormBus::new(VirtualPort::new(Devices::new(config, &options).expect("a servo"), 0.06))
}

fn settings(config: &Config) -> BenchSettings {
    let link = link_settings(config, 1_000_000).expect("valid IDs");
    BenchSettings::new(config, link, 1.5, 200.0)
}

/// Records in virtual time all trajectories with two gains, as the command does, and explains what was written.
fn explained(virtual_worm: &str) -> ServoAnswer {
    let config = config(virtual_worm);
    let mut bus = bus(&config);
    let mut stops = StopInputs::new(&[], None);
    let mut servo = BenchServo::prepare(&mut bus, settings(&config), &mut Vec::new(), &mut stops)
        .expect("a servo that hangs still");
    let files = Workspace::new();
    let bench = Bench {
        mass_kg: ARM.mass_kg,
        length_m: ARM.length_m,
        arm_mass_kg: ARM.arm_mass_kg,
        supply_v: servo.supply_v(),
        duty_limit: servo.duty_limit(),
        servo: "xl330-m288-t".to_owned(),
    };
    assert!((0.96..0.97).contains(&bench.duty_limit), "{}", bench.duty_limit);
    let mut written = BenchFiles::create(&files.path("bench"), &bench).expect("a new folder");
    for trajectory in Trajectory::ALL {
        for gain in [200, 400] {
            let readings = servo.record(trajectory, gain, &mut stops).expect("a recording");
            assert!((1195..=1201).contains(&readings.len()), "{}", readings.len());
            written.add(trajectory, gain, &readings).expect("written");
        }
    }
    servo.finish().expect("torque off");
    let campaign = BenchCampaign::load(&written.campaign()).expect("a campaign");
    let recordings = campaign.open_all().expect("recordings");
    let answer = explain_servo(
        &servo::Bench::new(&campaign, &recordings),
        &SearchOptions::of_servo(),
        &mut |_| (),
    );
    answer.expect("an answer")
}

/// The loop closes: a servo with friction by the load on its gears is recorded through the link, and the search names it.
#[test]
fn a_hidden_effect_of_the_virtual_servo_is_named_from_its_recordings() {
    let answer = explained(
        "present_current = \"duty\"\nservo_effect = [{ name = \"load-friction\", coefficient = 0.45, motor_share = 0.8 }]",
    );
    println!("{}", worm_analysis::report::servo::text(&answer));
    assert_eq!(answer.verdict, Verdict::Explained, "{}", answer.sentence);
    assert!(
        answer.effects.iter().any(|effect| effect.name.starts_with("load-")),
        "{}",
        answer.sentence
    );
    assert_eq!(
        answer.current.measures,
        Some(Measures::Duty),
        "{}",
        answer.current.sentence
    );
}

/// Without one, nothing is named.
#[test]
fn nothing_is_named_of_a_virtual_servo_without_effects() {
    let answer = explained("servo_effect = []");
    assert_eq!(answer.verdict, Verdict::Agrees, "{}", answer.sentence);
    assert_eq!(
        answer.current.measures,
        Some(Measures::Winding),
        "{}",
        answer.current.sentence
    );
}

/// Whatever ends a run, the torque is off then.
#[test]
fn every_end_switches_the_torque_off() {
    let torque_and_error = |config: &Config, settings: BenchSettings, is_signalled: bool| {
        let mut bus = bus(config);
        let signal = [Arc::new(AtomicBool::new(false))];
        let mut stops = StopInputs::new(&signal, None);
        let mut servo = BenchServo::prepare(&mut bus, settings, &mut Vec::new(), &mut stops).expect("it hangs still");
        signal[0].store(is_signalled, Ordering::Relaxed);
        let error = servo
            .record(Trajectory::SinSin, 400, &mut stops)
            .expect_err("it must end");
        drop(servo);
        let torque = bus.read_register(
            id(),
            register::TORQUE_ENABLE,
            Instant::now() + Duration::from_millis(60),
        );
        (torque.expect("it answers"), error)
    };
    let usual = config("");
    let hot = BenchSettings {
        max_temperature_c: 24.0,
        ..settings(&usual)
    };
    let (torque, error) = torque_and_error(&usual, hot, false);
    assert!(torque == 0 && matches!(error, RecordingError::Hot { .. }), "{error}");
    let demanding = BenchSettings {
        min_voltage_v: 7.5,
        ..settings(&usual)
    };
    let (torque, error) = torque_and_error(&usual, demanding, false);
    assert!(torque == 0 && matches!(error, RecordingError::Weak { .. }), "{error}");
    let (torque, error) = torque_and_error(&usual, settings(&usual), true);
    assert!(torque == 0 && matches!(error, RecordingError::Stopped(_)), "{error}");
    // Goals that leave the servo's position limits are refused before anything moves.
    let mut bus = bus(&usual);
    let far = BenchSettings {
        amplitude_rad: 3.3,
        ..settings(&usual)
    };
    let mut stops = StopInputs::new(&[], None);
    let error = BenchServo::prepare(&mut bus, far, &mut Vec::new(), &mut stops).expect_err("too far");
    assert!(error.to_string().contains("--amplitude-deg"), "{error}");
}

fn id() -> DeviceId {
    DeviceId::new(1).expect("a valid ID")
}

/// `wormd virtual-worm` with an arm, until it is dropped.
struct VirtualServo {
    process: Child,
    link: PathBuf,
}

impl VirtualServo {
    fn start(files: &Workspace) -> Self {
        let link = files.path("servo");
        let mut process = Command::new(env!("CARGO_BIN_EXE_wormd"))
            .args([
                "virtual-worm",
                "--arm",
                "mass_kg=0.2,length_m=0.1,arm_mass_kg=0.01",
                "--link",
            ])
            .arg(&link)
            .stdout(Stdio::piped())
            .spawn()
            .expect("the binary runs");
        let mut ready = String::new();
        let stdout = process.stdout.take().expect("piped");
        BufReader::new(stdout)
            .read_line(&mut ready)
            .expect("a line when it is ready");
        Self { process, link }
    }

    fn torque(&self) -> u32 {
        let (tty, _) = Tty::open(&self.link, 1_000_000).expect("the port is free");
        let deadline = Instant::now() + Duration::from_secs(1);
        let torque = Bus::new(tty).read_register(id(), register::TORQUE_ENABLE, deadline);
        torque.expect("it answers")
    }
}

impl Drop for VirtualServo {
    fn drop(&mut self) {
        self.process.kill().expect("it is there");
        self.process.wait().expect("it ends");
    }
}

const BENCH: [&str; 6] = ["servo-bench", "record", "--mass-kg", "0.2", "--length-m", "0.1"];

#[test]
fn the_command_records_over_a_port_and_predict_reads_it() {
    let files = Workspace::new();
    let servo = VirtualServo::start(&files);
    let (link, out) = (
        servo.link.display().to_string(),
        files.path("bench").display().to_string(),
    );
    let mut arguments = BENCH.to_vec();
    arguments.extend([
        "--port",
        &link,
        "--out",
        &out,
        "--trajectory",
        "lift",
        "--gain",
        "200",
        "--yes",
        "--json",
    ]);
    let output = wormd(&arguments);
    assert!(output.status.success(), "{}", said(&output));
    let answer: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!(answer["runs"][0]["recording"], "lift-p200.csv");
    assert_eq!(servo.torque(), 0);
    let campaign = answer["campaign"].as_str().expect("a path").to_owned();
    let predicted = wormd(&["predict", campaign.as_str(), "--json"]);
    assert!(predicted.status.success(), "{}", said(&predicted));
    let again = wormd(&arguments);
    assert_eq!(again.status.code(), Some(2), "{}", said(&again));
    assert!(said(&again).contains("new folder"), "{}", said(&again));
}

#[test]
fn ctrl_c_in_mid_run_switches_the_torque_off() {
    let files = Workspace::new();
    let servo = VirtualServo::start(&files);
    let out = files.path("bench");
    let recorder = Command::new(env!("CARGO_BIN_EXE_wormd"))
        .args(BENCH)
        .args(["--trajectory", "slow", "--gain", "400,200", "--yes", "--port"])
        .arg(&servo.link)
        .arg("--out")
        .arg(&out)
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary runs");
    // The second run is under way once the first is written.
    let give_up = Instant::now() + Duration::from_secs(60);
    while !out.join("bench.toml").exists() {
        assert!(Instant::now() < give_up, "no run within a minute");
        std::thread::sleep(Duration::from_millis(50));
    }
    let process = nix::unistd::Pid::from_raw(i32::try_from(recorder.id()).expect("a process ID"));
    nix::sys::signal::kill(process, nix::sys::signal::Signal::SIGINT).expect("it is there");
    let output = recorder.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(
        said(&output).contains("1 recordings before it are whole"),
        "{}",
        said(&output)
    );
    assert_eq!(servo.torque(), 0);
}

#[test]
fn what_cannot_be_recorded_is_refused_before_anything_moves() {
    let files = Workspace::new();
    let out = files.path("bench").display().to_string();
    for (more, expected) in [
        (vec!["--out", &out, "--yes"], "needs a serial port"),
        (vec!["--out", &out, "--port", "/dev/null"], "give --yes"),
        (
            vec!["--out", &out, "--trajectory", "round"],
            "there is no trajectory 'round'",
        ),
        (vec!["--out", &out, "--gain", "0"], "0 is not in 1..=16383"),
        (
            vec!["--out", &out, "--amplitude-deg", "200"],
            "must be a number from 1 to 120",
        ),
    ] {
        let mut arguments = BENCH.to_vec();
        arguments.extend(more);
        let output = wormd(&arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", said(&output));
        assert!(said(&output).contains(expected), "{arguments:?}: {}", said(&output));
    }
    let output = wormd(&["virtual-worm", "--link", "x", "--arm", "mass_kg=0.2"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains("length_m above 0"), "{}", said(&output));
}
