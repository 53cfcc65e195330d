//! The recorder process: the topics of a worm into a log.
//!
//! An ordinary subscriber at ordinary priority, which the loop does not notice. One thread reads the topics before they
//! overwrite their oldest messages, another ([`LogWriter`]) writes the files, so that a slow disk delays the log and not the
//! reading. A full disk or another write error ends the recording and nothing else: [`StatusReporter`] reports it, the estimator raises
//! the alarm `recording-stopped`, and what was written until then can be read.
//!
//! A worm of a robot elsewhere has no topics here: [`NetworkRecorder`] records what its relay sends.

mod carried;
mod file_series;
mod log_file;
mod log_head;
mod log_writer;
mod network;
mod progress;
mod recorded_topics;
mod status_reporter;
mod thin;

pub(crate) use carried::{CarriedConfiguration, Finding};
pub(crate) use file_series::FileOptions;
pub(crate) use log_file::problem_of;
pub(crate) use network::{NetworkRecorder, NetworkWorm};
pub(crate) use recorded_topics::{Batch, RecordedTopics};
pub(crate) use thin::Thinner;

use crate::attendance::RoundCounter;
use crate::failure::Failure;
use crate::topics::{Hub, Instance};
use log_head::{LogClock, LogHead};
use log_writer::{Counts, LogWriter};
use progress::Progress;
use status_reporter::{Figures, StatusReporter};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use worm_estimator::config::Config;
use worm_estimator::message::{RecordingProblem, State};
use worm_log::{Channel, Note, Origin};

/// How often the topics are emptied. At 1 kHz even the fullest holds a second.
pub(crate) const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// What is recorded, bit by bit.
pub(crate) trait Recording {
    /// Reads what is new and queues it for writing; returns how many messages that are.
    ///
    /// # Errors
    /// [`Failure::Failed`] when nothing more can be read or written.
    fn poll(&mut self) -> Result<usize, Failure>;
}

/// Records until `end` is set, or until `duration` has passed since the first message, and counts how often it has looked for new ones.
///
/// # Errors
/// As [`Recording::poll`].
pub(crate) fn record(
    recording: &mut impl Recording,
    duration: Option<Duration>,
    end: &AtomicBool,
    rounds: &RoundCounter,
) -> Result<(), Failure> {
    let mut first_message: Option<Instant> = None;
    let is_over = |first: Instant| duration.is_some_and(|duration| first.elapsed() >= duration);
    while !first_message.is_some_and(is_over) && !end.load(Ordering::Relaxed) {
        std::thread::sleep(POLL_INTERVAL);
        rounds.count();
        if recording.poll()? > 0 {
            first_message.get_or_insert_with(Instant::now);
        }
    }
    // What came before the signal to end belongs in the log.
    recording.poll().map(drop)
}

/// The topics of a worm on their way into a log.
pub(crate) struct Recorder {
    // The ports before the hub that they are of.
    status: StatusReporter,
    topics: RecordedTopics,
    hub: Hub,
    writer: LogWriter,
    thinner: Option<Thinner>,
    progress: Arc<Progress>,
    configuration: CarriedConfiguration,
    /// Results that were over before this time are of another run, ns of `CLOCK_MONOTONIC`.
    results_from_ns: u64,
    messages: u64,
}

/// What one poll of the topics read.
pub(crate) struct Polled {
    /// How many messages.
    pub messages: usize,
    /// The newest state among them.
    #[cfg_attr(
        not(feature = "analysis"),
        expect(dead_code, reason = "only `explain --live` reads it")
    )]
    pub state: Option<State>,
}

