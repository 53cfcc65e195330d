//! One watcher's connection.

use super::outbox::{Outbox, Overflow, SharedLine};
use super::socket::peer_of;
use super::source::Seen;
use super::wire::{Answer, Line, MAX_REQUEST, to_bytes};
use crate::failure::Failure;
use nix::sys::socket::{setsockopt, sockopt::SndBuf};
use std::io::{self, Read};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::time::Instant;

/// What the kernel keeps for one watcher, bytes: what is old by the time it is read is of no use.
const SEND_BUFFER: usize = 64 << 10;
/// Most watchers of one socket.
const MAX_WATCHERS: usize = 256;

/// One connection.
pub(crate) struct Watcher {
    pub(crate) stream: UnixStream,
    /// Its user, by the kernel.
    pub(crate) user: u32,
    pub(crate) input: Vec<u8>,
    pub(crate) outbox: Outbox,
    /// What there was of the worm in the last line that it was sent about it.
    pub(crate) seen: Seen,
    /// When it last took something, or nothing waited for it.
    pub(crate) took: Instant,
    /// Once everything is sent, it is closed.
    pub(crate) is_refused: bool,
}

/// A connection that is over, and why, where that is of interest.
pub(crate) struct Gone(pub(crate) Option<String>);

impl From<Overflow> for Gone {
    fn from(_: Overflow) -> Self {
        Self(Some("it asks and does not read the answers".to_owned()))
    }
}

impl Watcher {
    /// Takes a connection, with its process. It is refused where its user is neither this one nor root, or `connected` are as many as there may be;
    /// `offered` is what it wants to watch.
    ///
    /// # Errors
    /// From the operating system, when the connection has ended.
    pub(crate) fn admit(stream: UnixStream, offered: &str, connected: usize) -> io::Result<(Self, i32)> {
        stream.set_nonblocking(true)?;
        setsockopt(&stream, SndBuf, &SEND_BUFFER)?;
        let (user, pid) = peer_of(&stream)?;
        let mut watcher = Self {
            stream,
            user,
            input: Vec::new(),
            outbox: Outbox::default(),
            seen: Seen::default(),
            took: Instant::now(),
            is_refused: false,
        };
        let own = nix::unistd::geteuid().as_raw();
        if user != own && user != 0 {
            watcher.refuse(format!(
                "this {offered} belongs to user {own}: only that user and root may watch it"
            ));
        } else if connected >= MAX_WATCHERS {
            watcher.refuse(format!("{MAX_WATCHERS} watchers are connected already: close some"));
        }
        Ok((watcher, pid))
    }

    /// Reads what is there; returns its whole lines.
    pub(crate) fn read(&mut self) -> Result<Vec<Vec<u8>>, Gone> {
        let mut bytes = [0; MAX_REQUEST];
        // Once: who sends more gets its next turn after the others.
        match self.stream.read(&mut bytes) {
            Ok(0) => return Err(Gone(None)),
            Ok(count) => self.input.extend_from_slice(&bytes[..count]),
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted) => {}
            Err(_) => return Err(Gone(None)),
        }
        let mut lines = Vec::new();
        while let Some(end) = self.input.iter().position(|byte| *byte == b'\n') {
            let rest = self.input.split_off(end + 1);
            let mut line = std::mem::replace(&mut self.input, rest);
            line.pop();
            if !line.is_empty() {
                lines.push(line);
            }
        }
        if self.input.len() > MAX_REQUEST {
            return Err(Gone(Some(format!("its line is longer than {MAX_REQUEST} bytes"))));
        }
        Ok(lines)
    }

    /// Sends an answer, once there is room for it.
    pub(crate) fn answer(&mut self, answer: Answer) -> Result<(), Gone> {
        let line = shared(&Line::Answer(answer)).map_err(|failure| Gone(Some(failure.to_string())))?;
        Ok(self.outbox.add(line)?)
    }

    /// Says why, and closes the connection after that.
    pub(crate) fn refuse(&mut self, reason: String) {
        self.is_refused = true;
        if let Ok(line) = shared(&Line::Refused { reason }) {
            // It is the first line, or one of few.
            let _ = self.outbox.add(line);
        }
    }
}

/// A line for several watchers.
pub(crate) fn shared(line: &Line) -> Result<SharedLine, Failure> {
    to_bytes(line).map(Arc::new).map_err(Failure::failed)
}
