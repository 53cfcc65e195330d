//! One run of a worm: crawl, show the telemetry, stop.
//!
//! The thread that runs this attends to the worm: it looks at signals, keys, time and processes, and renews the controller's lease.
//! It never writes to a terminal; who shows the run does that in a thread of its own.

use super::child_process::Log;
use super::controller::order;
use super::processes::Processes;
use super::telemetry_receiver::{MODE_TIMEOUT, TelemetryReceiver};
use crate::failure::Failure;
use crate::topics::{CommandClient, Hub, Instance};
use crate::watch::Telemetry;
use nix::sys::signal::{Signal, raise};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use worm_estimator::config::Config;
use worm_estimator::message::{CommandKind, Mode};

/// How often topics are read and the lease is renewed.
const FRAME: Duration = Duration::from_millis(50);

/// What the operator wants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Wish {
    /// That it goes on.
    GoOn,
    /// That the worm stops.
    Stop,
    /// That this process is suspended.
    Suspend,
}

/// What shows the run, and takes the operator's keys. Nothing here may wait for a terminal.
pub(crate) trait Display {
    /// Waits for `time`; returns early with a wish.
    fn wait_for_wish(&mut self, time: Duration) -> Wish;

    /// Why nothing can be shown any more: the terminal or standard output is gone.
    fn problem(&self) -> Option<String>;

    /// Leaves the terminal to others.
    fn suspend(&mut self);

    /// Takes it again.
    fn resume(&mut self);
}

/// The telemetry, shared with the thread that shows it.
#[derive(Debug, Clone, Default)]
pub(crate) struct SharedTelemetry(Arc<Mutex<Telemetry>>);

impl SharedTelemetry {
    /// The telemetry. Nobody keeps it while writing to a terminal.
    pub(crate) fn lock(&self) -> MutexGuard<'_, Telemetry> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// When a run ends, and what interrupts it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits<'a> {
    /// How long the worm crawls; without it, until it is stopped.
    pub duration: Option<Duration>,
    /// Set to end the run.
    pub end: &'a AtomicBool,
    /// Set to suspend this process.
    pub suspend: &'a AtomicBool,
}

/// What a run came to.
pub(crate) struct CrawlOutcome {
    /// The controller's mode before the worm was stopped.
    pub mode: Mode,
    /// What went wrong, if anything.
    pub problem: Option<String>,
}

/// Makes the worm crawl within the limits, or until the operator asks to stop, and stops it.
///
/// # Errors
/// [`Failure::Failed`] when the topics fail, or the worm does not begin to crawl.
pub(crate) fn run(
    limits: Limits<'_>,
    config: &Config,
    instance: &Instance,
    processes: &mut Processes,
    display: &mut impl Display,
    telemetry: &SharedTelemetry,
    log: &Log,
) -> Result<CrawlOutcome, Failure> {
    let hub = Hub::open(instance).map_err(Failure::failed)?;
    let client = hub.command_client().map_err(Failure::failed)?;
    let mut receiver = TelemetryReceiver::open(&hub)?;

    let mut received = Telemetry::default();
    receiver
        .start_crawling(&client, config, &mut received, limits.end, || {
            processes.renew_lease();
            processes.find_ended().is_some()
        })
        .map_err(|failure| processes.find_ended().map_or(failure, Failure::failed))?;
    *telemetry.lock() = received;
    let mut run = Run {
        config,
        client,
        receiver,
        processes,
        telemetry,
        log,
    };
    let problem = run.attend(limits, display);
    let mode = run.mode();
    // Without a controller the servo's watchdog has stopped the worm.
    let is_stopped = run.processes.controller_exit_status().is_some() || run.stop();
    let problem = problem.or_else(|| (!is_stopped).then(|| "the worm did not report that it has stopped".to_owned()));
    Ok(CrawlOutcome { mode, problem })
}

/// A crawling worm.
struct Run<'a> {
    config: &'a Config,
    client: CommandClient,
    receiver: TelemetryReceiver,
    processes: &'a mut Processes,
    telemetry: &'a SharedTelemetry,
    log: &'a Log,
}

impl Run<'_> {
    /// Attends to the worm until the run is over; returns what went wrong, if anything.
    fn attend(&mut self, limits: Limits<'_>, display: &mut impl Display) -> Option<String> {
        let lease = Duration::from_secs_f64(self.config.control.lease_s);
        let begun = Instant::now();
        let mut attended = begun;
        while !limits.end.load(Ordering::Relaxed) && limits.duration.is_none_or(|duration| begun.elapsed() < duration) {
            self.processes.renew_lease();
            let left = limits
                .duration
                .map_or(FRAME, |duration| duration.saturating_sub(begun.elapsed()).min(FRAME));
            let wish = display.wait_for_wish(left);
            if wish == Wish::Stop {
                break;
            }
            let is_suspended = limits.suspend.swap(false, Ordering::Relaxed) || wish == Wish::Suspend;
            if is_suspended {
                self.suspend(display);
            }
            self.receiver.poll(&mut self.telemetry.lock());
            // Somebody may also have stopped this process without asking.
            if (is_suspended || attended.elapsed() > lease) && self.mode() == Mode::Holding {
                self.log.note(
                    "up",
                    "this process was suspended, and the worm holds: `wormd command crawl` makes it go on, Ctrl-C ends it".to_owned(),
                );
            }
            attended = Instant::now();
            let problem = match display.problem() {
                Some(problem) => Some(format!("{problem}; the worm was stopped")),
                None => self.processes.find_ended(),
            };
            if problem.is_some() {
                return problem;
            }
        }
        None
    }

    /// Makes the worm hold and suspends this process, until somebody continues it.
    fn suspend(&mut self, display: &mut impl Display) {
        if let Err(failure) = order(&self.client, CommandKind::Hold) {
            // A worm that does not crawl needs no hold.
            tracing::debug!("{failure}");
        }
        let ramp = Duration::from_secs_f64(self.config.gait.ramp_s);
        self.wait_for_modes(ramp + FRAME, &[Mode::Holding, Mode::Disarmed, Mode::Fault]);
        display.suspend();
        if let Err(errno) = raise(Signal::SIGSTOP) {
            tracing::warn!("this process cannot be suspended: {errno}");
        }
        display.resume();
    }

    fn mode(&mut self) -> Mode {
        self.receiver.mode(&mut self.telemetry.lock())
    }

    /// Stops the worm; false when it did not report in time that it stands still.
    fn stop(&mut self) -> bool {
        if let Err(failure) = order(&self.client, CommandKind::Stop) {
            // A worm in a fault has stopped already and may refuse the command.
            tracing::debug!("{failure}");
        }
        let ramp = Duration::from_secs_f64(self.config.gait.ramp_s);
        self.wait_for_modes(MODE_TIMEOUT + ramp, &[Mode::Disarmed, Mode::Fault])
    }

    /// Waits for one of these modes, or the controller's end; false when neither comes in time.
    fn wait_for_modes(&mut self, timeout: Duration, modes: &[Mode]) -> bool {
        let processes = &mut *self.processes;
        let mut telemetry = self.telemetry.lock();
        self.receiver.wait_for(
            &mut telemetry,
            timeout,
            || {
                processes.renew_lease();
                processes.controller_exit_status().is_some()
            },
            |telemetry| {
                let mode = telemetry.state.map(|state| state.mode);
                modes.iter().any(|wanted| mode == Some(wanted.code()))
            },
        )
    }
}
