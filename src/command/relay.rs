//! `wormd relay`: serves the watchers of a worm.

use super::{Failure, WormArgs, end_on_signal, print};
use crate::relay::server;
use crate::topics::{Instance, Relay, RoleLock};
use clap::Args;

/// How much the relay gives way to others: it is nobody's watchdog.
const NICENESS: libc::c_int = 5;

/// Arguments of `wormd relay`.
#[derive(Debug, Args)]
pub struct RelayArgs {
    #[command(flatten)]
    worm: WormArgs,
}

/// Runs `wormd relay` until a signal ends it, or nobody has watched for some seconds. Prints the line "ready" on standard output once
/// watchers can connect.
///
/// # Errors
/// [`Failure::Unusable`] for a configuration or worm that cannot be used, or that has a relay already; [`Failure::Failed`] when the
/// topics or the socket fail.
pub fn run(args: &RelayArgs) -> Result<(), Failure> {
    print::log_in_background()?;
    let (config, text) = args.worm.load_with_text()?;
    let end = end_on_signal()?;
    let instance = Instance::of(&config).map_err(Failure::unusable)?;
    let role = RoleLock::<Relay>::take(&instance).map_err(Failure::unusable)?;
    // SAFETY: the call takes plain numbers; 0 is this process.
    if unsafe { libc::setpriority(libc::PRIO_PROCESS, 0, NICENESS) } != 0 {
        tracing::debug!("the priority cannot be lowered: {}", std::io::Error::last_os_error());
    }
    server::run((&config, text), &instance, &role, &end, print::ready)
}
