//! What is to be measured: the configuration with what the arguments change in it, as a file for the processes of the worm.

use super::LatencyArgs;
use crate::command::Failure;
use std::path::{Path, PathBuf};
use std::time::Duration;
use toml_edit::{DocumentMut, InlineTable, Item, Table, value};
use worm_estimator::config::Config;
use worm_estimator::message::AlarmKind;

/// The cam of the virtual worm is blocked for the first time so long after it began to crawl, s.
const FIRST_STALL_S: f64 = 2.0;
/// Time from one block to the next, s: by then the alarm has been cleared.
const BETWEEN_STALLS_S: f64 = 3.0;
/// How long it is blocked, s: less than the controller stands before it stops the worm for too much current.
const STALL_S: f64 = 0.3;
/// Measuring begins about so long after the worm began to crawl, s, and an alarm needs about so long at its end.
const SETTLING_S: f64 = 0.5;
const ALARM_S: f64 = 0.6;

/// The benchmark that was asked for.
pub(super) struct Bench {
    /// The configuration in force.
    pub(super) config: Config,
    /// Its text.
    text: DocumentMut,
    pub(super) duration: Duration,
    pub(super) load: bool,
    pub(super) cyclictest: bool,
    pub(super) searches_rates: bool,
    pub(super) verbose: u8,
}

impl Bench {
    pub(super) fn new(args: &LatencyArgs, verbose: u8) -> Result<Self, Failure> {
        // Once as it is given, so that its own problems are told in its own words.
        let (given, text) = args.worm.load_with_text()?;
        let mut text: DocumentMut = text.unwrap_or_default().parse().map_err(Failure::unusable)?;
        let is_virtual = given.port.is_none();
        // A loop that slowed down would be measured at another rate than the one given.
        set(&mut text, "control", "adapt_rate", value(false));
        if let Some(rate_hz) = args.rate {
            set(&mut text, "control", "rate_hz", value(rate_hz));
        }
        if let Some(priority) = args.priority {
            set(&mut text, "realtime", "priority", value(i64::from(priority)));
        }
        if let Some(cpu) = args.cpu {
            let cpu = i64::try_from(cpu).map_err(Failure::unusable)?;
            set(&mut text, "realtime", "cpu", value(cpu));
        }
        if let Some(port) = &given.port {
            set(&mut text, "port", "path", value(&port.path));
        }
        // Several benchmarks of virtual worms, and a worm that crawls meanwhile, are not in each other's way.
        let name = match (&args.worm.name, is_virtual) {
            (None, true) => format!("bench-{}", std::process::id()),
            _ => given.worm.name,
        };
        set(&mut text, "worm", "name", value(name));
        if is_virtual {
            // The blocks are ours: the worm goes on.
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
            duration: args.duration,
            load: args.load,
            cyclictest: args.cyclictest,
            searches_rates: !args.no_rate_search,
            verbose,
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

    /// When the virtual worm's cam is blocked, s since it began to crawl.
    pub(super) fn stalls_s(&self) -> Vec<f64> {
        let last_s = SETTLING_S + self.duration.as_secs_f64() - ALARM_S;
        (0..)
            .map(|number| FIRST_STALL_S + BETWEEN_STALLS_S * f64::from(number))
            .take_while(|stall_s| *stall_s <= last_s)
            .collect()
    }

    /// The same as arguments of `wormd virtual-worm`.
    pub(super) fn stall_faults(&self) -> Vec<String> {
        self.stalls_s()
            .into_iter()
            .map(|stall_s| format!("stall@{stall_s}..{}", stall_s + STALL_S))
            .collect()
    }

    /// How long the worm crawls before measuring begins.
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

/// A configuration file that goes when this goes.
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
        // What is left of it goes when the worm's folder is cleaned up.
        let _ = std::fs::remove_file(&self.0);
    }
}
