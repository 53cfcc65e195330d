//! The process around the black box: one thread reads the topics before they overwrite their oldest messages, another compresses
//! and writes, so that a slow disk delays the files and not the reading.

use super::folder::OwnFolder;
use super::keeper::{Figures, Keeper, Now};
use super::place;
use super::status::{Received, Reporter};
use crate::attendance::RoundCounter;
use crate::failure::Failure;
use crate::realtime::monotonic_ns;
use crate::recorder::{Batch, CarriedConfiguration, Finding, POLL_INTERVAL, RecordedTopics};
use crate::topics::{BlackBox as Role, Hub, Instance, RoleLock};
use crossbeam::channel::{Receiver, Sender, bounded};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};
use worm_estimator::config::Config;
use worm_log::{Channel, Origin, WriteError};

/// Looks at the topics that may wait for the disk: 10 s of them. Beyond that the topics are not read, and in time lose their oldest messages.
const QUEUE: usize = 500;

/// One look at the topics.
struct Look {
    batch: Batch,
    /// What was found out about the worm's configuration.
    finding: Option<Finding>,
    /// How long ago the one before was.
    since: Duration,
    now: Now,
}

/// The black box of a worm that may run.
pub(crate) struct BlackBox {
    // The ports before the hub that they are of.
    reporter: Reporter,
    topics: RecordedTopics,
    _hub: Hub,
    queue: Sender<Look>,
    thread: JoinHandle<Result<(), WriteError>>,
    figures: Arc<Mutex<Figures>>,
    looked: Instant,
    configuration: CarriedConfiguration,
    messages: u64,
}

impl BlackBox {
    /// Begins to listen; `text` is that of the configuration, which each file carries; without one it is that of the running worm.
    ///
    /// # Errors
    /// [`Failure::Unusable`] for a worm that has a black box already, and a folder that cannot be used; [`Failure::Failed`] when the topics fail.
    pub(crate) fn open(config: &Config, text: Option<String>, folder: &Path) -> Result<Self, Failure> {
        let instance = Instance::of(config).map_err(Failure::unusable)?;
        let settings = config.black_box.clone().unwrap_or_default();
        let now = now();
        let mut configuration = CarriedConfiguration::new(&instance, text.as_ref().map(|_| config));
        let origin = Origin {
            worm: config.worm.name.clone(),
            cells: config.worm.cells,
            config: text,
            begun: now.wall,
            begun_ns: now.monotonic_ns,
        };
        // A limit on the size of files then is a write error like others, and does not kill the process.
        signal_hook::flag::register(libc::SIGXFSZ, Arc::default()).map_err(Failure::failed)?;
        let role = RoleLock::<Role>::take(&instance).map_err(Failure::unusable)?;
        let folder = OwnFolder::take(folder).map_err(Failure::unusable)?;
        place::remember(config, folder.folder().path());
        let hub = Hub::open(&instance).map_err(Failure::failed)?;
        let topics = RecordedTopics::open(&hub, Channel::ALL)?;
        let reporter = Reporter::open(&hub, role).map_err(Failure::failed)?;
        let mut keeper = Keeper::new(folder, &settings, origin, now).map_err(Failure::failed)?;
        if let Some(finding) = configuration.look(false) {
            keeper.take_in(&finding);
        }
        let (queue, looks) = bounded(QUEUE);
        let figures = Arc::default();
        let shared = Arc::clone(&figures);
        let thread = std::thread::Builder::new()
            .name("black-box".to_owned())
            .spawn(move || keep(keeper, &looks, &shared))
            .map_err(Failure::failed)?;
        Ok(Self {
            reporter,
            topics,
            _hub: hub,
            queue,
            thread,
            figures,
            looked: Instant::now(),
            configuration,
            messages: 0,
        })
    }

    /// Runs until `end` is set, and counts how often it has read the topics.
    ///
    /// # Errors
    /// [`Failure::Failed`] when the topics fail.
    pub(crate) fn run(&mut self, end: &AtomicBool, rounds: &RoundCounter) -> Result<(), Failure> {
        while !end.load(Ordering::Relaxed) {
            std::thread::sleep(POLL_INTERVAL);
            rounds.count();
            self.look()?;
        }
        // What came before the signal to end belongs in it.
        self.look()
    }

    fn look(&mut self) -> Result<(), Failure> {
        let batch = self.topics.read()?;
        self.messages += batch.len() as u64;
        let since = self.looked.elapsed();
        self.looked = Instant::now();
        let look = Look {
            finding: self.configuration.look(batch.len() > 0),
            batch,
            since,
            now: now(),
        };
        self.queue
            .send(look)
            .map_err(|_| Failure::failed("the black box has ended"))?;
        let (figures, received) = (self.figures(), self.received());
        self.reporter.report(figures, received);
        Ok(())
    }

    fn figures(&self) -> Figures {
        *self.figures.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn received(&self) -> Received {
        let lost = Channel::ALL.iter().filter_map(|&channel| self.topics.lost(channel));
        Received {
            messages: self.messages,
            lost: lost.sum(),
        }
    }

    /// Completes what is under way and returns a summary.
    ///
    /// # Errors
    /// [`Failure::Failed`] when something could not be written; what was written until then can be read.
    pub(crate) fn close(self) -> Result<String, Failure> {
        let received = self.received();
        drop(self.queue);
        let closed = match self.thread.join() {
            Ok(closed) => closed,
            Err(panic) => std::panic::resume_unwind(panic),
        };
        let figures = *self.figures.lock().unwrap_or_else(PoisonError::into_inner);
        self.reporter.report_end(figures, received);
        closed.map_err(Failure::failed)?;
        if let Some(problem) = figures.problem {
            return Err(Failure::failed(format!(
                "not everything of the black box could be written ({problem}): make room; what was written can be read"
            )));
        }
        Ok(format!(
            "black box: {} boxes, {} messages ({} lost), {} bytes written",
            figures.boxes, received.messages, received.lost, figures.written_bytes
        ))
    }
}

fn now() -> Now {
    Now {
        monotonic_ns: monotonic_ns(),
        wall: SystemTime::now(),
    }
}

/// Takes looks until the queue is closed.
fn keep(mut keeper: Keeper, looks: &Receiver<Look>, figures: &Mutex<Figures>) -> Result<(), WriteError> {
    let share = |newest: Figures| *figures.lock().unwrap_or_else(PoisonError::into_inner) = newest;
    for look in looks {
        if let Some(finding) = &look.finding {
            keeper.take_in(finding);
        }
        keeper.take(&look.batch, look.since, look.now)?;
        share(keeper.figures());
    }
    share(keeper.close(now())?);
    Ok(())
}
