//! Asking a controller at its stop socket.

use super::stop_socket::{ANSWER_TIMEOUT, Answer, Question, Request, name_parts, peer_of};
use crate::realtime::is_suspended;
use nix::sys::socket::{self, AddressFamily, SockFlag, SockType, UnixAddr};
use std::collections::BTreeSet;
use std::io::{self, BufRead, BufReader, Write};
use std::os::fd::AsRawFd;
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};
use worm_estimator::config::Config;

/// How long the controller may take to answer; it itself waits up to [`ANSWER_TIMEOUT`] for its loop.
const TIMEOUT: Duration = ANSWER_TIMEOUT.saturating_add(Duration::from_secs(1));
/// How long one that is suspended may take, and how often that is looked at.
const SUSPENDED_TIMEOUT: Duration = Duration::from_secs(1);
const LOOK: Duration = Duration::from_millis(250);
/// How long a socket that takes no connection is tried, and how often.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(2);
const CONNECT_POLL: Duration = Duration::from_millis(10);

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
        "{worm} is a worm of user {}, this process runs as user {user}: only its own user may command a worm (sudo -u '#{}' wormd …), and \
         root may stop it",
        users.join(", "), users.first().map_or("", String::as_str)
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

/// Asks the worm's controller. [`Request::Stop`] goes to every controller of that name, should there be several, and only counts as
/// accepted when all of them accept it.
///
/// # Errors
/// [`StopError`] when there is no stop socket of a controller that this user may ask, or it does not answer.
pub(crate) fn ask(config: &Config, question: &Question) -> Result<Answer, StopError> {
    let worm = &config.worm.name;
    let no_answer = |source| StopError::NoAnswer {
        worm: worm.clone(),
        source,
    };
    let caller = nix::unistd::geteuid().as_raw();
    let sockets = sockets_of(worm, &config.topics.root).map_err(no_answer)?;
    let (connected, is_one_busy) = connect_all(sockets, caller);
    let mut answers = Vec::new();
    let mut failure = None;
    for (_, stream) in choose(worm, connected, caller)? {
        match put(question, stream) {
            Ok(answer) => answers.push(answer),
            Err(source) => failure = Some(source),
        }
        if question.request != Request::Stop && !answers.is_empty() {
            break;
        }
    }
    match failure {
        Some(source) if answers.is_empty() || question.request == Request::Stop => Err(no_answer(source)),
        _ => {
            let answer = answers.into_iter().max_by_key(|answer| answer.refusal.is_some());
            answer.ok_or_else(|| match is_one_busy {
                true => no_answer(io::Error::new(io::ErrorKind::WouldBlock, "it takes no connection")),
                false => StopError::NoSocket { worm: worm.clone() },
            })
        }
    }
}

/// That the worm of this name is another user's, for all that root, too, may do as its own user alone; none where it is the caller's, or
/// nobody's.
pub(crate) fn foreign(config: &Config) -> Option<StopError> {
    let worm = &config.worm.name;
    let user = nix::unistd::geteuid().as_raw();
    // Without the list nobody can tell; the topics then say whether there is a worm.
    let sockets = sockets_of(worm, &config.topics.root).ok()?;
    let (connected, _) = connect_all(sockets, user);
    let users: BTreeSet<_> = connected.iter().map(|(owner, _)| *owner).collect();
    (!users.is_empty() && !users.contains(&user)).then(|| StopError::Foreign {
        worm: worm.clone(),
        users: users.iter().map(u32::to_string).collect(),
        user,
    })
}

/// Connects to all of them, and leaves out those that are nobody's, or not their name's user's: anybody may bind any abstract name.
/// Those that take no connection are tried for a while, unless one of the caller's own does; whether one was left comes second.
pub(super) fn connect_all(sockets: BTreeSet<(u32, String)>, caller: u32) -> (Vec<(u32, UnixStream)>, bool) {
    let mut connected = Vec::new();
    let mut waiting: Vec<_> = sockets.into_iter().collect();
    let begun = Instant::now();
    loop {
        waiting.retain(|(user, name)| match connect(name) {
            Ok(stream) => {
                if peer_of(&stream).is_ok_and(|peer| peer.uid() == *user) {
                    connected.push((*user, stream));
                }
                false
            }
            Err(error) => error.kind() == io::ErrorKind::WouldBlock,
        });
        let has_own = connected.iter().any(|(user, _)| *user == caller);
        if waiting.is_empty() || has_own || begun.elapsed() > CONNECT_TIMEOUT {
            return (connected, !waiting.is_empty());
        }
        std::thread::sleep(CONNECT_POLL);
    }
}

/// Connects without waiting for room in the queue of the other side.
fn connect(name: &str) -> io::Result<UnixStream> {
    let flags = SockFlag::SOCK_NONBLOCK | SockFlag::SOCK_CLOEXEC;
    let socket = socket::socket(AddressFamily::Unix, SockType::Stream, flags, None)?;
    socket::connect(socket.as_raw_fd(), &UnixAddr::new_abstract(name.as_bytes())?)?;
    let stream = UnixStream::from(socket);
    stream.set_nonblocking(false)?;
    Ok(stream)
}

