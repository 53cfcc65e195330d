//! The thread that writes the log, with a queue in front of it for as long as a disk may stall.

use crate::failure::Failure;
use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, bounded};
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use worm_estimator::message::{Alarm, Cycle, Estimate, State, Timing};
use worm_log::{Channel, Logged, Origin, WriteError, Writer};

/// Interval of the synchronisation to disk: a power loss costs at most this, and what is in the queue.
const SYNC_INTERVAL: Duration = Duration::from_millis(200);

/// Batches that may wait for the disk: 10 s of them. Beyond that the topics are not read, and in time lose their oldest messages.
const QUEUE: usize = 500;

/// The new messages of one poll.
#[derive(Debug, Default)]
pub(super) struct Batch {
    pub states: Vec<State>,
    pub timings: Vec<Timing>,
    pub estimates: Vec<Estimate>,
    pub cycles: Vec<Cycle>,
    pub alarms: Vec<Alarm>,
}

impl Batch {
    /// How many messages.
    pub(super) fn len(&self) -> usize {
        self.states.len() + self.timings.len() + self.estimates.len() + self.cycles.len() + self.alarms.len()
    }
}

/// The writing thread.
pub(super) struct LogWriter {
    queue: Sender<Batch>,
    thread: JoinHandle<Result<Counts, Failure>>,
}

/// Messages written, by channel.
pub(super) type Counts = Vec<(Channel, u64)>;

impl LogWriter {
    /// Begins the log.
    ///
    /// # Errors
    /// [`Failure::Unusable`] when the file exists and `force` is not set, or it cannot be created.
    pub(super) fn open(path: &Path, force: bool, origin: &Origin) -> Result<Self, Failure> {
        let mut options = File::options();
        options.write(true).create(true).truncate(true).create_new(!force);
        let file = options.open(path).map_err(|error| {
            let name = path.display();
            Failure::unusable(match error.kind() {
                io::ErrorKind::AlreadyExists => {
                    format!("{name} exists already: choose another name, or overwrite it with `wormd record --force`")
                }
                _ => format!("{name} cannot be written: {error}: choose another place"),
            })
        })?;
        let synced = file.try_clone().map_err(Failure::failed)?;
        let writer = Writer::new(BufWriter::new(file), path, origin).map_err(Failure::failed)?;
        let (queue, batches) = bounded(QUEUE);
        let path = path.to_owned();
        let thread = std::thread::Builder::new()
            .name("log".to_owned())
            .spawn(move || {
                write_batches(writer, &synced, &batches).map_err(|error| match error {
                    Stopped::Write(error) => Failure::failed(error),
                    Stopped::Sync(error) => {
                        Failure::failed(format!("{}: {error}: is the disk still there?", path.display()))
                    }
                })
            })
            .map_err(Failure::failed)?;
        Ok(Self { queue, thread })
    }

    /// Queues a batch for the thread.
    ///
    /// # Errors
    /// When the thread has ended; [`LogWriter::close`] returns why.
    pub(super) fn write(&self, batch: Batch) -> Result<(), Failure> {
        self.queue
            .send(batch)
            .map_err(|_| Failure::failed("the log could not be written"))
    }

    /// Finishes the log; returns how many messages each channel got.
    ///
    /// # Errors
    /// [`Failure::Failed`] when the file could not be completed; what was written until then can be read.
    pub(super) fn close(self) -> Result<Counts, Failure> {
        drop(self.queue);
        match self.thread.join() {
            Ok(counts) => counts,
            Err(panic) => std::panic::resume_unwind(panic),
        }
    }
}

/// What stopped the writing.
enum Stopped {
    Write(WriteError),
    Sync(io::Error),
}

impl From<WriteError> for Stopped {
    fn from(error: WriteError) -> Self {
        Self::Write(error)
    }
}

/// Writes batches until the queue is closed, and synchronises the file regularly.
fn write_batches(
    mut writer: Writer<BufWriter<File>>,
    file: &File,
    batches: &Receiver<Batch>,
) -> Result<Counts, Stopped> {
    let mut unsynced_since: Option<Instant> = None;
    loop {
        let left = unsynced_since.map_or(SYNC_INTERVAL, |since| SYNC_INTERVAL.saturating_sub(since.elapsed()));
        match batches.recv_timeout(left) {
            Ok(batch) => {
                write_all(&mut writer, &batch.states)?;
                write_all(&mut writer, &batch.timings)?;
                write_all(&mut writer, &batch.estimates)?;
                write_all(&mut writer, &batch.cycles)?;
                write_all(&mut writer, &batch.alarms)?;
                unsynced_since.get_or_insert_with(Instant::now);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        if unsynced_since.is_some_and(|since| since.elapsed() >= SYNC_INTERVAL) {
            writer.flush()?;
            file.sync_data().map_err(Stopped::Sync)?;
            unsynced_since = None;
        }
    }
    let counts = Channel::ALL
        .iter()
        .map(|&channel| (channel, writer.count(channel)))
        .collect();
    writer.finish()?;
    file.sync_all().map_err(Stopped::Sync)?;
    Ok(counts)
}

fn write_all<T: Logged>(writer: &mut Writer<BufWriter<File>>, messages: &[T]) -> Result<(), WriteError> {
    messages.iter().try_for_each(|message| writer.write(message))
}