impl Recorder {
    /// Begins a log that carries the configuration's text, or without one that of the running worm; `force` overwrites existing files.
    ///
    /// # Errors
    /// [`Failure::Unusable`] for a worm or file that cannot be used; [`Failure::Failed`] when the topics fail.
    pub(crate) fn open(
        config: &Config,
        text: Option<String>,
        topics: &[Channel],
        out: &Path,
        force: bool,
        options: FileOptions,
    ) -> Result<Self, Failure> {
        let instance = Instance::of(config).map_err(Failure::unusable)?;
        let clock = LogClock::Own;
        let (begun, begun_ns) = clock.now();
        let mut configuration = CarriedConfiguration::new(&instance, text.as_ref().map(|_| config));
        let origin = Origin {
            worm: config.worm.name.clone(),
            cells: config.worm.cells,
            config: text,
            begun,
            begun_ns,
        };
        let mut head = LogHead {
            origin,
            clock,
            notes: Vec::new(),
        };
        if let Some(finding) = configuration.look(false) {
            head.take_in(&finding);
        }
        if let Some(rate_hz) = options.rate_hz {
            head.notes.push(Note::of(format!(
                "only {rate_hz} ticks and estimates a second were recorded (--rate): a replay cannot come to the same results"
            )));
        }
        take_full_files_as_errors()?;
        let hub = Hub::open(&instance).map_err(Failure::failed)?;
        let topics = RecordedTopics::open(&hub, topics)?;
        let progress = Arc::default();
        let writer = LogWriter::open(out, force, options, head, &progress)?;
        Ok(Self {
            status: StatusReporter::open(&hub, &instance),
            topics,
            hub,
            writer,
            thinner: options.rate_hz.map(Thinner::new),
            progress,
            configuration,
            results_from_ns: begun_ns,
            messages: 0,
        })
    }

    /// Reads what is new and queues it for writing. The topics hold at least a second of messages.
    ///
    /// # Errors
    /// [`Failure::Failed`] when the topics fail or the log cannot be written.
    pub(crate) fn poll(&mut self) -> Result<Polled, Failure> {
        let mut batch = self
            .topics
            .read()
            .inspect_err(|_| self.progress.note_problem(RecordingProblem::TopicsUnreadable))?;
        // A state of before may be the first one that is recorded, and what was made with it then belongs to it.
        let first_ns = batch.states.first().map_or(u64::MAX, |state| state.time_ns);
        self.results_from_ns = self.results_from_ns.min(first_ns);
        batch.leave_out_results_before(self.results_from_ns);
        let polled = Polled {
            messages: batch.len(),
            state: batch.states.last().copied(),
        };
        if polled.messages > 0 {
            if let Some(finding) = self.configuration.look(true) {
                self.writer.write_finding(finding)?;
            }
            let batch = match &mut self.thinner {
                Some(thinner) => thinner.thin(&batch),
                None => batch,
            };
            self.messages += batch.len() as u64;
            self.writer.write(batch)?;
        }
        self.writer.check()?;
        self.status.report(&self.hub, self.figures());
        Ok(polled)
    }

    fn figures(&self) -> Figures {
        Figures {
            bytes: self.progress.bytes(),
            files: self.progress.files(),
            messages: self.messages,
            messages_lost: Channel::ALL
                .iter()
                .filter_map(|&channel| self.topics.lost(channel))
                .sum(),
        }
    }

    /// Finishes the log and returns a summary of what is in it.
    ///
    /// # Errors
    /// [`Failure::Failed`] when the file could not be completed; what was written until then can be read.
    pub(crate) fn close(self) -> Result<String, Failure> {
        let figures = self.figures();
        let closed = self.writer.close();
        if closed.is_err() {
            self.progress.note_problem(RecordingProblem::WriteError);
        }
        // Counted once more: the writer has just written what was in its queue.
        let figures = Figures {
            bytes: self.progress.bytes(),
            files: self.progress.files(),
            ..figures
        };
        self.status.report_end(figures, self.progress.problem());
        Ok(summary(&closed?, |channel| self.topics.lost(channel)))
    }
}

impl Recording for Recorder {
    fn poll(&mut self) -> Result<usize, Failure> {
        Ok(Self::poll(self)?.messages)
    }
}

/// A limit on the size of files then is a write error like others, and does not kill the process.
fn take_full_files_as_errors() -> Result<(), Failure> {
    signal_hook::flag::register(libc::SIGXFSZ, Arc::default())
        .map(drop)
        .map_err(Failure::failed)
}

/// What was recorded, for the operator; `lost` says of which topics how many messages were lost.
fn summary(counts: &Counts, lost: impl Fn(Channel) -> Option<u64>) -> String {
    let counts = counts.iter().map(|&(channel, count)| {
        let lost = match lost(channel) {
            Some(lost) => format!(" ({lost} lost)"),
            None => String::new(),
        };
        format!("{} {count}{lost}", channel.name())
    });
    format!("recorded: {}", counts.collect::<Vec<_>>().join(", "))
}
