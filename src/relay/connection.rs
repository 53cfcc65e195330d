//! One connection to a relay: lines out and in, without waiting for either.

use super::wire::{AnyHello, Line, Request, RequestLine, VERSION, to_bytes};
use crate::realtime::monotonic_ns;
use crate::topics::Instance;
use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

/// How often a watcher says that it is there: the relay counts on a driver's word.
const ALIVE_INTERVAL: Duration = Duration::from_millis(200);
/// Longest line of a relay, bytes: the history of a worm with 16 cells takes 2 MB.
const MAX_LINE: usize = 32 << 20;
/// Requests that may wait for a relay that reads nothing, bytes.
const MAX_OUTPUT: usize = 64 << 10;

/// A connection to a relay.
pub(crate) struct Connection {
    stream: UnixStream,
    input: VecDeque<u8>,
    /// How much of the input has been searched for the end of a line.
    searched: usize,
    output: Vec<u8>,
    alive_said: Instant,
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
        // Now, and not when it is written: the relay may read it much later.
        self.send_asked(id, request, monotonic_ns())
    }

    /// Queues a request that was asked for at this time, ns of `CLOCK_MONOTONIC`; false when the relay does not read.
    pub(crate) fn send_asked(&mut self, id: Option<u64>, request: Request, asked_ns: u64) -> bool {
        let line = RequestLine {
            id,
            sent_ns: Some(asked_ns),
            request,
        };
        let Ok(line) = to_bytes(&line) else {
            return false;
        };
        let has_room = self.output.len() + line.len() <= MAX_OUTPUT;
        if has_room {
            self.output.extend(line);
        }
        has_room
    }

    /// Says that this watcher is there, where that was not said for a while.
    pub(crate) fn say_alive(&mut self) {
        if self.alive_said.elapsed() >= ALIVE_INTERVAL {
            self.alive_said = Instant::now();
            self.send(None, Request::Alive);
        }
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
            (r#"{"sent_ns":7,"command":"take_over"}"#, Request::TakeOver),
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
