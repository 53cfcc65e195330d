//! `wormd control`: the controller alone, on a configured port.

use super::{Failure, WormArgs, end_on_signal, print, report_advice, report_grants};
use crate::attendance::{Attendance, LockWatch, ParentPipe, ProcessStatus, ServiceManager, Standing, StopSocket};
use crate::control::{self, Drive, link_settings};
use crate::topics::{Controller, Hub, Instance, RoleLock, SharedConfiguration};
use clap::Args;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;
use worm_estimator::config::Config;

/// Priority of the thread that reads the lease, below the loop's: it must run on a busy computer, and never in the loop's way.
const LEASE_BELOW_LOOP: u8 = 4;

/// Arguments of `wormd control`.
#[derive(Debug, Args)]
pub struct ControlArgs {
    #[command(flatten)]
    worm: WormArgs,
    /// Standard input is a pipe from the process that watches over the worm
    #[arg(long, hide = true)]
    supervised: bool,
}

/// Runs `wormd control` until a signal ends it. Prints the line "ready" on standard output once the loop runs.
///
/// # Errors
/// [`Failure::Unusable`] for a configuration, port, device or worm that cannot be used; [`Failure::Failed`] when the topics
/// cannot be opened, or were removed while the worm ran.
pub fn run(args: &ControlArgs) -> Result<(), Failure> {
    print::log_in_background()?;
    let (config, text) = args.worm.load_with_text()?;
    let Some(port) = &config.port else {
        return Err(Failure::unusable(
            "no serial port: name one in the section [port] or with --port; `wormd up` brings a virtual worm of its own",
        ));
    };
    report_advice(&config);
    let end = end_on_signal()?;
    let instance = Instance::of(&config).map_err(Failure::unusable)?;
    let role = RoleLock::<Controller>::take(&instance).map_err(Failure::unusable)?;
    let _shared = SharedConfiguration::leave(&role, text.as_deref())
        .inspect_err(|error| {
            tracing::warn!("who records this worm by its name will not know its configuration: {error}")
        })
        .ok();
    let place = role.place().map_err(Failure::failed)?;
    let lock_watch = LockWatch::start(place, &end)?;
    // Before the devices: from here on the worm can be stopped, and a parent that dies is noticed.
    let attendance = attend(&config, args.supervised, &end)?;
    let _service = match args.supervised {
        true => None,
        false => Some(inform_service_manager(attendance.standing.clone(), &end)?),
    };
    let settings = link_settings(&config, port.baud).map_err(Failure::unusable)?;
    let (mut drive, prepared, findings) = Drive::open(Path::new(&port.path), settings).map_err(Failure::unusable)?;
    for finding in &findings {
        if finding.corrected {
            tracing::info!("{}: {} ({})", port.path, finding.what, finding.remedy);
        } else {
            tracing::warn!("{}: {}: {}", port.path, finding.what, finding.remedy);
        }
    }
    let cells = prepared.tracker.map(|tracker| tracker.cells);
    tracing::info!(port = port.path, read = ?prepared.plan.read, ?cells, "devices are ready");
    let hub = Hub::open(&instance).map_err(Failure::failed)?;
    let ending = control::run(&config, &mut drive, &hub, &role, &attendance, &end, |grants| {
        report_grants(grants);
        print::ready();
    })
    .map_err(Failure::failed)?;
    tracing::info!(?ending, link = ?drive.counters(), "the loop has ended");
    match lock_watch.lost() {
        Some(lost) => Err(Failure::failed(lost)),
        None => Ok(()),
    }
}

/// Listens to whoever watches over the worm, and to who wants it stopped.
fn attend(config: &Config, supervised: bool, end: &Arc<AtomicBool>) -> Result<Attendance, Failure> {
    let no_thread = |error| Failure::failed(format!("no thread can be started: {error}"));
    let lease = Duration::from_secs_f64(config.control.lease_s);
    let priority = config.realtime.priority.saturating_sub(LEASE_BELOW_LOOP);
    let parent = match supervised {
        true => Some(ParentPipe::watch(lease, priority).map_err(no_thread)?),
        false => None,
    };
    let standing = Standing::default();
    let stop = StopSocket::bind(config, parent.clone(), &standing, end)
        .inspect_err(|error| tracing::warn!("no stop socket ({error}): `wormd command stop` works by the topics alone"))
        .ok();
    Ok(Attendance { parent, stop, standing })
}

/// Ready with the first tick; a loop that does not tick any more is not reported as alive.
fn inform_service_manager(standing: Standing, end: &Arc<AtomicBool>) -> Result<ServiceManager, Failure> {
    ServiceManager::inform(end, move || {
        let rounds = standing.ticks();
        let words = match rounds {
            0 => "starting".to_owned(),
            _ => standing.words(),
        };
        ProcessStatus { rounds, words }
    })
}
