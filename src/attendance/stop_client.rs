//! Asking a controller at its stop socket.

use super::stop_socket::{Answer, Question, Request, name_parts, peer_of};
use std::collections::BTreeSet;
use std::io::{self, BufRead, BufReader, Write};
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixStream};
use std::time::Duration;
use worm_estimator::config::Config;

/// How long the controller may take to answer; it itself waits up to two seconds for its loop.
const TIMEOUT: Duration = Duration::from_secs(3);

/// Where the kernel lists the sockets.
const SOCKETS: &str = "/proc/net/unix";

/// Why a stop socket gave no answer.
#[derive(Debug, thiserror::Error)]
pub(crate) enum StopError {
    /// There is none.
    #[error("no controller of {worm} has a stop socket")]
    NoSocket {
        /// The worm.
        worm: String,
    },
    /// Other users have a worm of this name, and this one has none.
    #[error(
        "{worm} is a worm of user {}, this process runs as user {user}: only its own user may command a worm, and root may stop it",
        users.join(", ")
    )]
    Foreign {
        /// The worm.
        worm: String,
        /// The users' ids.
        users: Vec<String>,
        /// The user of this process.
        user: u32,
    },
    /// Worms of several users have the name.
    #[error("{worm} is the name of several users' worms ({}): act as one of them (sudo -u)", users.join(", "))]
    SeveralUsers {
        /// The worm.
        worm: String,
        /// The users' ids.
        users: Vec<String>,
    },
    /// It did not answer, or not usably.
    #[error("the stop socket of {worm} gave no answer: {source}")]
    NoAnswer {
        /// The worm.
        worm: String,
        /// Why.
        source: io::Error,
    },
}

/// Asks the worm's controller.
///
/// # Errors
/// [`StopError`] when there is no stop socket of a controller that this user may ask, or it does not answer.
pub(crate) fn ask(config: &Config, request: Request) -> Result<Answer, StopError> {
    let worm = &config.worm.name;
    let sockets = sockets_of(worm, &config.topics.root).map_err(|source| StopError::NoAnswer {
        worm: worm.clone(),
        source,
    })?;
    let mut failure = None;
    for (user, name) in choose(worm, sockets, nix::unistd::geteuid().as_raw())? {
        match ask_at(&name, user, request) {
            Ok(answer) => return Ok(answer),
            Err(source) => failure = Some(source),
        }
    }
    let worm = worm.clone();
    Err(match failure {
        Some(source) => StopError::NoAnswer { worm, source },
        None => StopError::NoSocket { worm },
    })
}

/// The stop sockets of a worm on this computer: their user and name.
fn sockets_of(worm: &str, root: &str) -> io::Result<BTreeSet<(u32, String)>> {
    let (head, tail) = name_parts(worm, root);
    let table = std::fs::read(SOCKETS)?;
    let table = String::from_utf8_lossy(&table);
    let named = table
        .lines()
        .filter_map(|line| line.split_whitespace().last()?.strip_prefix('@'));
    Ok(named
        .filter_map(|name| {
            let (user, process) = name.strip_prefix(&head)?.split_once(&tail)?;
            process.parse::<u32>().ok()?;
            Some((user.parse().ok()?, name.to_owned()))
        })
        .collect())
}

/// Those that the calling user may ask: its own, or for root those of the only user who has a worm of this name.
fn choose(worm: &str, sockets: BTreeSet<(u32, String)>, caller: u32) -> Result<Vec<(u32, String)>, StopError> {
    let own: Vec<_> = sockets.iter().filter(|(user, _)| *user == caller).cloned().collect();
    let users: BTreeSet<_> = sockets.iter().map(|(user, _)| *user).collect();
    if !own.is_empty() || users.is_empty() {
        return Ok(own);
    }
    let named = users.iter().map(u32::to_string).collect();
    let worm = worm.to_owned();
    match (caller, users.len()) {
        (0, 1) => Ok(sockets.into_iter().collect()),
        (0, _) => Err(StopError::SeveralUsers { worm, users: named }),
        _ => Err(StopError::Foreign {
            worm,
            users: named,
            user: caller,
        }),
    }
}

fn ask_at(name: &str, user: u32, request: Request) -> io::Result<Answer> {
    let mut stream = UnixStream::connect_addr(&SocketAddr::from_abstract_name(name)?)?;
    // Anybody may bind any abstract name.
    if peer_of(&stream)?.uid() != user {
        return Err(io::Error::other("it belongs to another user than its name says"));
    }
    stream.set_read_timeout(Some(TIMEOUT))?;
    stream.set_write_timeout(Some(TIMEOUT))?;
    let mut question = serde_json::to_string(&Question { request })?;
    question.push('\n');
    stream.write_all(question.as_bytes())?;
    let mut line = String::new();
    BufReader::new(stream).read_line(&mut line)?;
    Ok(serde_json::from_str(&line)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_user_asks_its_own_worm_and_root_the_only_one_there_is() {
        let sockets = |users: &[u32]| {
            users
                .iter()
                .map(|user| (*user, format!("s{user}")))
                .collect::<BTreeSet<_>>()
        };
        let chosen = |users: &[u32], caller| {
            choose("worm1", sockets(users), caller)
                .map(|chosen| chosen.iter().map(|(user, _)| *user).collect::<Vec<_>>())
        };
        assert_eq!(chosen(&[0, 1000], 1000).expect("one"), [1000]);
        assert_eq!(chosen(&[], 1001).expect("none"), [0_u32; 0]);
        assert!(matches!(chosen(&[0, 1000], 1001), Err(StopError::Foreign { .. })));
        assert_eq!(chosen(&[0, 1000], 0).expect("one"), [0]);
        assert_eq!(chosen(&[1000], 0).expect("one"), [1000]);
        assert!(matches!(chosen(&[1000, 1001], 0), Err(StopError::SeveralUsers { .. })));
    }
}
