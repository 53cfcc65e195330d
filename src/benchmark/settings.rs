//! What is to be measured: the configuration as the options change it, as a file for the processes of the worm.

use crate::failure::Failure;
use std::path::{Path, PathBuf};
use std::time::Duration;
use toml_edit::{DocumentMut, InlineTable, Item, Table, value};
use worm_estimator::config::Config;
use worm_estimator::message::AlarmKind;

/// How often the loop's topics are read: as rarely as their buffers allow at any rate, because each wake of this process may
/// interrupt the loop.
pub(super) const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// When the cam of the virtual worm is first blocked, counted from the beginning of the crawl, s.
const FIRST_STALL_S: f64 = 2.0;
/// Interval of the blocks, s: the alarm has been cleared by the next one.
const BETWEEN_STALLS_S: f64 = 3.0;
/// How long it is blocked, s: shorter than the controller tolerates the current of a stall.
const STALL_S: f64 = 0.3;
/// How long after the beginning of the crawl the measurement begins, s.
const SETTLING_S: f64 = 0.5;
/// Time that a stall and its alarm need before the measurement ends, s.
const ALARM_S: f64 = 0.6;

/// What `wormd latency` can change of a run.
#[derive(Debug, Clone)]
pub(crate) struct Options {
    /// Name of the worm, if it was given on the command line.
    pub name: Option<String>,
    /// Ticks per second, instead of the configured ones.
    pub rate_hz: Option<f64>,
    /// How long to measure the loop.
    pub duration: Duration,
    /// Whether all CPUs, the memory and the disk are kept busy meanwhile.
    pub load: bool,
    /// Priority under `SCHED_FIFO`, instead of the configured one.
    pub priority: Option<u8>,
    /// CPU to pin loop and floor to, instead of the configured one.
    pub cpu: Option<usize>,
    /// Whether to search for the highest sustained rate.
    pub search_rates: bool,
    /// Whether to run `cyclictest`, too.
    pub cyclictest: bool,
    /// How many `-v` the processes get; with any, their log is printed.
    pub verbose: u8,
}

/// One benchmark: its configuration and options.
pub(crate) struct Benchmark {
    /// The effective configuration.
    pub(super) config: Config,
    /// Its text.
    text: DocumentMut,
    pub(super) options: Options,
}

impl Benchmark {
    /// The benchmark of a worm with the configuration `given`, and the text of its file.
    ///
    /// # Errors
    /// [`Failure::Unusable`] for options that make the configuration invalid.
    pub(crate) fn new(given: Config, text: Option<String>, options: Options) -> Result<Self, Failure> {
        let mut text: DocumentMut = text.unwrap_or_default().parse().map_err(Failure::unusable)?;
        let is_virtual = given.port.is_none();
        // A loop that slows itself down would be measured at another rate than the given one.
        set(&mut text, "control", "adapt_rate", value(false));
        if let Some(rate_hz) = options.rate_hz {
            set(&mut text, "control", "rate_hz", value(rate_hz));
        }
        if let Some(priority) = options.priority {
            set(&mut text, "realtime", "priority", value(i64::from(priority)));
        }
        if let Some(cpu) = options.cpu {
            let cpu = i64::try_from(cpu).map_err(Failure::unusable)?;
            set(&mut text, "realtime", "cpu", value(cpu));
        }
        if let Some(port) = &given.port {
            set(&mut text, "port", "path", value(&port.path));
        }
        // A name of its own, so that several benchmarks of virtual worms can run beside each other and beside a worm.
        let name = match (&options.name, is_virtual) {
            (None, true) => format!("bench-{}", std::process::id()),
            _ => given.worm.name,
        };
        set(&mut text, "worm", "name", value(name));
        if is_virtual {
            // The benchmark itself blocks the cam: the alarms must not stop the worm.
            for kind in AlarmKind::ALL.iter().copied() {
                let mut alarm = InlineTable::new();
                alarm.insert("policy", "warn".into());
                alarm.insert("threshold", given.alarms.of(kind).threshold.into());
                set(&mut text, "alarms", &kind.name().replace('-', "_"), value(alarm));
            }
        }
        let file = Path::new("command line");
        Ok(Self {
            config: Config::from_toml(&text.to_string(), file)?,
            text,
            options,
        })
    }

    /// The configuration as a file in `folder`, for another process.
    pub(super) fn file(&self, folder: &Path) -> Result<ConfigFile, Failure> {
        ConfigFile::write(folder.join("latency.toml"), &self.text)
    }

    /// The configuration with another rate, as a file in `folder`, for another process.
    pub(super) fn file_at(&self, rate_hz: f64, folder: &Path) -> Result<ConfigFile, Failure> {
        let mut text = self.text.clone();
        set(&mut text, "control", "rate_hz", value(rate_hz));
        ConfigFile::write(folder.join("latency-rate.toml"), &text)
    }

    /// When the virtual worm's cam is blocked, s after the beginning of the crawl.
    pub(super) fn stalls_s(&self) -> Vec<f64> {
        let last_s = SETTLING_S + self.options.duration.as_secs_f64() - ALARM_S;
        (0..)
            .map(|number| FIRST_STALL_S + BETWEEN_STALLS_S * f64::from(number))
            .take_while(|stall_s| *stall_s <= last_s)
            .collect()
    }

    /// The blocks as arguments of `wormd virtual-worm --fault`.
    pub(super) fn stall_faults(&self) -> Vec<String> {
        self.stalls_s()
            .into_iter()
            .map(|stall_s| format!("stall@{stall_s}..{}", stall_s + STALL_S))
            .collect()
    }

    /// How long the worm crawls before the measurement begins.
    pub(super) fn settling(&self) -> Duration {
        Duration::from_secs_f64(SETTLING_S)
    }

    /// Time between deadlines, ns.
    pub(super) fn period_ns(&self) -> u64 {
        (1e9 / self.config.control.rate_hz).round() as u64
    }
}

fn table<'t>(text: &'t mut DocumentMut, name: &str) -> &'t mut Item {
    text.entry(name).or_insert_with(|| Item::Table(Table::new()))
}

fn set(text: &mut DocumentMut, section: &str, key: &str, item: Item) {
    table(text, section)[key] = item;
}

/// A configuration file that is removed on drop.
pub(super) struct ConfigFile(PathBuf);

impl ConfigFile {
    fn write(path: PathBuf, text: &DocumentMut) -> Result<Self, Failure> {
        std::fs::write(&path, text.to_string())
            .map_err(|error| Failure::failed(format!("{}: {error}: is there room?", path.display())))?;
        Ok(Self(path))
    }

    pub(super) fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for ConfigFile {
    fn drop(&mut self) {
        // If it stays, it is removed with the worm's folder.
        let _ = std::fs::remove_file(&self.0);
    }
}
