//! What a service manager, such as systemd, learns about a process that it has started (sd_notify(3)): that it is ready, how it
//! stands, that its main loop goes round, and that it ends.
//!
//! A thread of its own says all that. It looks at a counter that the main loop keeps anyway, so the loop talks to nobody and waits for
//! nobody; and a loop that hangs is not fed, however well this thread does.

use crate::failure::Failure;
use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, bounded};
use sd_notify::NotifyState;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How often the thread looks at the process, or four times in the watchdog's time where that is shorter.
const LOOK: Duration = Duration::from_millis(50);

/// Counts the rounds of a main loop.
#[derive(Debug, Clone, Default)]
pub(crate) struct RoundCounter(Arc<AtomicU64>);

impl RoundCounter {
    /// One more round.
    pub(crate) fn count(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    /// Rounds so far.
    pub(crate) fn rounds(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}

/// How a process stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ProcessStatus {
    /// Rounds of its main loop; it is ready with the first.
    pub(crate) rounds: u64,
    /// How it stands, in words; empty for nothing to say.
    pub(crate) words: String,
}

/// The thread that informs the service manager, if one has started this process. Dropping it says that the process ends.
#[derive(Debug)]
pub(crate) struct ServiceManager {
    thread: Option<(Sender<()>, JoinHandle<()>)>,
}

impl ServiceManager {
    /// Informs the service manager from now on of what `look` sees; `end` is the flag that ends the process.
    ///
    /// # Errors
    /// [`Failure::Failed`] when there is no thread to be had.
    pub(crate) fn inform(
        end: &Arc<AtomicBool>,
        look: impl Fn() -> ProcessStatus + Send + 'static,
    ) -> Result<Self, Failure> {
        if std::env::var_os("NOTIFY_SOCKET").is_none() {
            return Ok(Self { thread: None });
        }
        let (over, is_over) = bounded(0);
        let end = Arc::clone(end);
        let thread = std::thread::Builder::new()
            .name("service".to_owned())
            .spawn(move || inform(&is_over, &end, look))
            .map_err(|error| Failure::failed(format!("no thread can be started: {error}")))?;
        Ok(Self {
            thread: Some((over, thread)),
        })
    }

    /// As [`inform`](Self::inform), of a process about which there is nothing more to say.
    ///
    /// # Errors
    /// As [`inform`](Self::inform).
    pub(crate) fn inform_of_rounds(end: &Arc<AtomicBool>, rounds: &RoundCounter) -> Result<Self, Failure> {
        let rounds = rounds.clone();
        Self::inform(end, move || ProcessStatus {
            rounds: rounds.rounds(),
            words: String::new(),
        })
    }
}

impl Drop for ServiceManager {
    fn drop(&mut self) {
        if let Some((over, thread)) = self.thread.take() {
            drop(over);
            // A panic of the thread has been reported by the panic itself.
            let _ = thread.join();
        }
    }
}

/// Says to the service manager that this process is ready: for one without a watchdog.
pub(crate) fn announce_ready() {
    send(&[NotifyState::Ready]);
}

fn inform(is_over: &Receiver<()>, end: &AtomicBool, look: impl Fn() -> ProcessStatus) {
    let watchdog = sd_notify::watchdog_enabled();
    let interval = watchdog.map_or(LOOK, |watchdog| LOOK.min(watchdog / 4));
    let begun = Instant::now();
    let mut reporter = Reporter::new(watchdog);
    loop {
        let is_over = is_over.recv_timeout(interval) != Err(RecvTimeoutError::Timeout);
        let is_ending = is_over || end.load(Ordering::Relaxed);
        send(&reporter.messages(begun.elapsed(), look(), is_ending));
        if is_over {
            return;
        }
    }
}

fn send(messages: &[NotifyState]) {
    if !messages.is_empty()
        && let Err(error) = sd_notify::notify(messages)
    {
        tracing::debug!("the service manager was not informed: {error}");
    }
}

/// Decides what there is to say. Its times count from any moment.
#[derive(Debug)]
struct Reporter {
    watchdog: Option<Duration>,
    words: String,
    /// When the watchdog was last fed, and the rounds by then; absent: not ready yet.
    fed: Option<(Duration, u64)>,
    is_stopping: bool,
}

impl Reporter {
    fn new(watchdog: Option<Duration>) -> Self {
        Self {
            watchdog,
            words: String::new(),
            fed: None,
            is_stopping: false,
        }
    }

    fn messages(&mut self, now: Duration, status: ProcessStatus, is_ending: bool) -> Vec<NotifyState<'_>> {
        let ProcessStatus { rounds, words } = status;
        let mut messages = Vec::new();
        match (self.fed, self.watchdog) {
            (None, _) if rounds > 0 && !is_ending => {
                messages.push(NotifyState::Ready);
                self.fed = Some((now, rounds));
            }
            // Four times as often as must be, and only for rounds that were not counted yet.
            (Some((fed, counted)), Some(watchdog)) if rounds != counted && now.saturating_sub(fed) >= watchdog / 4 => {
                messages.push(NotifyState::Watchdog);
                self.fed = Some((now, rounds));
            }
            _ => {}
        }
        if is_ending && self.fed.is_some() && !std::mem::replace(&mut self.is_stopping, true) {
            messages.push(NotifyState::Stopping);
        }
        if words != self.words {
            self.words = words;
            messages.push(NotifyState::Status(&self.words));
        }
        messages
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_follows_the_rounds_and_not_the_clock() {
        let mut reporter = Reporter::new(Some(Duration::from_secs(4)));
        for (now_s, rounds, words, is_ending, said) in [
            (0.0, 0, "starting", false, &["STATUS=starting"][..]),
            (9.0, 0, "starting", false, &[]),
            (9.1, 1, "disarmed", false, &["READY=1", "STATUS=disarmed"]),
            // Not more often than four times in the watchdog's time.
            (9.2, 100, "disarmed", false, &[]),
            (10.1, 1000, "crawling", false, &["WATCHDOG=1", "STATUS=crawling"]),
            // A loop that stands still.
            (11.2, 1000, "crawling", false, &[]),
            (99.0, 1000, "crawling", false, &[]),
            (99.1, 1001, "crawling", false, &["WATCHDOG=1"]),
            // A worm takes its time to come to rest, in which the loop goes on.
            (99.2, 1100, "stopping", true, &["STOPPING=1", "STATUS=stopping"]),
            (101.0, 3000, "disarmed", true, &["WATCHDOG=1", "STATUS=disarmed"]),
            (103.0, 3000, "disarmed", true, &[]),
        ] {
            let status = ProcessStatus {
                rounds,
                words: words.to_owned(),
            };
            let messages = reporter.messages(Duration::from_secs_f64(now_s), status, is_ending);
            let messages: Vec<String> = messages.iter().map(ToString::to_string).collect();
            assert_eq!(messages, said, "at {now_s} s");
        }
    }

    #[test]
    fn without_a_watchdog_nothing_is_fed_and_what_never_was_ready_does_not_stop() {
        let status = |rounds| ProcessStatus {
            rounds,
            words: String::new(),
        };
        let mut reporter = Reporter::new(None);
        assert_eq!(reporter.messages(Duration::ZERO, status(1), false).len(), 1);
        assert!(reporter.messages(Duration::from_secs(60), status(2), false).is_empty());

        let mut reporter = Reporter::new(None);
        assert!(reporter.messages(Duration::ZERO, status(0), true).is_empty());
    }
}