/// The stop sockets of a worm on this computer: their user and name.
fn sockets_of(worm: &str, root: &str) -> io::Result<BTreeSet<(u32, String)>> {
    let (head, tail) = name_parts(worm, root);
    let names = abstract_names()?.into_iter();
    Ok(names
        .filter_map(|name| {
            let (user, process) = name.strip_prefix(&head)?.split_once(&tail)?;
            process.parse::<u32>().ok()?;
            Some((user.parse().ok()?, name))
        })
        .collect())
}

/// The abstract names at which sockets on this computer are bound, or connected; each once.
pub(super) fn abstract_names() -> io::Result<BTreeSet<String>> {
    let table = std::fs::read(SOCKETS)?;
    let table = String::from_utf8_lossy(&table);
    let names = table
        .lines()
        .filter_map(|line| line.split_whitespace().last()?.strip_prefix('@'));
    Ok(names.map(str::to_owned).collect())
}

/// Those that the calling user may ask: its own, or for root those of the only user who has a worm of this name.
fn choose<S>(worm: &str, sockets: Vec<(u32, S)>, caller: u32) -> Result<Vec<(u32, S)>, StopError> {
    let users: BTreeSet<_> = sockets.iter().map(|(user, _)| *user).collect();
    if users.is_empty() || users.contains(&caller) {
        return Ok(sockets.into_iter().filter(|(user, _)| *user == caller).collect());
    }
    let named = users.iter().map(u32::to_string).collect();
    let worm = worm.to_owned();
    match (caller, users.len()) {
        (0, 1) => Ok(sockets),
        (0, _) => Err(StopError::SeveralUsers { worm, users: named }),
        _ => Err(StopError::Foreign {
            worm,
            users: named,
            user: caller,
        }),
    }
}

/// Puts the question and waits for the answer.
pub(super) fn put(question: &Question, mut stream: UnixStream) -> io::Result<Answer> {
    let pid = peer_of(&stream)?.pid();
    stream.set_read_timeout(Some(LOOK))?;
    stream.set_write_timeout(Some(TIMEOUT))?;
    let mut line = serde_json::to_string(question)?;
    line.push('\n');
    stream.write_all(line.as_bytes())?;
    line.clear();
    let mut reader = BufReader::new(stream);
    let begun = Instant::now();
    while let Err(error) = reader.read_line(&mut line) {
        let limit = match u32::try_from(pid).is_ok_and(is_suspended) {
            true => SUSPENDED_TIMEOUT,
            false => TIMEOUT,
        };
        if error.kind() != io::ErrorKind::WouldBlock || begun.elapsed() >= limit {
            return Err(error);
        }
    }
    Ok(serde_json::from_str(&line)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_user_asks_its_own_worm_and_root_the_only_one_there_is() {
        let sockets = |users: &[u32]| users.iter().map(|user| (*user, ())).collect();
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

    #[test]
    fn names_that_others_have_bound_neither_hold_up_a_question_nor_count() {
        let user = nix::unistd::geteuid().as_raw();
        let name = |what: &str| format!("wormd-test/{}/{what}", std::process::id());
        let bind = |what: &str, backlog: i32| {
            let flags = SockFlag::SOCK_CLOEXEC;
            let socket = socket::socket(AddressFamily::Unix, SockType::Stream, flags, None).expect("a socket");
            let address = UnixAddr::new_abstract(name(what).as_bytes()).expect("a short name");
            socket::bind(socket.as_raw_fd(), &address).expect("a free name");
            socket::listen(&socket, socket::Backlog::new(backlog).expect("a small number")).expect("it listens");
            socket
        };
        // One that takes no more connections, one whose name says another user, and one that is as it should be.
        let _full = bind("full", 0);
        let _first = connect(&name("full")).expect("room for one");
        let _foreign = bind("foreign", 8);
        let _own = bind("own", 8);
        let sockets = |named: &[(u32, &str)]| named.iter().map(|(user, what)| (*user, name(what))).collect();
        let (connected, is_one_busy) =
            connect_all(sockets(&[(user, "full"), (user + 1, "foreign"), (user, "own")]), user);
        let users: Vec<_> = connected.iter().map(|(user, _)| *user).collect();
        assert_eq!((users, is_one_busy), (vec![user], true));
        let (connected, is_one_busy) = connect_all(sockets(&[(user, "full"), (user + 1, "foreign")]), user);
        assert_eq!((connected.len(), is_one_busy), (0, true));
        let (connected, is_one_busy) = connect_all(sockets(&[(user, "gone")]), user);
        assert_eq!((connected.len(), is_one_busy), (0, false));
    }
}
