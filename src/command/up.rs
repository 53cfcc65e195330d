//! `wormd up`: the main job. Starts the processes of a worm, makes it crawl, shows what it does, stops it in order, sums up.

mod screen;

use super::child_process::{Child, Log, START_PATIENCE};
use super::send_command::give;
use super::telemetry_receiver::{MODE_PATIENCE, TelemetryReceiver};
use super::{Failure, WormArgs, end_on_signal, positive_seconds, print};
use crate::topics::{CommandClient, Hub, Instance, RoleLock, Supervisor};
use crate::watch::{Summary, Telemetry};
use clap::Args;
use screen::{Screen, Wish};
use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use worm_estimator::config::Config;
use worm_estimator::message::{AlarmKind, CommandKind, Fault, Mode};

/// How often topics are read and the picture is painted.
const FRAME: Duration = Duration::from_millis(50);

/// Arguments of `wormd up`.
#[derive(Debug, Args)]
pub struct UpArgs {
    #[command(flatten)]
    worm: WormArgs,
    /// Stop after this time of crawling; without it, on Ctrl-C
    #[arg(long, value_name = "SECONDS", value_parser = positive_seconds)]
    duration: Option<Duration>,
    /// Print the summary as one JSON object on standard output, and nothing else there
    #[arg(long)]
    json: bool,
    /// A line for each cycle and alarm instead of the moving picture, as when standard output is no terminal
    #[arg(long)]
    plain: bool,
    /// A fault of the virtual worm, as in `wormd virtual-worm --fault`; can be given several times
    #[arg(long, value_name = "SPEC")]
    fault: Vec<String>,
    /// Record all topics to this MCAP file, from the first state to the last, as `wormd record` does
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
}

/// Runs `wormd up`.
///
/// # Errors
/// [`Failure::Unusable`] for arguments, configuration or devices that cannot be used; [`Failure::Failed`] when a process of
/// the worm ended by itself, or the worm was stopped by a fault.
pub fn run(args: &UpArgs, verbose: u8) -> Result<(), Failure> {
    let config = args.worm.load()?;
    if config.port.is_some() && !args.fault.is_empty() {
        return Err(Failure::unusable(
            "--fault is for the virtual worm, but a port is configured",
        ));
    }
    let end = end_on_signal()?;
    let instance = Instance::of(&config).map_err(Failure::unusable)?;
    let role = RoleLock::<Supervisor>::take(&instance).map_err(Failure::unusable)?;
    let log = Log::new();
    let mut processes = Processes::start(args, &config, &instance, verbose, &log, &end)?;
    // Only now, so that until here Ctrl-C is a signal and errors are seen.
    let mut screen = Screen::open(args.json, args.plain, &config)?;
    let outcome = crawl(args, &config, &instance, &mut processes, &mut screen, &log, &end);
    let unrecorded = processes.end();
    screen.close(&log);
    drop(role);
    let run = outcome?;

    let summary = Summary::new(&config.worm, &run.telemetry, run.mode);
    if args.json {
        print::line(serde_json::to_string(&summary).map_err(Failure::failed)?)?;
    } else {
        print::line(summary.to_string().trim_end())?;
    }
    match (run.trouble.or(unrecorded), run.mode) {
        (Some(trouble), _) => Err(Failure::failed(trouble)),
        (None, Mode::Fault) => Err(Failure::failed(format!(
            "the worm was stopped by a fault: {}",
            fault_in_words(&run.telemetry)
        ))),
        (None, _) => Ok(()),
    }
}

/// The latched fault, and the alarm behind it.
fn fault_in_words(telemetry: &Telemetry) -> String {
    let Some(state) = telemetry.state else {
        return Fault::None.to_string();
    };
    let fault = Fault::try_from(state.fault).unwrap_or(Fault::None);
    match AlarmKind::try_from(state.fault_alarm) {
        Ok(alarm) if fault == Fault::Alarm => format!("{fault} {alarm}"),
        _ if fault == Fault::HostPaused => format!(
            "{fault}: the computer did not run the controller for {:.0} ms, longer than the servo's bus watchdog waits; \
             `wormd check` says what keeps the computer from pausing, servo.watchdog_ms allows longer pauses, and \
             control.resume_after_pause crawls on after one",
            telemetry.account.host_pauses.newest_s * 1e3
        ),
        _ => fault.to_string(),
    }
}

/// The processes of the worm. They are ended in the order of importance: first the controller, which stops the motor, last
/// the recorder, which hears of it.
struct Processes {
    controller: Child,
    estimator: Child,
    virtual_worm: Option<Child>,
    recorder: Option<Child>,
}

