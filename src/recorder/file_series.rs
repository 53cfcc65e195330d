//! The files of a recording, one after the other: `run.mcap`, `run.1.mcap`, `run.2.mcap`, …
//!
//! Each is a whole log with schemas and configuration. Which file a message is in depends only on how full or old the file was when the
//! message came, so no message is lost or written twice where one file ends and the next begins.

use super::carried::Finding;
use super::log_file::{LogFile, WrittenFile, problem_of};
use super::log_head::LogHead;
use super::progress::Progress;
use std::collections::VecDeque;
use std::ffi::OsString;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use worm_log::{Channel, Index, Logged, Note, WriteError, Writer};

/// What the files of a recording are like. By default there is one file, of any size, with an index.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct FileOptions {
    /// A file that has so many bytes is followed by the next.
    pub max_bytes: Option<u64>,
    /// A file whose first message is so old is followed by the next.
    pub max_age: Option<Duration>,
    /// Only so many files are kept, the present one among them.
    pub keep: Option<usize>,
    /// Whether each file gets an index of its messages.
    pub index: Index,
    /// How many ticks and estimates a second go into them; all where there is none.
    pub rate_hz: Option<f64>,
}

impl FileOptions {
    /// Whether there can be more than one file.
    pub(super) const fn is_rotating(&self) -> bool {
        self.max_bytes.is_some() || self.max_age.is_some()
    }
}

/// Why the files cannot be written on.
#[derive(Debug, thiserror::Error)]
pub(super) enum SeriesError {
    /// A file cannot be created.
    #[error("{}: cannot be created: {source}: make room or choose another place; the files before it are complete", path.display())]
    Create { path: PathBuf, source: io::Error },
    /// The file in use cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The file in use is not safe on the disk.
    #[error("{}: {source}: what was written until then can be read if the file is still there", path.display())]
    Sync { path: PathBuf, source: io::Error },
}

/// The file in use.
struct Current {
    writer: Writer<BufWriter<LogFile>>,
    file: LogFile,
    path: PathBuf,
    /// When its first message came.
    first_message: Option<Instant>,
}

/// The files of one recording.
pub(super) struct FileSeries {
    first: PathBuf,
    overwrite: bool,
    head: LogHead,
    options: FileOptions,
    progress: Arc<Progress>,
    /// The number of the file in use.
    number: u64,
    current: Current,
    /// The files that are kept, the oldest first, the one in use last.
    kept: VecDeque<WrittenFile>,
    /// Messages in the files before the one in use, by channel.
    counts: Vec<(Channel, u64)>,
}

impl FileSeries {
    /// Begins the first file, `first`, which is an open [`LogFile`] of that name.
    ///
    /// # Errors
    /// [`WriteError`] when it cannot be written.
    pub(super) fn begin(
        first: &Path,
        file: LogFile,
        overwrite: bool,
        head: LogHead,
        options: FileOptions,
        progress: &Arc<Progress>,
    ) -> Result<Self, WriteError> {
        let kept = file.identity(first).into_iter().collect();
        Ok(Self {
            first: first.to_owned(),
            overwrite,
            options,
            progress: Arc::clone(progress),
            number: 0,
            current: Current {
                writer: begin_log(&file, first, &head, options.index)?,
                file,
                path: first.to_owned(),
                first_message: None,
            },
            head,
            kept,
            counts: Channel::ALL.iter().map(|&channel| (channel, 0)).collect(),
        })
    }

    /// To be called before each batch of messages at `now`: begins the next file where this one is full or old enough.
    ///
    /// # Errors
    /// [`SeriesError`] when this file cannot be completed or the next one not be begun.
    pub(super) fn prepared(mut self, now: Instant) -> Result<Self, SeriesError> {
        let first_message = *self.current.first_message.get_or_insert(now);
        let options = &self.options;
        let is_full = options.max_bytes.is_some_and(|max| self.current.file.bytes() >= max);
        let age = now.saturating_duration_since(first_message);
        let is_old = options.max_age.is_some_and(|max| age >= max);
        if !is_full && !is_old {
            return Ok(self);
        }
        let head = self.head.of_next();
        self.rotated(head, Some(now))
    }

    /// Goes on in the next file, which has another head: its messages do not belong into one file with those before.
    ///
    /// # Errors
    /// As [`FileSeries::prepared`].
    pub(super) fn with_head(self, head: LogHead) -> Result<Self, SeriesError> {
        self.rotated(head, None)
    }

    /// Writes messages into the file in use.
    ///
    /// # Errors
    /// [`WriteError`] when it refuses.
    pub(super) fn write<T: Logged>(&mut self, messages: &[T]) -> Result<(), WriteError> {
        messages
            .iter()
            .try_for_each(|message| self.current.writer.write(message))
    }

    /// Writes a note into the file in use.
    ///
    /// # Errors
    /// [`WriteError`] when it refuses.
    pub(super) fn write_note(&mut self, note: &Note) -> Result<(), WriteError> {
        self.current.writer.write_note(note)
    }

