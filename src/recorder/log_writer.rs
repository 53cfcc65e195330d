//! The thread that writes the log, with a queue in front of it for as long as a disk may stall.

use super::file_series::{FileOptions, FileSeries, SeriesError};
use super::log_file::{LogFile, creation_failure};
use super::progress::Progress;
use super::recorded_topics::Batch;
use crate::failure::Failure;
use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, bounded};
use std::path::Path;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use worm_log::{Channel, Origin};

/// Interval at which a chunk is finished and synchronised to disk: a killed recorder or a power loss costs at most this, and what is in the
/// queue. Longer chunks compress better, by 5 % from 0.2 s to this, and hardly beyond.
const SYNC_INTERVAL: Duration = Duration::from_secs(1);

/// Batches that may wait for the disk: 10 s of them. Beyond that the topics are not read, and in time lose their oldest messages.
const QUEUE: usize = 500;

/// The writing thread.
pub(super) struct LogWriter {
    queue: Sender<Batch>,
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
        origin: Origin,
        progress: &Arc<Progress>,
    ) -> Result<Self, Failure> {
        let file = LogFile::create(path, force, progress).map_err(|error| creation_failure(path, &error))?;
        if options.is_rotating() && !file.is_regular() {
            return Err(Failure::unusable(format!(
                "{} is no ordinary file, which no other can follow: leave out --max-size and --max-age",
                path.display()
            )));
        }
        let series = FileSeries::begin(path, file, force, origin, options, progress).map_err(Failure::failed)?;
        let (queue, batches) = bounded(QUEUE);
        let thread = std::thread::Builder::new()
            .name("log".to_owned())
            .spawn(move || write_batches(series, &batches))
            .map_err(Failure::failed)?;
        Ok(Self { queue, thread })
    }

    /// Queues a batch for the thread.
    ///
    /// # Errors
    /// When the thread has ended; [`LogWriter::close`] returns why.
    pub(super) fn write(&self, batch: Batch) -> Result<(), Failure> {
        self.queue.send(batch).map_err(|_| Self::stopped())
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

/// Writes batches until the queue is closed, and synchronises the file regularly.
fn write_batches(mut series: FileSeries, batches: &Receiver<Batch>) -> Result<Counts, SeriesError> {
    let mut unsynced_since: Option<Instant> = None;
    loop {
        let left = unsynced_since.map_or(SYNC_INTERVAL, |since| SYNC_INTERVAL.saturating_sub(since.elapsed()));
        match batches.recv_timeout(left) {
            Ok(batch) => {
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
