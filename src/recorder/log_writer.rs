//! The thread that writes the log, with a queue in front of it for as long as a disk may stall.

use super::carried::Finding;
use super::file_series::{FileOptions, FileSeries, SeriesError};
use super::log_file::{LogFile, creation_failure};
use super::log_head::LogHead;
use super::progress::Progress;
use super::recorded_topics::Batch;
use crate::failure::Failure;
use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, bounded};
use std::path::Path;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use worm_log::{Channel, Note};

/// Interval at which a chunk is finished and synchronised to disk: a killed recorder or a power loss costs at most this, and what is in the
/// queue. Longer chunks compress better, by 5 % from 0.2 s to this, and hardly beyond.
const SYNC_INTERVAL: Duration = Duration::from_secs(1);

/// Entries that may wait for the disk: 10 s of batches. Beyond that the topics are not read, and in time lose their oldest messages.
const QUEUE: usize = 500;

/// What the thread is to write.
enum Entry {
    Batch(Batch),
    Note(Note),
    Finding(Finding),
    /// From here on, the next file.
    Head(Box<LogHead>),
}

/// The writing thread.
pub(super) struct LogWriter {
    queue: Sender<Entry>,
    /// Whether another file can follow.
    can_be_followed: bool,
    thread: JoinHandle<Result<Counts, SeriesError>>,
}

/// Messages written, by channel.
pub(super) type Counts = Vec<(Channel, u64)>;

impl LogWriter {
    /// Begins the log.
    ///
    /// # Errors
    /// [`Failure::Unusable`] when the file exists and `force` is not set, or it cannot be created.
    pub(super) fn open(
        path: &Path,
        force: bool,
        options: FileOptions,
        head: LogHead,
        progress: &Arc<Progress>,
    ) -> Result<Self, Failure> {
        let file = LogFile::create(path, force, progress).map_err(|error| creation_failure(path, &error))?;
        let can_be_followed = file.is_regular();
        if options.is_rotating() && !can_be_followed {
            return Err(Failure::unusable(format!(
                "{} is no ordinary file, which no other can follow: leave out --max-size and --max-age",
                path.display()
            )));
        }
        let series = FileSeries::begin(path, file, force, head, options, progress).map_err(Failure::failed)?;
        let (queue, entries) = bounded(QUEUE);
        let thread = std::thread::Builder::new()
            .name("log".to_owned())
            .spawn(move || write_entries(series, &entries))
            .map_err(Failure::failed)?;
        Ok(Self {
            queue,
            can_be_followed,
            thread,
        })
    }

    /// Queues a batch for the thread.
    ///
    /// # Errors
    /// When the thread has ended; [`LogWriter::close`] returns why.
    pub(super) fn write(&self, batch: Batch) -> Result<(), Failure> {
        self.queue(Entry::Batch(batch))
    }

    /// Queues a note for the thread.
    ///
    /// # Errors
    /// As [`LogWriter::write`].
    pub(super) fn write_note(&self, note: Note) -> Result<(), Failure> {
        self.queue(Entry::Note(note))
    }

    /// Queues what was found out about the configuration.
    ///
    /// # Errors
    /// As [`LogWriter::write`].
    pub(super) fn write_finding(&self, finding: Finding) -> Result<(), Failure> {
        self.queue(Entry::Finding(finding))
    }

    /// Goes on in the next file, with another head.
    ///
    /// # Errors
    /// As [`LogWriter::write`]; and where no other file can follow this one.
    pub(super) fn go_on_with(&self, head: LogHead) -> Result<(), Failure> {
        if !self.can_be_followed {
            return Err(Failure::failed(
                "what comes now belongs into another file, and no other can follow this one: give an ordinary file with --out",
            ));
        }
        self.queue(Entry::Head(Box::new(head)))
    }

    fn queue(&self, entry: Entry) -> Result<(), Failure> {
        self.queue.send(entry).map_err(|_| Self::stopped())
    }

    /// Checks that the thread still writes, where there is nothing to write.
    ///
    /// # Errors
    /// As [`LogWriter::write`].
    pub(super) fn check(&self) -> Result<(), Failure> {
        if self.thread.is_finished() {
            return Err(Self::stopped());
        }
        Ok(())
    }

    fn stopped() -> Failure {
        Failure::failed("the log could not be written")
    }

    /// Finishes the log; returns how many messages each channel got.
    ///
    /// # Errors
    /// [`Failure::Failed`] when the file could not be completed; what was written until then can be read.
    pub(super) fn close(self) -> Result<Counts, Failure> {
        drop(self.queue);
        match self.thread.join() {
            Ok(counts) => counts.map_err(Failure::failed),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    }
}

/// Writes what comes until the queue is closed, and synchronises the file regularly.
fn write_entries(mut series: FileSeries, entries: &Receiver<Entry>) -> Result<Counts, SeriesError> {
    let mut unsynced_since: Option<Instant> = None;
    loop {
        let left = unsynced_since.map_or(SYNC_INTERVAL, |since| SYNC_INTERVAL.saturating_sub(since.elapsed()));
        match entries.recv_timeout(left) {
            Ok(Entry::Head(head)) => series = series.with_head(*head)?,
            Ok(Entry::Note(note)) => {
                series.write_note(&note)?;
                unsynced_since.get_or_insert_with(Instant::now);
            }
            Ok(Entry::Finding(finding)) => {
                series.write_finding(&finding)?;
                unsynced_since.get_or_insert_with(Instant::now);
            }
            Ok(Entry::Batch(batch)) => {
                series = series.prepared(Instant::now())?;
                series.write(&batch.states)?;
                series.write(&batch.timings)?;
                series.write(&batch.estimates)?;
                series.write(&batch.cycles)?;
                series.write(&batch.alarms)?;
                series.write(&batch.ranges)?;
                series.write(&batch.commands)?;
                series.write(&batch.trips)?;
                series.write(&batch.inferred)?;
                unsynced_since.get_or_insert_with(Instant::now);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        if unsynced_since.is_some_and(|since| since.elapsed() >= SYNC_INTERVAL) {
            series.sync()?;
            unsynced_since = None;
        }
    }
    series.finish()
}
