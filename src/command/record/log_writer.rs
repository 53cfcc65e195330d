//! Where the log is written: a thread with the file, and a queue before it for as long as a disk may stand still.

use super::TelemetryReceiver;
use crate::command::Failure;
use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, bounded};
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use worm_estimator::message::{Alarm, Cycle, Estimate, State, Timing};
use worm_log::{Channel, Logged, Origin, WriteError, Writer};

/// How often what was written is made safe from a power loss. At most this is lost, and what the queue holds.
const SAFE_EVERY: Duration = Duration::from_millis(200);

/// Batches that may wait for the disk: 10 s of them. When they are full, the topics wait, and then lose their oldest.
const QUEUE: usize = 500;

/// What the topics held.
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

/// The thread that writes.
pub(super) struct LogWriter {
    queue: Sender<Batch>,
    thread: JoinHandle<Result<Counts, Failure>>,
}

/// Messages written, by channel.
type Counts = Vec<(Channel, u64)>;

impl LogWriter {
    /// Begins the log.
    ///
    /// # Errors
    /// [`Failure::Unusable`] when there is such a file and `force` does not say to write over it, or it cannot be made.
    pub(super) fn open(path: &Path, force: bool, origin: &Origin) -> Result<Self, Failure> {
        let mut options = File::options();
        options.write(true).create(true).truncate(true).create_new(!force);
        let file = options.open(path).map_err(|error| {
            let name = path.display();
            Failure::unusable(match error.kind() {
                io::ErrorKind::AlreadyExists => {
                    format!(
                        "{name} is there already: choose another name, or write over it with `wormd record --force`"
                    )
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
                write(writer, &synced, &batches).map_err(|error| match error {
                    Refused::Write(error) => Failure::failed(error),
                    Refused::Sync(error) => {
                        Failure::failed(format!("{}: {error}: is the disk still there?", path.display()))
                    }
                })
            })
            .map_err(Failure::failed)?;
        Ok(Self { queue, thread })
    }

    /// Hands a batch to the thread.
    ///
    /// # Errors
    /// When the thread has ended; [`LogWriter::close`] tells why.
    pub(super) fn take(&self, batch: Batch) -> Result<(), Failure> {
        self.queue
            .send(batch)
            .map_err(|_| Failure::failed("the log could not be written on"))
    }

    /// Finishes the log and says what is in it.
    ///
    /// # Errors
    /// [`Failure::Failed`] when the file could not be written to its end; what was written before can be read.
    pub(super) fn close(self, receiver: &TelemetryReceiver) -> Result<String, Failure> {
        drop(self.queue);
        let counts = match self.thread.join() {
            Ok(counts) => counts?,
            Err(panic) => std::panic::resume_unwind(panic),
        };
        let counts = counts.iter().map(|&(channel, count)| {
            let lost = match receiver.lost(channel) {
                Some(lost) => format!(" ({lost} lost)"),
                None => String::new(),
            };
            format!("{} {count}{lost}", channel.name())
        });
        Ok(format!("recorded: {}", counts.collect::<Vec<_>>().join(", ")))
    }
}

enum Refused {
    Write(WriteError),
    Sync(io::Error),
}

impl From<WriteError> for Refused {
    fn from(error: WriteError) -> Self {
        Self::Write(error)
    }
}

/// Writes what comes until nothing will come any more.
fn write(mut writer: Writer<BufWriter<File>>, file: &File, batches: &Receiver<Batch>) -> Result<Counts, Refused> {
    let mut unsafe_since: Option<Instant> = None;
    loop {
        let left = unsafe_since.map_or(SAFE_EVERY, |since| SAFE_EVERY.saturating_sub(since.elapsed()));
        match batches.recv_timeout(left) {
            Ok(batch) => {
                write_all(&mut writer, &batch.states)?;
                write_all(&mut writer, &batch.timings)?;
                write_all(&mut writer, &batch.estimates)?;
                write_all(&mut writer, &batch.cycles)?;
                write_all(&mut writer, &batch.alarms)?;
                unsafe_since.get_or_insert_with(Instant::now);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        if unsafe_since.is_some_and(|since| since.elapsed() >= SAFE_EVERY) {
            writer.flush()?;
            file.sync_data().map_err(Refused::Sync)?;
            unsafe_since = None;
        }
    }
    let counts = Channel::ALL
        .iter()
        .map(|&channel| (channel, writer.count(channel)))
        .collect();
    writer.finish()?;
    file.sync_all().map_err(Refused::Sync)?;
    Ok(counts)
}

fn write_all<T: Logged>(writer: &mut Writer<BufWriter<File>>, messages: &[T]) -> Result<(), WriteError> {
    messages.iter().try_for_each(|message| writer.write(message))
}
