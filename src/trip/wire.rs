//! What a trip is told, and by whom: one datagram of JSON asks, one answers.
//!
//! The trip listens at a Unix socket in the worm's folder, which is its user's alone. Datagrams, so that nobody who says that the link is
//! there ever waits for a trip that is stopped.

use crate::failure::Failure;
use crate::topics::{Instance, RoleLock, Trip};
use serde::{Deserialize, Serialize};
use std::io;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use worm_plan::Order;

/// How long a trip may take to answer.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(3);
/// Longest datagram, bytes.
const MAX_DATAGRAM: usize = 16 << 10;

/// What may be asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Ask {
    /// Somebody attends. No answer.
    Alive,
    /// How does the trip stand?
    Status,
    /// Hold, and wait.
    Pause,
    /// Go on after a wait.
    Resume,
    /// Go home.
    Return,
    /// Go out again.
    Outbound,
    /// End the trip here.
    Abort,
}

impl Ask {
    /// As on the wire.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Alive => "alive",
            Self::Status => "status",
            Self::Pause => "pause",
            Self::Resume => "resume",
            Self::Return => "return",
            Self::Outbound => "outbound",
            Self::Abort => "abort",
        }
    }

    /// What the trip is to do; none where it is only asked.
    pub(super) const fn order(self) -> Option<Order> {
        match self {
            Self::Alive | Self::Status => None,
            Self::Pause => Some(Order::Pause),
            Self::Resume => Some(Order::Resume),
            Self::Return => Some(Order::Return),
            Self::Outbound => Some(Order::Outbound),
            Self::Abort => Some(Order::Abort),
        }
    }
}

/// The question.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Question {
    pub(crate) ask: Ask,
    /// Who asks, for the record.
    #[serde(default)]
    pub(crate) by: String,
}

/// The answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Answer {
    /// Why not; none when it was done.
    pub(crate) refusal: Option<String>,
    /// How the trip stands: a message of the topic `trip`.
    pub(crate) trip: serde_json::Value,
}

/// Where a trip listens. Its name goes when it is dropped.
#[derive(Debug)]
pub(super) struct Listener {
    socket: UnixDatagram,
    path: PathBuf,
}

/// A question, and where to send the answer; none for one who wants none.
pub(super) struct Asked {
    pub(super) question: Question,
    pub(super) from: Option<SocketAddr>,
}

impl Listener {
    /// Binds the socket, in the place of one that a killed trip has left. Only for who has the role of the trip.
    pub(super) fn bind(instance: &Instance) -> Result<Self, Failure> {
        let path = instance.trip_socket();
        Self::bind_at(&path).map_err(|error| {
            Failure::failed(format!(
                "{}: {error}: the worm's folder must be on a file system with sockets: set another topics.root",
                path.display()
            ))
        })
    }

    fn bind_at(path: &Path) -> io::Result<Self> {
        match std::fs::remove_file(path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let socket = UnixDatagram::bind(path)?;
        std::fs::set_permissions(path, PermissionsExt::from_mode(0o600))?;
        socket.set_nonblocking(true)?;
        Ok(Self {
            socket,
            path: path.to_owned(),
        })
    }

    /// The next question, if one is there. What cannot be understood is left out.
    pub(super) fn next(&self) -> Option<Asked> {
        let mut bytes = [0; MAX_DATAGRAM];
        loop {
            let (length, from) = self.socket.recv_from(&mut bytes).ok()?;
            match serde_json::from_slice(&bytes[..length]) {
                Ok(question) => {
                    return Some(Asked {
                        question,
                        from: (!from.is_unnamed()).then_some(from),
                    });
                }
                Err(error) => tracing::debug!("the trip was asked what it does not know: {error}"),
            }
        }
    }

    /// Answers. Whoever has gone meanwhile gets nothing.
    pub(super) fn answer(&self, to: &SocketAddr, answer: &Answer) {
        let sent = serde_json::to_vec(answer)
            .map_err(io::Error::other)
            .and_then(|bytes| self.socket.send_to_addr(&bytes, to));
        if let Err(error) = sent {
            tracing::debug!("who asked the trip has gone: {error}");
        }
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        if let Err(error) = std::fs::remove_file(&self.path) {
            tracing::debug!("{}: {error}", self.path.display());
        }
    }
}

/// Says to the trips of a worm that somebody attends. Never waits.
#[derive(Debug)]
pub(crate) struct Attendance {
    socket: UnixDatagram,
    path: PathBuf,
    bytes: Vec<u8>,
}

impl Attendance {
    /// # Errors
    /// When there is no socket to be had.
    pub(crate) fn open(instance: &Instance, by: &str) -> io::Result<Self> {
        let socket = UnixDatagram::unbound()?;
        socket.set_nonblocking(true)?;
        let question = Question {
            ask: Ask::Alive,
            by: by.to_owned(),
        };
        Ok(Self {
            socket,
            path: instance.trip_socket(),
            bytes: serde_json::to_vec(&question).map_err(io::Error::other)?,
        })
    }

