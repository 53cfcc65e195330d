//! The connection of a page that drives: a watcher of its own, which is heard when the page is.

use super::caller::Caller;
use crate::relay::connection::Connection;
use crate::relay::wire::{Answer, Line, Request, VERSION};
use crate::topics::Instance;
use std::collections::BTreeMap;
use std::io;
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};
use tokio::sync::oneshot;

/// How long a page may say nothing before its connection is closed. The relay takes the wheel from it much earlier.
const IDLE: Duration = Duration::from_secs(10);

/// Takes the relay's answer, or why there is none.
pub(super) type Reply = oneshot::Sender<Result<Answer, String>>;

/// The seat of one page.
pub(super) struct Seat {
    connection: Connection,
    name: String,
    pending: BTreeMap<u64, Reply>,
    heard: Instant,
}

impl Seat {
    /// Connects as the watcher `name`.
    pub(super) fn open(instance: &Instance, name: &str) -> io::Result<Self> {
        Ok(Self {
            connection: Connection::open(instance, name)?,
            name: name.to_owned(),
            pending: BTreeMap::new(),
            heard: Instant::now(),
        })
    }

    /// Passes on a request of the page.
    pub(super) fn ask(&mut self, id: u64, caller: &Caller, request: Request, reply: Reply) {
        let name = &caller.name;
        self.heard = Instant::now();
        if *name != self.name {
            name.clone_into(&mut self.name);
            let hello = Request::Hello {
                version: VERSION,
                name: name.clone(),
            };
            self.connection.send(None, hello);
        }
        match self.connection.send_asked(Some(id), request, caller.asked.at_ns()) {
            true => drop(self.pending.insert(id, reply)),
            false => drop(reply.send(Err("the relay does not read: try again".to_owned()))),
        }
    }

    /// Passes on that the page was there at this time, ns.
    pub(super) fn alive(&mut self, at_ns: u64) {
        self.heard = Instant::now();
        self.connection.send_asked(None, Request::Alive, at_ns);
    }

    /// Writes and reads; false when the connection is over.
    pub(super) fn exchange(&mut self) -> bool {
        let (lines, problem) = match self.connection.exchange() {
            Ok(lines) => (lines, None),
            Err((lines, problem)) => (lines, Some(problem)),
        };
        for line in lines {
            if let Line::Answer(answer) = line
                && let Some(reply) = answer.id.and_then(|id| self.pending.remove(&id))
            {
                // Who asked may have gone.
                let _ = reply.send(Ok(answer));
            }
        }
        if let Some(problem) = &problem {
            for reply in std::mem::take(&mut self.pending).into_values() {
                let _ = reply.send(Err(problem.clone()));
            }
        }
        problem.is_none() && self.heard.elapsed() < IDLE
    }

    /// Can be read when there is something to exchange.
    pub(super) fn stream(&self) -> &UnixStream {
        self.connection.stream()
    }
}
