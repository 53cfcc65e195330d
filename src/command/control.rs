//! `wormd control`: the controller alone, on a configured port.

use super::{Failure, WormArgs, end_on_signal, print, report_advice, report_grants};
use crate::control::{self, Drive, link_settings};
use crate::topics::{Controller, Hub, Instance, RoleLock};
use clap::Args;
use std::path::Path;

/// Arguments of `wormd control`.
#[derive(Debug, Args)]
pub struct ControlArgs {
    #[command(flatten)]
    worm: WormArgs,
}

/// Runs `wormd control` until a signal ends it. Prints the line "ready" on standard output once the loop runs.
///
/// # Errors
/// [`Failure::Unusable`] for a configuration, port, device or worm that cannot be used; [`Failure::Failed`] when the topics
/// cannot be opened.
pub fn run(args: &ControlArgs) -> Result<(), Failure> {
    let config = args.worm.load()?;
    let Some(port) = &config.port else {
        return Err(Failure::unusable(
            "no serial port: name one in the section [port] or with --port; `wormd up` brings a virtual worm of its own",
        ));
    };
    report_advice(&config);
    let end = end_on_signal()?;
    let instance = Instance::of(&config).map_err(Failure::unusable)?;
    let role = RoleLock::<Controller>::take(&instance).map_err(Failure::unusable)?;
    let settings = link_settings(&config, port.baud).map_err(Failure::unusable)?;
    let (mut drive, prepared, findings) = Drive::open(Path::new(&port.path), settings).map_err(Failure::unusable)?;
    for finding in &findings {
        if finding.corrected {
            tracing::info!("{}: {} ({})", port.path, finding.what, finding.remedy);
        } else {
            tracing::warn!("{}: {}: {}", port.path, finding.what, finding.remedy);
        }
    }
    tracing::info!(port = port.path, read = ?prepared.plan.read, cells = prepared.tracker_cells, "devices are ready");
    let hub = Hub::open(&instance).map_err(Failure::failed)?;
    let ending = control::run(&config, &mut drive, &hub, &role, &end, |grants| {
        report_grants(grants);
        print::ready();
    })
    .map_err(Failure::failed)?;
    tracing::info!(?ending, link = ?drive.counters(), "the loop has ended");
    Ok(())
}
