//! The contents of a log.

use super::channel::Channel;
use super::payload::{Payload, PayloadError};
use super::scan::{Contents, refusal, scan, scan_from};
use crate::ReadError;
use std::collections::BTreeMap;
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};
use worm_estimator::config::{Config, ConfigError};
use worm_estimator::message::{Alarm, CommandRecord, Cycle, Estimate, Inferred, Range, State, Timing, TripStatus};

/// The messages of a log, by topic, each topic in the order in which it was recorded.
#[derive(Debug, Clone, Default)]
pub struct Log {
    /// The file.
    pub file: PathBuf,
    /// What the controller measured and commanded.
    pub states: Vec<State>,
    /// The timing of its ticks.
    pub timings: Vec<Timing>,
    /// The estimator's results, heartbeats included.
    pub estimates: Vec<Estimate>,
    /// The gait cycles that ended.
    pub cycles: Vec<Cycle>,
    /// Alarms raised and cleared.
    pub alarms: Vec<Alarm>,
    /// How far the battery lasts, after each cycle; none without a battery, and in logs of older versions.
    pub ranges: Vec<Range>,
    /// What the controller was told and made of it; none in logs of older versions.
    pub commands: Vec<CommandRecord>,
    /// How trips stood; none where there was none, and in logs of older versions.
    pub trips: Vec<TripStatus>,
    /// What the motor's current alone said; none where self-sensing was off, and in logs of older versions.
    pub inferred: Vec<Inferred>,
    /// The text of the worm's configuration; none if it ran on defaults, or, as a warning says, it is not known.
    pub config: Option<String>,
    /// Worm, cells, version, and when the log was begun.
    pub metadata: BTreeMap<String, String>,
    /// Remarks of the reader: a truncated end, damaged chunks, unknown channels.
    pub warnings: Vec<String>,
}

impl Log {
    /// The worm's configuration as it was when the log was made.
    ///
    /// # Errors
    /// [`ConfigError`] when this version of wormd does not accept it.
    pub fn config(&self) -> Result<Config, ConfigError> {
        match &self.config {
            Some(text) => Config::from_toml(text, &self.file),
            None => Ok(Config::default()),
        }
    }
}

/// Reads a whole log.
///
/// A truncated file is read up to its last whole message; `warnings` says so.
///
/// # Errors
/// [`ReadError`] when the file cannot be read, is not the log of a worm, or is of another version.
pub fn messages(path: &Path) -> Result<Log, ReadError> {
    gather(path, |take| scan(path, take))
}

/// As [`messages`], from anything that can be read and rewound; errors call it `path`.
///
/// # Errors
/// As [`messages`].
pub fn messages_from(input: impl Read + Seek, path: &Path) -> Result<Log, ReadError> {
    gather(path, |take| scan_from(input, path, take))
}

/// What receives the messages of a log, still as they stand in it.
type Take<'t> = &'t mut dyn FnMut(Channel, Payload<'_>) -> Result<(), PayloadError>;

fn gather(path: &Path, scan: impl FnOnce(Take<'_>) -> Result<Contents, ReadError>) -> Result<Log, ReadError> {
    let mut log = Log {
        file: path.to_owned(),
        ..Log::default()
    };
    let contents = scan(&mut |channel, payload| {
        match channel {
            Channel::State => log.states.push(payload.read()?),
            Channel::Timing => log.timings.push(payload.read()?),
            Channel::Estimate => log.estimates.push(payload.read()?),
            Channel::Cycle => log.cycles.push(payload.read()?),
            Channel::Alarm => log.alarms.push(payload.read()?),
            Channel::Range => log.ranges.push(payload.read()?),
            Channel::CommandRecord => log.commands.push(payload.read()?),
            Channel::TripStatus => log.trips.push(payload.read()?),
            Channel::Inferred => log.inferred.push(payload.read()?),
        }
        Ok(())
    })?;
    log.config = contents.config;
    log.metadata = contents.metadata;
    log.warnings = contents.warnings;
    Ok(log)
}

/// Reads configuration, metadata and warnings of a log, without its messages.
///
/// # Errors
/// As [`messages`].
pub fn without_messages(path: &Path) -> Result<Log, ReadError> {
    let contents = scan(path, |_, _| Ok(()))?;
    Ok(Log {
        file: path.to_owned(),
        config: contents.config,
        metadata: contents.metadata,
        warnings: contents.warnings,
        ..Log::default()
    })
}

/// The error for a log without usable messages.
#[must_use]
pub fn nothing(path: &Path, problem: &str, remedy: &str) -> ReadError {
    let place = format!("channel {}", Channel::State.topic());
    refusal(path, Some(place), problem.to_owned(), remedy)
}