    /// Says so now. Where there is no trip, nobody hears it; false then.
    pub(crate) fn say(&self) -> bool {
        self.socket.send_to(&self.bytes, &self.path).is_ok()
    }
}

/// Asks the trip of a worm, and waits for its answer.
///
/// # Errors
/// [`Failure::Failed`] when there is no trip, or it does not answer.
pub(crate) fn ask(instance: &Instance, question: &Question) -> Result<Answer, Failure> {
    static NUMBER: AtomicU64 = AtomicU64::new(0);
    let worm = instance.worm();
    let failed = |error: io::Error| match RoleLock::<Trip>::holder(instance) {
        None => Failure::failed(format!("{worm} makes no trip: begin one with `wormd trip ROUTE.csv`")),
        Some(pid) => Failure::failed(format!("the trip of {worm} (process {pid}) does not answer: {error}")),
    };
    let number = NUMBER.fetch_add(1, Ordering::Relaxed);
    let own = format!("wormd-trip/{}/{number}", std::process::id());
    let asked = || -> io::Result<Answer> {
        let socket = UnixDatagram::bind_addr(&SocketAddr::from_abstract_name(own)?)?;
        socket.set_nonblocking(true)?;
        socket.send_to(&serde_json::to_vec(question)?, instance.trip_socket())?;
        socket.set_nonblocking(false)?;
        socket.set_read_timeout(Some(ANSWER_TIMEOUT))?;
        let mut bytes = [0; MAX_DATAGRAM];
        let length = socket.recv(&mut bytes)?;
        Ok(serde_json::from_slice(&bytes[..length])?)
    };
    asked().map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn questions_are_what_the_documentation_says() {
        for (text, ask) in [
            (r#"{"ask":"alive"}"#, Ask::Alive),
            (r#"{"ask":"return","by":"ann"}"#, Ask::Return),
            (r#"{"ask":"resume","by":"ann","later":true}"#, Ask::Resume),
        ] {
            let question: Question = serde_json::from_str(text).expect(text);
            assert_eq!(question.ask, ask);
            assert!(text.contains(&format!("\"{}\"", ask.name())));
        }
        assert!(serde_json::from_str::<Question>(r#"{"ask":"crawl"}"#).is_err());
    }

    #[test]
    fn who_is_alive_waits_for_nobody_and_nonsense_is_left_out() {
        let root = tempfile::tempdir_in("/dev/shm").expect("a folder in /dev/shm");
        let path = root.path().join("trip.sock");
        let listener = Listener::bind_at(&path).expect("it can be bound");
        let socket = UnixDatagram::unbound().expect("a socket");
        socket.set_nonblocking(true).expect("it can be set");
        socket.send_to(b"nonsense", &path).expect("there is room");
        let attendance = Attendance {
            socket,
            path: path.clone(),
            bytes: br#"{"ask":"alive"}"#.to_vec(),
        };
        // More than anybody reads.
        for _ in 0..10_000 {
            attendance.say();
        }
        let asked = listener.next().expect("somebody was there");
        assert!(asked.question.ask == Ask::Alive && asked.from.is_none());
        drop(listener);
        assert!(!attendance.say() && !path.exists());
    }
}
