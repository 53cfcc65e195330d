//! A watcher's end: connects to the relay of a worm, starts one where there is none, and connects again when it is gone.

use super::wire::{AnyHello, Line, Request, RequestLine, VERSION, to_bytes};
use crate::failure::Failure;
use crate::topics::{Controller, Instance, Relay, RoleLock};
use crossbeam::channel::{Receiver, bounded};
use std::collections::VecDeque;
use std::ffi::OsString;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// How often a watcher says that it is there: the relay counts on a driver's word.
pub(crate) const ALIVE_INTERVAL: Duration = Duration::from_millis(200);
/// How often a connection is tried while there is none.
const RETRY: Duration = Duration::from_millis(100);
/// How long a relay may take to start: cleaning up after a killed worm takes the longest.
const START_TIMEOUT: Duration = Duration::from_secs(20);
/// How long after a failure a relay is started once more.
const RESTART: Duration = Duration::from_secs(2);
/// Longest line of a relay, bytes: the history of a worm with 16 cells takes 2 MB.
const MAX_LINE: usize = 32 << 20;
/// Requests that may wait for a relay that reads nothing, bytes.
const MAX_OUTPUT: usize = 64 << 10;
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

/// A connection to a relay.
pub(crate) struct Connection {
    stream: UnixStream,
    input: VecDeque<u8>,
    /// How much of the input has been searched for the end of a line.
    searched: usize,
    output: Vec<u8>,
    alive_said: Instant,
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
    #[cfg(feature = "bridge")]
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
        if self.is_attending && connection.alive_said.elapsed() >= ALIVE_INTERVAL {
            connection.alive_said = Instant::now();
            connection.send(None, Request::Alive);
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

    /// Asks for something; false without a connection.
    pub(crate) fn send(&mut self, id: u64, request: Request) -> bool {
        match &mut self.connection {
            Some(connection) => connection.send(Some(id), request),
            None => false,
        }
    }

    /// The connection's socket, which can be read when there is something to poll for.
    #[cfg(any(feature = "bridge", feature = "dashboard"))]
    pub(crate) fn stream(&self) -> Option<&UnixStream> {
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

impl Connection {
    /// Connects to the relay of a worm, as the watcher `name`.
    ///
    /// # Errors
    /// When there is no relay, or it does not take connections.
    pub(crate) fn open(instance: &Instance, name: &str) -> io::Result<Self> {
        let stream = UnixStream::connect(instance.relay_socket())?;
        stream.set_nonblocking(true)?;
        let mut connection = Self {
            stream,
            input: VecDeque::new(),
            searched: 0,
            output: Vec::new(),
            alive_said: Instant::now(),
        };
        let name = name.to_owned();
        connection.send(None, Request::Hello { version: VERSION, name });
        Ok(connection)
    }

    /// Queues a request; false when the relay does not read.
    pub(crate) fn send(&mut self, id: Option<u64>, request: Request) -> bool {
        let Ok(line) = to_bytes(&RequestLine { id, request }) else {
            return false;
        };
        let has_room = self.output.len() + line.len() <= MAX_OUTPUT;
        if has_room {
            self.output.extend(line);
        }
        has_room
    }

    /// Writes and reads what can be without waiting. The error has the lines before it, and why the connection is over.
    pub(crate) fn exchange(&mut self) -> Result<Vec<Line>, (Vec<Line>, String)> {
        let mut lines = Vec::new();
        let outcome = self.write().and_then(|()| self.read());
        let over = loop {
            match self.next_line() {
                Ok(Some(line)) => lines.push(line),
                Ok(None) => {
                    break outcome
                        .err()
                        .map(|error| format!("the connection to the relay was lost ({error})"));
                }
                Err(reason) => break Some(reason),
            }
        };
        if let Some(Line::Refused { reason }) = lines.last() {
            let reason = reason.clone();
            return Err((lines, reason));
        }
        match over {
            None => Ok(lines),
            Some(reason) => Err((lines, reason)),
        }
    }

    /// Can be read when there is something to exchange.
    #[cfg(any(feature = "bridge", feature = "dashboard"))]
    pub(crate) fn stream(&self) -> &UnixStream {
        &self.stream
    }

    fn write(&mut self) -> io::Result<()> {
        while !self.output.is_empty() {
            match self.stream.write(&self.output) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(count) => drop(self.output.drain(..count)),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                // What the relay said last can still be read, and says why.
                Err(error) if error.kind() == io::ErrorKind::BrokenPipe => break,
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    fn read(&mut self) -> io::Result<()> {
        let mut bytes = [0; 64 << 10];
        loop {
            match self.stream.read(&mut bytes) {
                Ok(0) => return Err(io::Error::new(io::ErrorKind::UnexpectedEof, "it has ended")),
                Ok(count) => self.input.extend(&bytes[..count]),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(()),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
            if self.input.len() > MAX_LINE {
                return Ok(());
            }
        }
    }

    /// The next whole line; an error when it cannot be understood.
    fn next_line(&mut self) -> Result<Option<Line>, String> {
        let found = self.input.iter().skip(self.searched).position(|byte| *byte == b'\n');
        let Some(end) = found.map(|at| self.searched + at) else {
            self.searched = self.input.len();
            if self.searched > MAX_LINE {
                return Err(format!("the relay sent a line of more than {MAX_LINE} bytes"));
            }
            return Ok(None);
        };
        let line: Vec<u8> = self.input.drain(..=end).collect();
        self.searched = 0;
        read_line(&line).map(Some)
    }
}

/// Reads a line of a relay.
///
/// # Errors
/// In words, for one that cannot be understood, and for a relay of a newer version.
pub(crate) fn read_line(line: &[u8]) -> Result<Line, String> {
    // Of a newer version nothing else may be readable.
    if let Ok(AnyHello { hello }) = serde_json::from_slice(line)
        && hello.version > VERSION
    {
        return Err(format!(
            "the relay speaks version {} and this wormd {VERSION}: use the same wormd on both ends, or end the relay (`wormd relay` of \
             this one takes its place)",
            hello.version
        ));
    }
    serde_json::from_slice(line).map_err(|error| format!("the relay sent what cannot be read ({error})"))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relay::wire::Answer;

    #[test]
    fn a_relay_of_another_version_is_refused_in_words_and_new_fields_are_not() {
        let newer = format!("{{\"hello\":{{\"version\":{},\"anything\":[]}}}}", VERSION + 1);
        let refusal = read_line(newer.as_bytes()).expect_err("is newer");
        assert!(refusal.contains("use the same wormd on both ends"), "{refusal}");
        for damaged in [
            "",
            "{",
            "[]",
            "{\"frame\":{}}",
            "{\"hello\":{\"version\":-1}}",
            "{\"mood\":{}}",
        ] {
            let refusal = read_line(damaged.as_bytes()).expect_err(damaged);
            assert!(refusal.contains("cannot be read"), "{refusal}");
        }
        let answer = Answer::own(7, Some(3), "hold", "accepted", None);
        let mut text = serde_json::to_value(Line::Answer(answer.clone())).expect("can be written");
        text["answer"]["new"] = 1.into();
        let read = read_line(text.to_string().as_bytes()).expect("can be read");
        assert!(matches!(read, Line::Answer(read) if read == answer));
    }

    proptest::proptest! {
        /// Both readers take any line, and refuse it in a text that is not much longer.
        #[test]
        fn any_line_is_read_or_refused_in_words(
            any in proptest::collection::vec(proptest::num::u8::ANY, 0..200),
            which in 0..4_usize,
            at in proptest::num::usize::ANY,
        ) {
            let whole: [&[u8]; 4] = [
                br#"{"id":1,"command":"crawl","cycles_per_s":0.4}"#,
                br#"{"command":"acknowledge","alarms":["motor-stall"]}"#,
                br#"{"answer":{"id":1,"watcher":7,"command":"hold","verdict":"accepted"}}"#,
                br#"{"lost":{"frames":3}}"#,
            ];
            let mut mutated = whole[which].to_vec();
            let at = at % mutated.len();
            drop(mutated.splice(at..at, any.iter().copied().take(3)));
            for line in [any, mutated] {
                if let Err(refusal) = read_line(&line) {
                    proptest::prop_assert!(!refusal.is_empty() && refusal.len() < 300 + 4 * line.len());
                }
                if let Err(error) = serde_json::from_slice::<RequestLine>(&line) {
                    proptest::prop_assert!(error.to_string().len() < 300 + 4 * line.len());
                }
            }
        }
    }

    #[test]
    fn requests_are_what_the_documentation_says() {
        for (text, request) in [
            (r#"{"command":"alive"}"#, Request::Alive),
            (r#"{"command":"take_over"}"#, Request::TakeOver),
            (r#"{"command":"crawl"}"#, Request::Crawl { cycles_per_s: None }),
            (
                r#"{"command":"crawl","cycles_per_s":-0.25}"#,
                Request::Crawl {
                    cycles_per_s: Some(-0.25),
                },
            ),
            (
                r#"{"command":"acknowledge","alarms":["motor-stall"]}"#,
                Request::Acknowledge {
                    alarms: vec!["motor-stall".to_owned()],
                },
            ),
        ] {
            let read: RequestLine = serde_json::from_str(text).expect(text);
            assert_eq!(read.request, request);
            assert_eq!(serde_json::to_string(&read).expect("can be written"), text);
        }
        let numbered: RequestLine = serde_json::from_str(r#"{"id":9,"command":"hold","later":true}"#).expect("is one");
        assert_eq!((numbered.id, numbered.request), (Some(9), Request::Hold));
    }
}
