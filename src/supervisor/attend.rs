//! A crawl that lasts as long as a process in the foreground attends to it.

use super::controller::{command, send};
use crate::failure::Failure;
use crate::topics::{CommandClient, Hub};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use worm_estimator::message::{Command, CommandKind, Mode, State};

/// For how long each command permits the crawl, s: the worm holds this long after its last attendant has gone.
const LIMIT_S: f64 = 1.0;
/// How often the crawl is permitted anew.
const RENEWAL: Duration = Duration::from_millis(250);
/// How often the end is looked for.
const POLL: Duration = Duration::from_millis(10);

/// Makes the worm crawl in the name of `sender`, and permits that anew until `end` is set; then it holds. Calls `begun` once it crawls. Nothing here makes it
/// crawl a second time: a hold of somebody else ends it, whenever it comes.
///
/// # Errors
/// [`Failure::Failed`] when the controller refuses or is gone, or when somebody else has ended the crawl.
pub(crate) fn crawl(
    hub: &Hub,
    sender: &str,
    cycles_per_s: f64,
    end: &AtomicBool,
    begun: impl FnOnce(),
) -> Result<(), Failure> {
    let client = hub.command_client().map_err(Failure::failed)?;
    let mut states = hub.subscriber::<State>().map_err(Failure::failed)?;
    let mut permitted = permit(&client, sender, CommandKind::Crawl, cycles_per_s)?;
    begun();
    let mut renewed = Instant::now();
    while !end.load(Ordering::Relaxed) {
        std::thread::sleep(POLL);
        let newest = states.latest().ok().flatten().map(|state| (state.sequence, state.mode));
        if let Some((tick, mode)) = newest
            && tick > permitted
            && mode != Mode::Crawling.code()
        {
            // Another command, an alarm or a fault; a new command would overrule it.
            let mode = Mode::try_from(mode).map_err(Failure::failed)?;
            return Err(Failure::failed(format!(
                "the worm does not crawl any more, it is {mode}"
            )));
        }
        if renewed.elapsed() >= RENEWAL {
            permitted = permit(&client, sender, CommandKind::Renew, cycles_per_s)?;
            renewed = Instant::now();
        }
    }
    accepted(&client, command(CommandKind::Hold, sender)).map(drop)
}

/// Permits the crawl for a little longer; returns the controller's tick that did.
fn permit(client: &CommandClient, sender: &str, kind: CommandKind, cycles_per_s: f64) -> Result<u64, Failure> {
    let permission = Command {
        cycles_per_s,
        limit_s: LIMIT_S,
        ..command(kind, sender)
    };
    accepted(client, permission)
}

fn accepted(client: &CommandClient, command: Command) -> Result<u64, Failure> {
    let answer = send(client, command)?;
    match answer.refusal() {
        None => Ok(answer.tick()),
        Some(refusal) => Err(Failure::failed(refusal)),
    }
}
