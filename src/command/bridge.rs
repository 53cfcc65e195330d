//! `wormd bridge`: the worms of this computer for laptops elsewhere.

use super::{Failure, end_on_signal, print};
use crate::attendance::{RoundCounter, ServiceManager};
pub use crate::bridge::LinkLog;
use crate::bridge::robot;
use crate::bridge::settings::BridgeSettings;
use clap::Args;
use std::path::PathBuf;

/// How much the bridge gives way to others, as the relay does.
const NICENESS: libc::c_int = 5;

/// Arguments of `wormd bridge`.
#[derive(Debug, Args)]
pub struct BridgeArgs {
    /// What to listen at, which certificates may do what, and which worms: docs/bridge.md
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Check the file and what it names, say which worms another bridge serves now, and end
    #[arg(long)]
    check: bool,
}

/// Runs `wormd bridge` until a signal ends it. Prints the line "ready" on standard output once laptops can connect.
///
/// # Errors
/// [`Failure::Unusable`] for a file that cannot be used or leaves anything open, and for an address that is taken;
/// [`Failure::Failed`] when it cannot wait for its relays any more.
pub fn run(args: &BridgeArgs) -> Result<(), Failure> {
    let settings = BridgeSettings::load(&args.config)?;
    if args.check {
        print::announce(format!("{} can be used", args.config.display()));
        for remark in robot::served_already(&settings)? {
            print::log_line(format_args!("note: {remark}"));
        }
        return Ok(());
    }
    print::log_in_background()?;
    let end = end_on_signal()?;
    lower_priority();
    let rounds = RoundCounter::default();
    let _service = ServiceManager::inform_of_rounds(&end, &rounds)?;
    robot::run(settings, &end, print::ready, || rounds.count())
}

/// Gives way to what is more urgent.
pub(super) fn lower_priority() {
    // SAFETY: the call takes plain numbers; 0 is this process.
    if unsafe { libc::setpriority(libc::PRIO_PROCESS, 0, NICENESS) } != 0 {
        tracing::debug!("the priority cannot be lowered: {}", std::io::Error::last_os_error());
    }
}
