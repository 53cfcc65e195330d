//! A watcher's end: connects to the relay of a worm, starts one where there is none, and connects again when it is gone.

use super::connection::Connection;
use super::wire::{Line, Request};
use crate::failure::Failure;
use crate::realtime::monotonic_ns;
use crate::topics::{Controller, Instance, Relay, RoleLock};
use crossbeam::channel::{Receiver, bounded};
use std::ffi::OsString;
use std::io::{self, BufRead, BufReader};
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// How often a connection is tried while there is none.
const RETRY: Duration = Duration::from_millis(100);
/// How long a relay may take to start: cleaning up after a killed worm takes the longest.
const START_TIMEOUT: Duration = Duration::from_secs(20);
/// How long after a failure a relay is started once more.
const RESTART: Duration = Duration::from_secs(2);
/// Lines of the log of a relay that this process has started.
const LOG_LINES: usize = 256;

/// What a watcher learns.
#[derive(Debug)]
pub(crate) enum Received {
    /// A line of the relay.
    Line(Line),
    /// The connection was lost, for this reason; it will be tried again.
    Lost(String),
    /// A line of the log of the relay that this process has started.
    Log(String),
}

/// The connection to the relay of one worm, there or not.
pub(crate) struct RelayLink {
    instance: Instance,
    /// The arguments with which a relay of this worm is started.
    arguments: Vec<OsString>,
    /// Name of this watcher.
    name: String,
    connection: Option<Connection>,
    started: Option<Started>,
    tried: Option<Instant>,
    start_not_before: Instant,
    problem: Option<String>,
    /// Whether this watcher says by itself that it is there.
    is_attending: bool,
}

/// A relay that this process has started.
struct Started {
    process: Child,
    since: Instant,
    log: Receiver<String>,
    last_line: Option<String>,
    /// Whether there was a connection since it was started.
    has_served: bool,
}

impl RelayLink {
    /// A link that is not connected yet. `arguments` select the worm.
    pub(crate) fn new(instance: &Instance, arguments: Vec<OsString>, name: String) -> Self {
        Self {
            instance: instance.clone(),
            arguments,
            name,
            connection: None,
            started: None,
            tried: None,
            start_not_before: Instant::now(),
            problem: None,
            is_attending: true,
        }
    }

    /// Whether somebody is behind this watcher. Until it is told otherwise, it says so all the time.
    pub(crate) fn set_attending(&mut self, is_attending: bool) {
        self.is_attending = is_attending;
    }

