//! The tracker of `dynamixel-bus`'s examples, as a process at a pseudo-terminal, against the controller's own link.

use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use dynamixel_bus::packet::DeviceId;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use testkit::pseudo_terminal::PseudoTerminal;
use worm_estimator::config::Config;
use wormd::link::virtual_worm::{Options, VirtualWorm};
use wormd::link::{
    FaultInjector, Faults, LinkSettings, Port, Prepared, ReadMode, ReadPlan, StartupError, TrackerReading,
    TrackerSettings, TransactionError, Tty, WormBus, prepare, tracker,
};

const BAUD: u32 = 1_000_000;
const CELLS: usize = 4;

fn id(id: u8) -> DeviceId {
    DeviceId::new(id).expect("a valid ID")
}

fn soon() -> Instant {
    Instant::now() + Duration::from_millis(500)
}

/// Path of the example, built in the profile of this test.
fn example() -> &'static Path {
    static PATH: OnceLock<PathBuf> = OnceLock::new();
    PATH.get_or_init(|| {
        let test = std::env::current_exe().expect("this test");
        let profile = test.ancestors().nth(2).expect("target/<profile>/deps/<test>");
        let target = profile.parent().expect("target/<profile>");
        let mut build = Command::new(env!("CARGO"));
        build
            .args([
                "build",
                "--quiet",
                "--offline",
                "--package",
                "dynamixel-bus",
                "--example",
                "tracker",
            ])
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .arg("--target-dir")
            .arg(target);
        if profile.ends_with("release") {
            build.arg("--release");
        }
        assert!(build.status().expect("cargo").success(), "the example is built");
        profile.join("examples/tracker")
    })
}

/// The example as a process, which ends with this.
struct Process(Child);

impl Process {
    fn spawn(tracker_id: u8, cells: usize, input: Stdio, output: Stdio) -> Self {
        Self::spawn_with(tracker_id, cells, None, input, output)
    }

    /// The same with an inertial sensor: a file with its pitch.
    fn spawn_with(tracker_id: u8, cells: usize, pitch: Option<&Path>, input: Stdio, output: Stdio) -> Self {
        let child = Command::new(example())
            .env("TRACKER_ID", tracker_id.to_string())
            .env("TRACKER_CELLS", cells.to_string())
            .envs(pitch.map(|pitch| ("TRACKER_PITCH", pitch)))
            .stdin(input)
            .stdout(output)
            .spawn()
            .expect("the example runs");
        Self(child)
    }

