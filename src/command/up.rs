//! `wormd up`: the main job. Starts the processes of a worm, makes it crawl, shows what it does, stops it in order, sums up.

mod line_painter;

use super::live::{Screen, WatchScreen, is_on_terminal};
use super::recording_limits::RecordingLimits;
use super::{Failure, WormArgs, end_on_signal, positive_seconds, print, suspend_on_signal};
use crate::supervisor::child_process::Log;
use crate::supervisor::crawl::{self, Limits, SharedTelemetry};
use crate::supervisor::processes::{Launch, Processes};
use crate::supervisor::takeover;
use crate::topics::{Instance, RoleLock, Supervisor};
use crate::watch::app::Seat;
use crate::watch::{Summary, Telemetry};
use clap::Args;
use line_painter::LinePainter;
use std::path::PathBuf;
use std::time::Duration;
use worm_estimator::config::Config;
use worm_estimator::message::{AlarmKind, Fault, Mode};

/// How long standard output may take nothing of the summary.
const OUTPUT_PATIENCE: Duration = Duration::from_secs(5);
const STALLED_PATIENCE: Duration = Duration::from_millis(200);

/// Arguments of `wormd up`.
#[derive(Debug, Args)]
pub struct UpArgs {
    #[command(flatten)]
    worm: WormArgs,
    /// Stop after this time of crawling; without it, on Ctrl-C
    #[arg(long, value_name = "SECONDS", value_parser = positive_seconds, allow_negative_numbers = true)]
    duration: Option<Duration>,
    /// Print the summary as one JSON object on standard output, and nothing else there
    #[arg(long)]
    json: bool,
    /// A line for each cycle and alarm instead of the live display, as when standard output is not a terminal
    #[arg(long)]
    plain: bool,
    /// A fault of the virtual worm, as in `wormd virtual-worm --fault`; can be given several times
    #[arg(long, value_name = "SPEC")]
    fault: Vec<String>,
    /// Let the virtual worm take faults from `wormd fault` while it runs
    #[arg(long)]
    allow_faults: bool,
    /// Record all topics to this MCAP file, from the first state to the last, as `wormd record` does
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    #[command(flatten)]
    record_limits: RecordingLimits,
    /// Keep the moments around each alarm and fault in this folder, as `wormd record --black-box` does; without it, in `black_box.folder` of the
    /// configuration, if that is set
    #[arg(long, value_name = "DIR")]
    black_box: Option<PathBuf>,
}

/// Runs `wormd up`.
///
/// # Errors
/// [`Failure::Unusable`] for arguments, configuration or devices that cannot be used; [`Failure::Failed`] when a process of
/// the worm ended by itself, or the worm was stopped by a fault.
pub fn run(args: &UpArgs, verbose: u8) -> Result<(), Failure> {
    let config = args.worm.load()?;
    if config.port.is_some() && (args.allow_faults || !args.fault.is_empty()) {
        return Err(Failure::unusable(
            "--fault and --allow-faults are for the virtual worm, but a port is configured",
        ));
    }
    if args.record.is_none() && !args.record_limits.is_empty() {
        return Err(Failure::unusable(
            "--max-size, --max-age and --keep are for a recording: give --record FILE, too",
        ));
    }
    args.record_limits.file_options().map_err(Failure::unusable)?;
    // From here on nothing that this thread does waits for a terminal.
    print::log_in_background()?;
    let end = end_on_signal()?;
    let suspend = suspend_on_signal()?;
    let instance = Instance::of(&config).map_err(Failure::unusable)?;
    let role = RoleLock::<Supervisor>::take(&instance).map_err(Failure::unusable)?;
    takeover::end_orphans(&config, &instance, &end)?;
    let log = Log::new();
    let launch = Launch {
        worm: args.worm.forward(),
        config: args.worm.config.clone(),
        faults: args.fault.clone(),
        allow_faults: args.allow_faults,
        record: args.record.clone(),
        record_limits: args.record_limits.forward(),
        black_box: args.black_box.clone().or_else(|| {
            let configured = config.black_box.as_ref()?.folder.as_ref();
            configured.map(PathBuf::from)
        }),
        verbose,
    };
    let mut processes = Processes::start(&launch, &config, &instance, &log, &end)?;
    let telemetry = SharedTelemetry::default();
    // Opened only now: until here Ctrl-C is a signal, and errors are visible.
    let mut screen = open_screen(args, &config, &instance, &telemetry, &log)?;
    let limits = Limits {
        duration: args.duration,
        end: &end,
        suspend: &suspend,
    };
    let outcome = crawl::run(
        limits,
        &config,
        &instance,
        &mut processes,
        &mut screen,
        &telemetry,
        &log,
    );
    let incomplete_recording = processes.end();
    let display_problem = screen.close();
    drop(role);
    let run = outcome?;

    let telemetry = std::mem::take(&mut *telemetry.lock());
    // A terminal that does not take the display will not take the summary either.
    let patience = match display_problem {
        Some(_) => STALLED_PATIENCE,
        None => OUTPUT_PATIENCE,
    };
    let summary = Summary::new(&config, &telemetry, run.mode);
    if args.json {
        let text = serde_json::to_string(&summary).map_err(Failure::failed)?;
        print::line_within(text, patience)?;
    } else {
        print::line_within(summary.to_string().trim_end(), patience)?;
    }
    match (run.problem.or(display_problem).or(incomplete_recording), run.mode) {
        (Some(problem), _) => Err(Failure::failed(problem)),
        (None, Mode::Fault) => Err(Failure::failed(format!(
            "the worm was stopped by a fault: {}",
            fault_in_words(&telemetry)
        ))),
        (None, _) => Ok(()),
    }
}

/// The live display, or lines where that cannot be.
///
/// The live display is that of `wormd watch`, fed by the relay. The summary is not: it counts every tick, cycle and alarm from the
/// first on, and must not depend on a process that may come late, be shared, or be killed.
fn open_screen(
    args: &UpArgs,
    config: &Config,
    instance: &Instance,
    telemetry: &SharedTelemetry,
    log: &Log,
) -> Result<Screen, Failure> {
    let lines = log.share();
    if args.json || args.plain || !is_on_terminal() {
        let (is_silent, step_order, telemetry) = (args.json, config.worm.step_order.clone(), telemetry.clone());
        return Screen::open(false, move || {
            Ok(LinePainter::new(is_silent, step_order, telemetry, lines))
        });
    }
    let link = WatchScreen::link(instance, args.worm.forward(), Seat::Up);
    let (config, instance) = (config.clone(), instance.clone());
    Screen::open(true, move || {
        WatchScreen::open(Seat::Up, &config, &instance, link, Some(lines))
    })
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
            telemetry.tick_stats.host_pauses.newest_s * 1e3
        ),
        _ => fault.to_string(),
    }
}