impl Processes {
    fn start(
        args: &UpArgs,
        config: &Config,
        instance: &Instance,
        verbose: u8,
        log: &Log,
        end: &AtomicBool,
    ) -> Result<Self, Failure> {
        let louder = (0..verbose).map(|_| OsString::from("-v"));
        let with = |subcommand: &str, more: &[OsString]| -> Vec<OsString> {
            std::iter::once(subcommand.into())
                .chain(more.iter().cloned())
                .chain(louder.clone())
                .collect()
        };
        let mut worm = args.worm.forward();
        let mut virtual_worm = None;
        if config.port.is_none() {
            let link = link_path(instance).into_os_string();
            let mut arguments = vec!["--link".into(), link.clone()];
            if let Some(file) = &args.worm.config {
                arguments.extend(["--config".into(), file.clone().into()]);
            }
            for fault in &args.fault {
                arguments.extend(["--fault".into(), fault.into()]);
            }
            let mut child = Child::start("virtual-worm", &with("virtual-worm", &arguments), log)?;
            child.wait_until_ready(START_PATIENCE, log, end)?;
            virtual_worm = Some(child);
            worm.extend(["--port".into(), link]);
        }
        let mut estimator = Child::start("estimate", &with("estimate", &worm), log)?;
        let mut recorder = None;
        if let Some(file) = &args.record {
            let mut arguments = args.worm.forward();
            arguments.extend(["--out".into(), file.clone().into()]);
            let mut child = Child::start("record", &with("record", &arguments), log)?;
            // Both must listen before the controller speaks: the log then has all that the estimator knows.
            child.wait_until_ready(START_PATIENCE, log, end)?;
            estimator.wait_until_ready(START_PATIENCE, log, end)?;
            recorder = Some(child);
        }
        let mut controller = Child::start("control", &with("control", &worm), log)?;
        controller.be_patient(ramp(config));
        controller.wait_until_ready(START_PATIENCE, log, end)?;
        if recorder.is_none() {
            estimator.wait_until_ready(START_PATIENCE, log, end)?;
        }
        Ok(Self {
            controller,
            estimator,
            virtual_worm,
            recorder,
        })
    }

    /// The first process that has ended by itself, and how.
    fn find_ended(&mut self) -> Option<String> {
        let children = [
            Some(&mut self.controller),
            Some(&mut self.estimator),
            self.virtual_worm.as_mut(),
        ];
        children.into_iter().flatten().find_map(|child| {
            let status = child.exit_status()?;
            Some(format!(
                "the {} process ended by itself, {status}; the worm was stopped",
                child.role
            ))
        })
    }

    /// Ends them all, and says what became of the recording if it is not what was asked for. A worm does not stop for that.
    fn end(&mut self) -> Option<String> {
        self.controller.end();
        self.estimator.end();
        if let Some(virtual_worm) = &mut self.virtual_worm {
            virtual_worm.end();
        }
        let status = self.recorder.as_mut()?.end();
        match status {
            Some(status) if status.success() => None,
            Some(status) => Some(format!(
                "the recording is not whole: the record process ended, {status}"
            )),
            None => Some("the recording may not be whole: nobody knows how the record process ended".to_owned()),
        }
    }
}

/// How long the worm takes to come to rest.
fn ramp(config: &Config) -> Duration {
    Duration::from_secs_f64(config.gait.ramp_s)
}

/// Where the virtual worm's port is found: beside the topics, in the folder that is this worm's and this user's alone.
fn link_path(instance: &Instance) -> PathBuf {
    instance.folder().join("tty")
}

/// What was heard of the worm, where it stood before it was stopped, and what went wrong.
struct RunningWorm {
    telemetry: Telemetry,
    mode: Mode,
    trouble: Option<String>,
}

fn crawl(
    args: &UpArgs,
    config: &Config,
    instance: &Instance,
    processes: &mut Processes,
    screen: &mut Screen,
    log: &Log,
    end: &AtomicBool,
) -> Result<RunningWorm, Failure> {
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
    let mut trouble = None;
    while !end.load(Ordering::Relaxed) && args.duration.is_none_or(|duration| begun.elapsed() < duration) {
        let left = args
            .duration
            .map_or(FRAME, |duration| duration.saturating_sub(begun.elapsed()).min(FRAME));
        if screen.wait(left) == Wish::Stop {
            break;
        }
        receiver.listen(&mut telemetry);
        trouble = match screen.paint(&telemetry, log) {
            Ok(()) => processes.find_ended(),
            Err(failure) => Some(format!("{failure}; the worm was stopped")),
        };
        if trouble.is_some() {
            break;
        }
    }
    let mode = receiver.mode(&mut telemetry);
    // A dead controller cannot stop the worm; the servo's watchdog has.
    if processes.controller.exit_status().is_none() && !stop(&client, config, &mut receiver, &mut telemetry, processes)
    {
        trouble.get_or_insert_with(|| "the worm did not say that it has stopped".to_owned());
    }
    if let Err(failure) = screen.paint(&telemetry, log) {
        trouble.get_or_insert_with(|| failure.to_string());
    }
    Ok(RunningWorm {
        telemetry,
        mode,
        trouble,
    })
}

/// Stops the worm; false when it did not say that it stands.
fn stop(
    client: &CommandClient,
    config: &Config,
    receiver: &mut TelemetryReceiver,
    telemetry: &mut Telemetry,
    processes: &mut Processes,
) -> bool {
    if let Err(failure) = give(client, CommandKind::Stop) {
        // A worm in a fault has stopped already and refuses a stop.
        tracing::debug!("{failure}");
    }
    receiver.wait_for(
        telemetry,
        MODE_PATIENCE + ramp(config),
        || processes.controller.exit_status().is_some(),
        |telemetry| {
            let mode = telemetry.state.map(|state| state.mode);
            [Mode::Disarmed, Mode::Fault]
                .iter()
                .any(|stopped| mode == Some(stopped.code()))
        },
    )
}