    /// Waits until it ends by itself.
    fn ends_well(mut self) -> bool {
        let deadline = Instant::now() + Duration::from_secs(20);
        while Instant::now() < deadline {
            if let Some(status) = self.0.try_wait().expect("its status") {
                return status.success();
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        false
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended already.
        let _ended = self.0.kill();
        let _status = self.0.wait();
    }
}

/// What the example's pattern says about a capture.
fn assert_is_of_the_pattern(reading: &TrackerReading, cells: usize) {
    let sample = reading.sample;
    assert_eq!(reading.capture_time_us, sample.wrapping_mul(10_000));
    assert_eq!(usize::from(reading.cell_count), cells);
    for (cell, &position_m) in reading.positions_m[..cells].iter().enumerate() {
        let hidden = cell + 1 == cells && sample % 10 == 9;
        assert_eq!(
            reading.valid >> cell & 1 == 1,
            !hidden,
            "cell {cell} of capture {sample}"
        );
        let known = if hidden { sample - 1 } else { sample };
        let expected_m = 0.05 * cell as f64 + 1e-4 * f64::from(known % 1_000);
        assert!(
            (position_m - expected_m).abs() < 1e-9,
            "cell {cell} of capture {sample}: {position_m} m instead of {expected_m} m"
        );
    }
}

#[test]
fn example_tracker_alone_on_a_pseudo_terminal_is_identified_and_read() {
    let PseudoTerminal { far, near, path } = PseudoTerminal::open();
    let output = far.try_clone().expect("a second descriptor");
    let process = Process::spawn(100, 5, far.into(), output.into());
    let mut bus = WormBus::new(Tty::open(&path, BAUD).expect("the port").0);
    drop(near);
    // The process may still be starting.
    let identity = (0..40).find_map(|_| bus.ping(id(100), soon()).ok()).expect("an answer");
    assert_eq!(
        (identity.model, identity.firmware, identity.alert),
        (tracker::MODEL, 1, false)
    );
    for (register, expected) in [
        (tracker::register::MODEL_NUMBER, u32::from(tracker::MODEL)),
        (tracker::register::FIRMWARE_VERSION, 1),
        (tracker::register::ID, 100),
        (tracker::register::CELL_COUNT, 5),
    ] {
        assert_eq!(bus.read_register(id(100), register, soon()), Ok(expected), "{register}");
    }
    let refused = bus.write_register(id(100), tracker::register::SAMPLE, 0, soon());
    assert!(matches!(refused, Err(TransactionError::Refused { .. })), "{refused:?}");

    let span = tracker::block_span(id(100), 5);
    let mut block = [0; tracker::block_len(5)];
    let mut read = |bus: &mut WormBus<Tty>| {
        bus.read(span.id, span.address, &mut block, soon()).expect("a block");
        TrackerReading::from_block(&block).expect("a tracker's block")
    };
    let first = read(&mut bus);
    assert_is_of_the_pattern(&first, 5);
    let newer = (0..1000)
        .map(|_| read(&mut bus))
        .find(|reading| reading.sample > first.sample);
    assert_is_of_the_pattern(&newer.expect("the next capture"), 5);

    let mut found = Vec::new();
    let sync = bus.sync_read(span.address, span.length, &[id(100)], soon(), |status| {
        found.push(TrackerReading::from_block(status.data).expect("a tracker's block"));
    });
    assert_eq!(sync, Ok(1));
    let bulk = bus.bulk_read([span], soon(), |status| {
        found.push(TrackerReading::from_block(status.data).expect("a tracker's block"));
    });
    assert_eq!(bulk, Ok(1));
    found.iter().for_each(|reading| assert_is_of_the_pattern(reading, 5));

    drop(bus);
    assert!(process.ends_well(), "the line is closed");
}

#[test]
fn example_tracker_reports_the_pitch_of_its_sensor_and_none_without_one() {
    let file = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(file.path(), "-12.34\n").expect("is written");
    for (sensor, expected_deg) in [(Some(file.path()), Some(-12.34)), (None, None)] {
        let PseudoTerminal { far, near, path } = PseudoTerminal::open();
        let output = far.try_clone().expect("a second descriptor");
        let _process = Process::spawn_with(100, 0, sensor, far.into(), output.into());
        let mut bus = WormBus::new(Tty::open(&path, BAUD).expect("the port").0);
        drop(near);
        (0..40).find_map(|_| bus.ping(id(100), soon()).ok()).expect("an answer");
        let counts = bus
            .read_register(id(100), tracker::register::PITCH, soon())
            .expect("it is there");
        let pitch_deg = tracker::pitch_rad(counts as u16 as i16).map(f64::to_degrees);
        match (pitch_deg, expected_deg) {
            (Some(found_deg), Some(expected_deg)) => assert!((found_deg - expected_deg).abs() < 1e-9, "{found_deg}"),
            (found, expected) => assert_eq!(found, expected),
        }
    }
}

/// A line with three ends: the controller's pseudo-terminal, the virtual worm's servo, and the example. What one sends the
/// others hear, in the same order.
struct SharedLine {
    path: PathBuf,
    stop: Arc<AtomicBool>,
    relay: Option<JoinHandle<()>>,
    _near: OwnedFd, // so that the line outlives a controller
    _worm: VirtualWorm,
    _tracker: Process,
}

impl SharedLine {
    fn new(tracker_id: u8, cells: usize) -> Self {
        // The virtual worm's own tracker is silent, so that the example can take its place.
        let options = Options {
            faults: vec!["silence:device=tracker".parse().expect("a fault")],
            ..Options::default()
        };
        let worm = VirtualWorm::spawn(&Config::default(), &options).expect("a virtual worm");
        let servo = File::options()
            .read(true)
            .write(true)
            .open(worm.path())
            .expect("its port");
        let mut tracker = Process::spawn(tracker_id, cells, Stdio::piped(), Stdio::piped());
        let PseudoTerminal { far, near, path } = PseudoTerminal::open();
        let controller = File::from(far);
        let tracker_input = OwnedFd::from(tracker.0.stdin.take().expect("piped"));
        let tracker_output = OwnedFd::from(tracker.0.stdout.take().expect("piped"));
        let twin = |file: &File| file.try_clone().expect("a second descriptor");
        let outputs = [twin(&controller), twin(&servo), tracker_input.into()];
        let inputs = [controller, servo, tracker_output.into()];
        let stop = Arc::new(AtomicBool::new(false));
        let stop_there = Arc::clone(&stop);
        Self {
            path,
            stop,
            relay: Some(std::thread::spawn(move || relay(inputs, outputs, &stop_there))),
            _near: near,
            _worm: worm,
            _tracker: tracker,
        }
    }

    fn open(&self) -> Tty {
        Tty::open(&self.path, BAUD).expect("the port").0
    }
}

impl Drop for SharedLine {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(relay) = self.relay.take() {
            // A relay that panicked has failed the test already.
            let _ended = relay.join();
        }
    }
}

fn relay(mut inputs: [File; 3], mut outputs: [File; 3], stop: &AtomicBool) {
    let mut bytes = [0; 512];
    while !stop.load(Ordering::Relaxed) {
        let mut fds = [0, 1, 2].map(|end: usize| PollFd::new(inputs[end].as_fd(), PollFlags::POLLIN));
        poll(&mut fds, PollTimeout::from(10u8)).expect("polled");
        let ready = fds.map(|fd| fd.any() == Some(true));
        for from in 0..3 {
            if !ready[from] {
                continue;
            }
            let count = match inputs[from].read(&mut bytes) {
                Ok(count) => count,
                Err(error) if error.kind() == ErrorKind::Interrupted => 0,
                Err(error) => panic!("end {from} of the line: {error}"),
            };
            for to in (0..3).filter(|&to| to != from) {
                outputs[to].write_all(&bytes[..count]).expect("sent on");
            }
        }
    }
}

fn settings(read: ReadMode) -> LinkSettings {
    LinkSettings {
        baud: BAUD,
        servo_id: id(1),
        servo_model: 1200,
        tracker: Some(TrackerSettings {
            id: id(100),
            model: tracker::MODEL,
            cells: CELLS,
            emergency_stop_mask: None,
            pitch: false,
            may_be_silent: false,
        }),
        read,
        watchdog_ms: 2_000,
        current_limit_a: 1.0,
        winding_resistance_ohm: 3.4,
        velocity_limit_rad_s: 6.0,
        temperature_limit_c: 70.0,
        accept_unsafe_watchdog: false,
    }
}

/// Prepares the devices: several processes answer here, and on a busy computer each may pause for longer than start-up waits.
fn prepare_patiently<P: Port>(bus: &mut WormBus<P>, settings: &LinkSettings) -> Prepared {
    let mut refusals = Vec::new();
    for _ in 0..10 {
        match prepare(bus, settings, &mut Vec::new()) {
            Ok(prepared) => return prepared,
            Err(refusal) => refusals.push(refusal.to_string()),
        }
    }
    panic!("never ready to tick: {refusals:?}");
}

#[test]
fn example_tracker_and_a_servo_on_one_line_are_prepared_and_exchanged_with() {
    let line = SharedLine::new(100, CELLS);
    for plan in [ReadPlan::FastBulk, ReadPlan::Bulk, ReadPlan::Separate] {
        let mut bus = WormBus::new(line.open());
        let prepared = prepare_patiently(&mut bus, &settings(ReadMode::Always(plan)));
        let tracker = prepared.tracker.expect("the example tracker");
        assert_eq!((prepared.plan.read, usize::from(tracker.cells)), (plan, CELLS));
        assert_is_of_the_pattern(&tracker.reading, CELLS);
        bus.set_torque(prepared.plan.servo, true).expect("torque");
        let mut complete = 0;
        for _ in 0..50 {
            let outcome = bus.exchange(&prepared.plan, 2.5, soon());
            if let (Ok(_), Ok(reading)) = (outcome.servo, outcome.tracker) {
                assert_is_of_the_pattern(&reading, CELLS);
                complete += 1;
            }
        }
        // A computer that pauses in the middle of a packet costs that packet.
        assert!(complete >= 45, "{plan:?}: {complete} of 50, {:?}", bus.counters());
        bus.stop_motor(prepared.plan.servo).expect("at rest");
        bus.set_torque(prepared.plan.servo, false).expect("torque off");
    }
}

#[test]
fn damage_on_the_line_never_becomes_a_reading_of_the_example_tracker() {
    let line = SharedLine::new(100, CELLS);
    let mut bus = WormBus::new(FaultInjector::new(line.open(), Faults::NONE, 20_161_114));
    let prepared = prepare_patiently(&mut bus, &settings(ReadMode::Auto));
    bus.port_mut().set_faults(Faults {
        flip: 0.002,
        drop: 0.001,
        duplicate: 0.001,
        drop_sent: 0.003,
        ..Faults::NONE
    });
    let (mut complete, mut spoilt) = (0, 0);
    for _ in 0..100 {
        let outcome = bus.exchange(&prepared.plan, 2.5, Instant::now() + Duration::from_millis(50));
        spoilt += u32::from(!outcome.is_complete());
        complete += u32::from(outcome.is_complete());
        if let Ok(reading) = outcome.tracker {
            assert_is_of_the_pattern(&reading, CELLS);
        }
    }
    assert!(complete >= 20 && spoilt >= 10, "{complete} complete, {spoilt} spoilt");
    bus.port_mut().set_faults(Faults::NONE);
    let recovered = (0..10).any(|_| bus.exchange(&prepared.plan, 0.0, soon()).is_complete());
    assert!(recovered, "{:?}", bus.counters());
}

#[test]
fn start_up_refuses_an_example_tracker_that_is_not_the_one_configured() {
    let line = SharedLine::new(100, CELLS - 1);
    let refused = prepare(
        &mut WormBus::new(line.open()),
        &settings(ReadMode::Auto),
        &mut Vec::new(),
    );
    assert_eq!(
        refused,
        Err(StartupError::TooFewCells {
            found: 3,
            configured: CELLS
        })
    );
    drop(line);
    let line = SharedLine::new(7, CELLS);
    let refused = prepare(
        &mut WormBus::new(line.open()),
        &settings(ReadMode::Auto),
        &mut Vec::new(),
    );
    let message = refused.expect_err("silent").to_string();
    assert!(
        message.contains("these IDs do: 1 (model 1200), 7 (model 22349)"),
        "{message}"
    );
}