    /// Connects, and starts a relay if there is none; waits until that has succeeded.
    ///
    /// # Errors
    /// [`Failure::Unusable`] when no such worm runs; [`Failure::Failed`] when its relay does not start.
    pub(crate) fn wait_until_connected(&mut self) -> Result<(), Failure> {
        let begun = Instant::now();
        loop {
            self.tried = None;
            self.connect();
            if self.connection.is_some() {
                return Ok(());
            }
            if RoleLock::<Controller>::holder(&self.instance).is_none() {
                let worm = self.instance.worm();
                let failure = format!(
                    "no worm {worm} is running: start it with `wormd up --name {worm}`, or give the name of another with --name"
                );
                self.instance.remove_folder_if_empty();
                return Err(Failure::unusable(failure));
            }
            if let Some(problem) = &self.problem
                && RoleLock::<Relay>::holder(&self.instance).is_none()
            {
                return Err(Failure::failed(problem.clone()));
            }
            if begun.elapsed() > START_TIMEOUT {
                return Err(Failure::failed(format!(
                    "the relay of {} did not take this watcher within {START_TIMEOUT:?}: `wormd relay` says why",
                    self.instance.worm()
                )));
            }
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// What is new. Says that this watcher is there, and connects again where that is needed. Never waits.
    pub(crate) fn poll(&mut self) -> Vec<Received> {
        let mut received = self.take_log();
        if self.connection.is_none() {
            self.connect();
        }
        let Some(connection) = &mut self.connection else {
            return received;
        };
        if self.is_attending {
            connection.say_alive();
        }
        match connection.exchange() {
            Ok(lines) => received.extend(lines.into_iter().map(Received::Line)),
            Err((lines, reason)) => {
                let is_refused = matches!(lines.last(), Some(Line::Refused { .. }));
                received.extend(lines.into_iter().map(Received::Line));
                received.push(Received::Lost(reason));
                self.connection = None;
                // It would be refused again.
                let pause = if is_refused { RESTART } else { Duration::ZERO };
                self.tried = Some(Instant::now() + pause);
            }
        }
        received
    }

    /// Whether there is a connection.
    pub(crate) fn is_connected(&self) -> bool {
        self.connection.is_some()
    }

    /// Asks for something; false without a connection.
    pub(crate) fn send(&mut self, id: u64, request: Request) -> bool {
        self.send_asked(id, request, monotonic_ns())
    }

    /// The same for what was asked for at this time, ns of `CLOCK_MONOTONIC`.
    pub(crate) fn send_asked(&mut self, id: u64, request: Request, asked_ns: u64) -> bool {
        match &mut self.connection {
            Some(connection) => connection.send_asked(Some(id), request, asked_ns),
            None => false,
        }
    }

    /// The connection's socket, which can be read when there is something to poll for.
    #[cfg(any(feature = "bridge", feature = "dashboard"))]
    pub(crate) fn stream(&self) -> Option<&std::os::unix::net::UnixStream> {
        self.connection.as_ref().map(Connection::stream)
    }

    /// Ends the connection, if there is one.
    pub(crate) fn close(&mut self) {
        self.connection = None;
    }

    /// Why there is no connection at present, where that is known.
    pub(crate) fn problem(&self) -> Option<&str> {
        match self.connection {
            Some(_) => None,
            None => self.problem.as_deref(),
        }
    }

    fn connect(&mut self) {
        if self.tried.is_some_and(|tried| tried.elapsed() < RETRY) {
            return;
        }
        self.tried = Some(Instant::now());
        match Connection::open(&self.instance, &self.name) {
            Ok(connection) => {
                self.connection = Some(connection);
                self.problem = None;
                if let Some(started) = &mut self.started {
                    started.has_served = true;
                }
            }
            Err(error) => {
                tracing::debug!("the relay of {}: {error}", self.instance.worm());
                self.start_relay();
            }
        }
    }

    /// Starts a relay, unless one is starting or there is no worm.
    fn start_relay(&mut self) {
        if let Some(started) = &mut self.started {
            let has_ended = !matches!(started.process.try_wait(), Ok(None));
            if !has_ended && started.since.elapsed() < START_TIMEOUT {
                return;
            }
            let has_served = started.has_served;
            started.last_line = started.log.try_iter().last().or(started.last_line.take());
            let last_line = started.last_line.take().unwrap_or_default();
            self.started = None;
            if !has_served {
                // Another one may have been faster; then there soon is something to connect to.
                self.problem = Some(format!("the relay could not be started: {last_line}"));
                self.start_not_before = Instant::now() + RESTART;
                return;
            }
        }
        if Instant::now() < self.start_not_before {
            return;
        }
        if RoleLock::<Controller>::holder(&self.instance).is_none() {
            self.problem = Some("the worm does not run".to_owned());
            return;
        }
        self.problem = None;
        match Started::new(&self.arguments) {
            Ok(started) => self.started = Some(started),
            Err(error) => {
                self.problem = Some(format!("the relay cannot be started: {error}"));
                self.start_not_before = Instant::now() + RESTART;
            }
        }
    }

    fn take_log(&mut self) -> Vec<Received> {
        let Some(started) = &mut self.started else {
            return Vec::new();
        };
        let lines: Vec<_> = started.log.try_iter().collect();
        if let Some(last) = lines.last() {
            started.last_line = Some(last.clone());
        }
        lines.into_iter().map(Received::Log).collect()
    }
}

impl Started {
    /// Starts `wormd relay` as a process of its own, which goes on when this one ends.
    fn new(arguments: &[OsString]) -> io::Result<Self> {
        let mut command = Command::new(std::env::current_exe()?);
        command
            .arg("relay")
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        // SAFETY: setsid is async-signal-safe, and nothing is allocated between fork and exec.
        unsafe {
            // Neither Ctrl-C nor the end of this terminal is meant for it.
            command.pre_exec(|| nix::unistd::setsid().map(drop).map_err(io::Error::from));
        }
        let mut process = command.spawn()?;
        let (sender, log) = bounded(LOG_LINES);
        if let Some(stderr) = process.stderr.take() {
            std::thread::Builder::new()
                .name("relay-log".to_owned())
                .spawn(move || {
                    for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                        // A log that nobody takes is no reason to hold up the relay.
                        let _ = sender.try_send(line);
                    }
                })?;
        }
        Ok(Self {
            process,
            since: Instant::now(),
            log,
            last_line: None,
            has_served: false,
        })
    }
}
