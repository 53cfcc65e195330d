//! Which worms run on this computer, whoever started them: found by their controllers' stop sockets.

use super::stop_client::{abstract_names, connect_all, put};
use super::stop_socket::{Answer, Request, parse_name};
use std::io;

/// A controller that runs on this computer.
#[derive(Debug)]
pub(crate) struct RunningController {
    /// Its worm.
    pub(crate) worm: String,
    /// User id of the worm's user.
    pub(crate) user: u32,
    /// The process.
    pub(crate) pid: u32,
    /// What it answered; none where it did not.
    pub(crate) answer: Option<Answer>,
}

/// All controllers, by user and worm.
///
/// # Errors
/// When the kernel does not list its sockets.
pub(crate) fn running_controllers() -> io::Result<Vec<RunningController>> {
    let mut found = Vec::new();
    for name in abstract_names()? {
        let Some((user, worm, pid)) = parse_name(&name) else {
            continue;
        };
        let (connected, is_busy) = connect_all([(user, name.clone())].into(), user);
        let answer = match connected.into_iter().next() {
            Some((_, stream)) => put(&Request::Status.into(), stream).ok(),
            None if is_busy => None,
            // It has ended, or somebody else has bound that name.
            None => continue,
        };
        found.push(RunningController {
            worm: worm.to_owned(),
            user,
            pid,
            answer,
        });
    }
    found.sort_by(|one, other| (one.user, &one.worm, one.pid).cmp(&(other.user, &other.worm, other.pid)));
    Ok(found)
}
