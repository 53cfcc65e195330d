//! The messages of a crawl on all topics, and logs of it.

use crate::crawl::{Crawl, Scene, config_of, paper_worm};
use std::cell::RefCell;
use std::io::Write;
use std::path::Path;
use std::rc::Rc;
use std::time::{Duration, UNIX_EPOCH};
use worm_estimator::config::{Battery, Config};
use worm_estimator::estimate::Observer;
use worm_estimator::message::{Alarm, AlarmKind, CommandRecord, Cycle, Estimate, Range, State, Timing, TripStatus};
use worm_log::{Log, Logged, Origin, Writer};

pub const ORIGIN_CONFIG: &str = "[worm]\nname = \"tester\"\n";

/// What the processes of a worm would have published.
#[derive(Default)]
pub struct Telemetry {
    pub config: Config,
    pub states: Vec<State>,
    pub timings: Vec<Timing>,
    pub estimates: Vec<Estimate>,
    pub cycles: Vec<Cycle>,
    pub alarms: Vec<Alarm>,
    pub ranges: Vec<Range>,
    pub commands: Vec<CommandRecord>,
    pub trips: Vec<TripStatus>,
}

impl Telemetry {
    /// The same, as a log.
    pub fn log(self) -> Log {
        Log {
            states: self.states,
            estimates: self.estimates,
            cycles: self.cycles,
            alarms: self.alarms,
            ranges: self.ranges,
            commands: self.commands,
            trips: self.trips,
            ..Log::default()
        }
    }
}

/// A crawl with an estimator from the first state on.
pub fn crawl(seconds: f64) -> Telemetry {
    crawl_with_late_estimator(seconds, 0)
}

/// A crawl whose estimator starts `late` states after the controller and sends a heartbeat now and then.
pub fn crawl_with_late_estimator(seconds: f64, late: usize) -> Telemetry {
    crawl_of(seconds, late, None)
}

/// A crawl on the usual battery with a gauge, and with an estimator from the first state on.
pub fn crawl_on_battery(seconds: f64) -> Telemetry {
    crawl_of(seconds, 0, Some(Battery::default()))
}

fn crawl_of(seconds: f64, late: usize, battery: Option<Battery>) -> Telemetry {
    let scene = Scene {
        cycles_per_s: 0.5,
        ..Scene::default()
    };
    let worm = paper_worm(0.0, true);
    let config = Config {
        battery,
        ..config_of(&worm, &scene)
    };
    let mut observer = Observer::new(&config).expect("a valid configuration");
    let mut crawl = Crawl::new(worm, scene);
    let mut telemetry = Telemetry::default();
    for tick in 0..(seconds * crawl.scene.tick_hz) as usize {
        let state = crawl.tick();
        telemetry.states.push(state);
        telemetry.timings.push(Timing {
            sequence: state.sequence,
            deadline_ns: state.time_ns - 100_000,
            wake_lateness_ns: 30_000 + tick as u64 % 977,
            bus_ns: u64::MAX,
            compute_ns: 1_000,
            publish_ns: 2_000,
            notify_ns: 0,
            waited_ns: 0,
            stolen_ns: 0,
            overruns: 0,
            period_ns: 1_000_000,
            host_paused_ns: 0,
            host_pauses: 0,
            overrun: 0,
            culprit: 0,
            minor_faults: 0,
            major_faults: 0,
        });
        if tick < late {
            continue;
        }
        if tick % 700 == 0 {
            observer.note_gauge(0.8 - 1e-6 * tick as f64);
        }
        let report = observer.update(&state);
        telemetry.alarms.extend(report.alarms.iter());
        telemetry.cycles.extend(report.cycle);
        telemetry.ranges.extend(report.range);
        telemetry.estimates.extend(report.estimate);
        if tick % 100 == 99 {
            telemetry.estimates.push(Estimate {
                // A heartbeat shows the alarms as they are by then.
                armed_mask: 1 << AlarmKind::LinkFault.code(),
                ..observer.latest()
            });
        }
    }
    telemetry.config = config;
    telemetry
}

pub fn origin() -> Origin {
    Origin {
        worm: "tester".to_owned(),
        cells: 4,
        config: Some(ORIGIN_CONFIG.to_owned()),
        begun: UNIX_EPOCH + Duration::from_millis(1500),
        begun_ns: 900_000_000,
    }
}

/// Writes a crawl as a log.
pub fn write_log(path: &Path, telemetry: &Telemetry) {
    let file = std::fs::File::create(path).expect("can be made");
    let mut writer = Writer::new(file, path, &origin()).expect("there is room");
    fn all<T: Logged>(writer: &mut Writer<std::fs::File>, messages: &[T]) {
        for message in messages {
            writer.write(message).expect("there is room");
        }
    }
    all(&mut writer, &telemetry.states);
    all(&mut writer, &telemetry.timings);
    all(&mut writer, &telemetry.estimates);
    all(&mut writer, &telemetry.cycles);
    all(&mut writer, &telemetry.alarms);
    all(&mut writer, &telemetry.ranges);
    all(&mut writer, &telemetry.commands);
    all(&mut writer, &telemetry.trips);
    writer.finish().expect("there is room");
}

/// Memory that a log is written to, with room for so many bytes.
#[derive(Clone)]
pub struct Sink {
    bytes: Rc<RefCell<Vec<u8>>>,
    capacity: usize,
}

impl Default for Sink {
    fn default() -> Self {
        Self::with_capacity(usize::MAX)
    }
}

impl Sink {
    pub fn with_capacity(capacity: usize) -> Self {
        let bytes = Rc::default();
        Self { bytes, capacity }
    }

    pub fn bytes(&self) -> Vec<u8> {
        self.bytes.borrow().clone()
    }
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let mut held = self.bytes.borrow_mut();
        let taken = bytes.len().min(self.capacity - held.len());
        if taken == 0 && !bytes.is_empty() {
            return Err(std::io::ErrorKind::StorageFull.into());
        }
        held.extend_from_slice(&bytes[..taken]);
        Ok(taken)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}
