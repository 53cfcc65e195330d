//! `wormd fleet`: the worms of robots elsewhere, offered on this computer.

use super::bridge::lower_priority;
use super::{Failure, end_on_signal, print};
use crate::bridge::laptop;
use crate::bridge::settings::FleetSettings;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `wormd fleet`.
#[derive(Debug, Args)]
pub struct FleetArgs {
    /// Which robots, and this computer's certificate: docs/bridge.md
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Check the file and what it names, and end
    #[arg(long)]
    check: bool,
}

/// Runs `wormd fleet` until a signal ends it. Prints the line "ready" on standard output once it tries to reach the robots.
///
/// # Errors
/// [`Failure::Unusable`] for a file that cannot be used or leaves anything open; [`Failure::Failed`] when the system gives no
/// threads.
pub fn run(args: &FleetArgs) -> Result<(), Failure> {
    let settings = FleetSettings::load(&args.config)?;
    if args.check {
        print::announce(format!("{} can be used", args.config.display()));
        return Ok(());
    }
    print::log_in_background()?;
    let end = end_on_signal()?;
    lower_priority();
    laptop::run(&settings, &end, print::ready)
}
