//! One run of a worm: crawl, show the telemetry, stop.

use super::child_process::Log;
use super::controller::order;
use super::processes::Processes;
use super::telemetry_receiver::{MODE_TIMEOUT, TelemetryReceiver};
use crate::failure::Failure;
use crate::topics::{CommandClient, Hub, Instance};
use crate::watch::Telemetry;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use worm_estimator::config::Config;
use worm_estimator::message::{CommandKind, Mode};

/// How often topics are read and the display is refreshed.
const FRAME: Duration = Duration::from_millis(50);

/// What shows the run, and takes the operator's keys.
pub(crate) trait Display {
    /// Waits for `time`; returns early, and true, when the operator asks to stop.
    fn wait_for_stop(&mut self, time: Duration) -> bool;

    /// Shows what is new.
    ///
    /// # Errors
    /// [`Failure::Failed`] when the terminal or standard output is gone.
    fn show(&mut self, telemetry: &Telemetry, log: &Log) -> Result<(), Failure>;
}

/// What a run came to.
pub(crate) struct CrawlOutcome {
    /// Everything that was received.
    pub telemetry: Telemetry,
    /// The controller's mode before the worm was stopped.
    pub mode: Mode,
    /// What went wrong, if anything.
    pub problem: Option<String>,
}

/// Makes the worm crawl for `duration`, or until `end` is set or the operator asks to stop, and stops it.
///
/// # Errors
/// [`Failure::Failed`] when the topics fail, or the worm does not begin to crawl.
pub(crate) fn run(
    duration: Option<Duration>,
    config: &Config,
    instance: &Instance,
    processes: &mut Processes,
    display: &mut impl Display,
    log: &Log,
    end: &AtomicBool,
) -> Result<CrawlOutcome, Failure> {
    let hub = Hub::open(instance).map_err(Failure::failed)?;
    let client = hub.command_client().map_err(Failure::failed)?;
    let mut receiver = TelemetryReceiver::open(&hub)?;
    let mut telemetry = Telemetry::default();

    receiver
        .start_crawling(&client, config, &mut telemetry, end, || {
            processes.find_ended().is_some()
        })
        .map_err(|failure| processes.find_ended().map_or(failure, Failure::failed))?;
    let begun = Instant::now();
    let mut problem = None;
    while !end.load(Ordering::Relaxed) && duration.is_none_or(|duration| begun.elapsed() < duration) {
        let left = duration.map_or(FRAME, |duration| duration.saturating_sub(begun.elapsed()).min(FRAME));
        if display.wait_for_stop(left) {
            break;
        }
        receiver.poll(&mut telemetry);
        problem = match display.show(&telemetry, log) {
            Ok(()) => processes.find_ended(),
            Err(failure) => Some(format!("{failure}; the worm was stopped")),
        };
        if problem.is_some() {
            break;
        }
    }
    let mode = receiver.mode(&mut telemetry);
    // Without a controller the servo's watchdog has stopped the worm.
    if processes.controller_exit_status().is_none() && !stop(&client, config, &mut receiver, &mut telemetry, processes)
    {
        problem.get_or_insert_with(|| "the worm did not report that it has stopped".to_owned());
    }
    if let Err(failure) = display.show(&telemetry, log) {
        problem.get_or_insert_with(|| failure.to_string());
    }
    Ok(CrawlOutcome {
        telemetry,
        mode,
        problem,
    })
}

/// Stops the worm; false when it did not report in time that it stands still.
fn stop(
    client: &CommandClient,
    config: &Config,
    receiver: &mut TelemetryReceiver,
    telemetry: &mut Telemetry,
    processes: &mut Processes,
) -> bool {
    if let Err(failure) = order(client, CommandKind::Stop) {
        // A worm in a fault has stopped already and refuses the command.
        tracing::debug!("{failure}");
    }
    receiver.wait_for(
        telemetry,
        MODE_TIMEOUT + Duration::from_secs_f64(config.gait.ramp_s),
        || processes.controller_exit_status().is_some(),
        |telemetry| {
            let mode = telemetry.state.map(|state| state.mode);
            [Mode::Disarmed, Mode::Fault]
                .iter()
                .any(|stopped| mode == Some(stopped.code()))
        },
    )
}
