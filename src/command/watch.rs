//! `wormd watch`: a running worm in a terminal.

use super::live::{Screen, WatchScreen, is_on_terminal};
use super::{Failure, WormArgs, end_on_signal, print, suspend_on_signal};
use crate::supervisor::controller::refuse_foreign;
use crate::supervisor::crawl::{Display, Wish};
use crate::topics::Instance;
use crate::watch::app::Seat;
use clap::Args;
use nix::sys::signal::{Signal, raise};
use std::sync::atomic::Ordering;
use std::time::Duration;

/// How often signals and the terminal are looked at.
const POLL: Duration = Duration::from_millis(50);

/// Arguments of `wormd watch`.
#[derive(Debug, Args)]
pub struct WatchArgs {
    #[command(flatten)]
    worm: WormArgs,
}

/// Runs `wormd watch` until q, Ctrl-C or a signal.
///
/// # Errors
/// [`Failure::Unusable`] for a configuration that cannot be used, when no such worm runs, and without a terminal;
/// [`Failure::Failed`] when the relay does not start, or the terminal is gone.
pub fn run(args: &WatchArgs) -> Result<(), Failure> {
    let config = args.worm.load()?;
    refuse_foreign(&config)?;
    let instance = Instance::of(&config).map_err(Failure::unusable)?;
    let mut link = WatchScreen::link(&instance, args.worm.forward(), Seat::Watch);
    if !is_on_terminal() {
        instance.remove_folder_if_empty();
        return Err(Failure::unusable(
            "`wormd watch` needs a terminal; for scripts there are the topics and the relay's socket (docs/relay.md)",
        ));
    }
    link.wait_until_connected()?;
    print::log_in_background()?;
    let end = end_on_signal()?;
    let suspend = suspend_on_signal()?;
    let mut screen = Screen::open(true, move || {
        WatchScreen::open(Seat::Watch, &config, &instance, link, None)
    })?;
    while !end.load(Ordering::Relaxed) {
        let wish = screen.wait_for_wish(POLL);
        if wish == Wish::Stop || screen.problem().is_some() {
            break;
        }
        if suspend.swap(false, Ordering::Relaxed) || wish == Wish::Suspend {
            // What is not painted is not attended to: a crawl of this screen ends in a hold meanwhile.
            screen.suspend();
            if let Err(errno) = raise(Signal::SIGSTOP) {
                tracing::warn!("this process cannot be suspended: {errno}");
            }
            screen.resume();
        }
    }
    match screen.close() {
        Some(problem) => Err(Failure::failed(problem)),
        None => Ok(()),
    }
}