    /// Writes what was found out about the configuration into the file in use and those that follow.
    ///
    /// # Errors
    /// [`WriteError`] when it refuses.
    pub(super) fn write_finding(&mut self, finding: &Finding) -> Result<(), WriteError> {
        self.head.take_in(finding);
        match finding {
            Finding::Configuration { .. } => self.current.writer.write_origin(&self.head.origin),
            Finding::Note(note) => self.current.writer.write_note(note),
        }
    }

    /// Writes what is only in memory yet, and waits until it is on the disk.
    ///
    /// # Errors
    /// [`SeriesError`] when the file refuses, or was removed.
    pub(super) fn sync(&mut self) -> Result<(), SeriesError> {
        self.current.writer.flush()?;
        self.current.file.sync().map_err(|source| SeriesError::Sync {
            path: self.current.path.clone(),
            source,
        })
    }

    /// Completes the last file; returns the messages of each channel in all files.
    ///
    /// # Errors
    /// [`SeriesError`] when the file could not be completed; what was written until then can be read.
    pub(super) fn finish(self) -> Result<Vec<(Channel, u64)>, SeriesError> {
        let Self {
            current, mut counts, ..
        } = self;
        add_counts(&mut counts, &current.writer);
        complete(current)?;
        Ok(counts)
    }

    fn rotated(mut self, head: LogHead, first_message: Option<Instant>) -> Result<Self, SeriesError> {
        add_counts(&mut self.counts, &self.current.writer);
        // First the old file, so that it is complete whatever becomes of the next.
        let full = self.current.path.clone();
        complete(self.current)?;
        let next = create_next(&self.first, self.number, self.overwrite, &self.progress)?;
        tracing::info!(
            "{} is complete; the recording goes on in {}",
            full.display(),
            next.path.display()
        );
        self.kept.extend(next.file.identity(&next.path));
        let mut series = Self {
            number: next.number,
            current: Current {
                writer: begin_log(&next.file, &next.path, &head, self.options.index)?,
                file: next.file,
                path: next.path,
                first_message,
            },
            head,
            ..self
        };
        series.remove_oldest();
        Ok(series)
    }

    /// Removes what is more than may be kept. A file that cannot be removed is tried again when the next one begins.
    fn remove_oldest(&mut self) {
        let Some(keep) = self.options.keep else { return };
        let surplus = self.kept.len().saturating_sub(keep.max(1));
        let mut refused = Vec::new();
        for oldest in self.kept.drain(..surplus) {
            match oldest.remove() {
                Ok(()) => tracing::info!("removed {}, the oldest file", oldest.path().display()),
                Err(error) => {
                    tracing::warn!(
                        "{} cannot be removed: {error}: it is tried again with the next file; until then the disk fills",
                        oldest.path().display()
                    );
                    refused.push(oldest);
                }
            }
        }
        for oldest in refused.into_iter().rev() {
            self.kept.push_front(oldest);
        }
    }
}

/// Begins a log in a file that was just created.
fn begin_log(
    file: &LogFile,
    path: &Path,
    head: &LogHead,
    index: Index,
) -> Result<Writer<BufWriter<LogFile>>, WriteError> {
    let mut writer = Writer::with_index(BufWriter::new(file.clone()), path, &head.origin, index)?;
    head.notes.iter().try_for_each(|note| writer.write_note(note))?;
    Ok(writer)
}

/// The next file, created.
struct NextFile {
    number: u64,
    path: PathBuf,
    file: LogFile,
}

/// Creates the file after that with `number`. Without `overwrite`, numbers are left out that another file has.
fn create_next(
    first: &Path,
    mut number: u64,
    overwrite: bool,
    progress: &Arc<Progress>,
) -> Result<NextFile, SeriesError> {
    loop {
        number += 1;
        let path = numbered(first, number);
        match LogFile::create(&path, overwrite, progress) {
            Ok(file) => return Ok(NextFile { number, path, file }),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(source) => {
                progress.note_problem(problem_of(&source));
                return Err(SeriesError::Create { path, source });
            }
        }
    }
}

fn add_counts(counts: &mut [(Channel, u64)], writer: &Writer<BufWriter<LogFile>>) {
    for (channel, count) in counts {
        *count += writer.count(*channel);
    }
}

/// Writes the index and waits until the whole file is on the disk.
fn complete(current: Current) -> Result<(), SeriesError> {
    let Current { writer, file, path, .. } = current;
    let refused = |source| SeriesError::Sync {
        path: path.clone(),
        source,
    };
    let buffer = writer.finish()?;
    buffer.into_inner().map_err(|error| refused(error.into_error()))?;
    file.sync().map_err(refused)
}

/// The name of the file with this number: `run.mcap`, `run.1.mcap`, …
fn numbered(first: &Path, number: u64) -> PathBuf {
    if number == 0 {
        return first.to_owned();
    }
    let mut name = first.file_stem().map_or_else(OsString::new, OsString::from);
    name.push(format!(".{number}"));
    if let Some(extension) = first.extension() {
        name.push(".");
        name.push(extension);
    }
    first.with_file_name(name)
}

#[cfg(test)]
mod tests;
