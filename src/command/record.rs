//! `wormd record`: the topics of a worm into a log.
//!
//! An ordinary subscriber at ordinary priority: the loop does not know of it. One thread takes what the topics hold before
//! they must forget it, another (`log_writer`) writes, so that a slow disk delays the log and not the listening.

mod log_writer;

use super::{Failure, WormArgs, end_on_signal, positive_seconds, print};
use crate::topics::{Hub, Instance, Subscriber, Topic};
use clap::Args;
use log_writer::{Batch, LogWriter};
use nix::time::{ClockId, clock_gettime};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant, SystemTime};
use worm_estimator::config::Config;
use worm_estimator::message::{Alarm, Cycle, Estimate, State, Timing};
use worm_log::{Channel, Logged, Origin};

/// How often the topics are emptied. At 1 kHz the fullest holds a second.
pub(super) const LOOK: Duration = Duration::from_millis(20);

/// Arguments of `wormd record`.
#[derive(Debug, Args)]
pub struct RecordArgs {
    #[command(flatten)]
    worm: WormArgs,
    /// The log, an MCAP file
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Write over a file that is there already
    #[arg(long)]
    force: bool,
    /// End after this time, counted from the first message; without it, on Ctrl-C
    #[arg(long, value_name = "SECONDS", value_parser = positive_seconds)]
    duration: Option<Duration>,
    /// Only these topics
    #[arg(long, value_name = "TOPIC,…", value_delimiter = ',', value_parser = channel, default_value = "state,timing,estimate,cycle,alarm")]
    topics: Vec<Channel>,
}

fn channel(name: &str) -> Result<Channel, String> {
    Channel::from_name(name).ok_or_else(|| {
        let names: Vec<_> = Channel::ALL.iter().map(|channel| channel.name()).collect();
        format!(
            "there is no topic of this name to record: give some of {}",
            names.join(", ")
        )
    })
}

/// Runs `wormd record` until it is told to end. When it listens it says so on one line of standard output.
///
/// # Errors
/// [`Failure::Unusable`] for a configuration, worm or file that cannot be used; [`Failure::Failed`] when the topics fail or
/// the file cannot be written on.
pub fn run(args: &RecordArgs) -> Result<(), Failure> {
    let (config, text) = args.worm.load_with_text()?;
    let end = end_on_signal()?;
    let mut recorder = Recorder::open(&config, text, &args.topics, &args.out, args.force)?;
    let (worm, file) = (&config.worm.name, args.out.display());
    print::log_line(format_args!("{worm} is recorded to {file}, from its first message on"));
    // One who does not want to know when it is ready may have closed the pipe.
    let _ = print::line("ready");

    let mut first_heard: Option<Instant> = None;
    let mut hear = |recorder: &mut Recorder| {
        let heard = recorder.hear()?;
        if heard.messages > 0 {
            first_heard.get_or_insert_with(Instant::now);
        }
        let is_over = |first: Instant| args.duration.is_some_and(|duration| first.elapsed() >= duration);
        Ok(first_heard.is_some_and(is_over))
    };
    let mut is_over = Ok(false);
    while matches!(is_over, Ok(false)) && !end.load(Ordering::Relaxed) {
        std::thread::sleep(LOOK);
        is_over = hear(&mut recorder);
    }
    // What came until the word to end belongs to the log.
    let heard = is_over.and_then(|_| hear(&mut recorder));
    print::log_line(recorder.close()?);
    heard.map(|_| ())
}

/// The topics of a worm on their way into a log.
pub(super) struct Recorder {
    receiver: TelemetryReceiver,
    writer: LogWriter,
}

/// What was heard at once.
pub(super) struct Heard {
    /// How many messages.
    pub messages: usize,
    /// The newest state among them.
    #[cfg_attr(
        not(feature = "analysis"),
        expect(dead_code, reason = "`explain --live` alone looks at it")
    )]
    pub state: Option<State>,
}

impl Recorder {
    /// Begins a log with the configuration's text in it; `force` writes over a file that is there.
    ///
    /// # Errors
    /// [`Failure::Unusable`] for a worm or file that cannot be used; [`Failure::Failed`] when the topics fail.
    pub(super) fn open(
        config: &Config,
        text: Option<String>,
        topics: &[Channel],
        out: &Path,
        force: bool,
    ) -> Result<Self, Failure> {
        let instance = Instance::of(config).map_err(Failure::unusable)?;
        let now = clock_gettime(ClockId::CLOCK_MONOTONIC).map_err(Failure::failed)?;
        let origin = Origin {
            worm: config.worm.name.clone(),
            cells: config.worm.cells,
            config: text,
            begun: SystemTime::now(),
            begun_ns: Duration::from(now).as_nanos() as u64,
        };
        Ok(Self {
            receiver: TelemetryReceiver::open(&instance, topics)?,
            writer: LogWriter::open(out, force, &origin)?,
        })
    }

    /// Takes what is new and hands it on. The topics hold a second of it at least.
    ///
    /// # Errors
    /// [`Failure::Failed`] when the topics fail or the log cannot be written on.
    pub(super) fn hear(&mut self) -> Result<Heard, Failure> {
        let batch = self.receiver.listen()?;
        let heard = Heard {
            messages: batch.len(),
            state: batch.states.last().copied(),
        };
        if heard.messages > 0 {
            self.writer.take(batch)?;
        }
        Ok(heard)
    }

    /// Finishes the log and says what is in it.
    ///
    /// # Errors
    /// [`Failure::Failed`] when the file could not be written to its end; what was written before can be read.
    pub(super) fn close(self) -> Result<String, Failure> {
        self.writer.close(&self.receiver)
    }
}

/// One topic, if it is wanted.
type Ear<T> = Option<Subscriber<T>>;

/// The topics that are recorded.
struct TelemetryReceiver {
    state: Ear<State>,
    timing: Ear<Timing>,
    estimate: Ear<Estimate>,
    cycle: Ear<Cycle>,
    alarm: Ear<Alarm>,
}

impl TelemetryReceiver {
    fn open(instance: &Instance, topics: &[Channel]) -> Result<Self, Failure> {
        fn ear<T: Topic + Logged>(hub: &Hub, topics: &[Channel]) -> Result<Ear<T>, Failure> {
            let wanted = topics.contains(&T::CHANNEL);
            wanted.then(|| hub.subscriber()).transpose().map_err(Failure::failed)
        }
        let hub = Hub::open(instance).map_err(Failure::failed)?;
        Ok(Self {
            state: ear(&hub, topics)?,
            timing: ear(&hub, topics)?,
            estimate: ear(&hub, topics)?,
            cycle: ear(&hub, topics)?,
            alarm: ear(&hub, topics)?,
        })
    }

    fn listen(&mut self) -> Result<Batch, Failure> {
        fn take<T: Topic>(ear: &mut Ear<T>) -> Result<Vec<T>, Failure> {
            let mut messages = Vec::new();
            if let Some(subscriber) = ear {
                while let Some(message) = subscriber.next().map_err(Failure::failed)? {
                    messages.push(*message);
                }
            }
            Ok(messages)
        }
        Ok(Batch {
            states: take(&mut self.state)?,
            timings: take(&mut self.timing)?,
            estimates: take(&mut self.estimate)?,
            cycles: take(&mut self.cycle)?,
            alarms: take(&mut self.alarm)?,
        })
    }

    /// How many messages of a topic never arrived; none where it is not recorded, or not numbered.
    fn lost(&self, channel: Channel) -> Option<u64> {
        match channel {
            Channel::State => self.state.as_ref().map(Subscriber::lost),
            Channel::Timing => self.timing.as_ref().map(Subscriber::lost),
            Channel::Estimate => None,
            Channel::Cycle => self.cycle.as_ref().map(Subscriber::lost),
            Channel::Alarm => self.alarm.as_ref().map(Subscriber::lost),
        }
    }
}
