//! A watcher at a socket that speaks the relay's language, as any program may be one.

use serde_json::{Value, json};
use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::{Duration, Instant};

/// How often it says that it is there.
const ALIVE: Duration = Duration::from_millis(200);

pub struct Watcher {
    stream: UnixStream,
    input: Vec<u8>,
    said: Instant,
    last_id: u64,
    lost: u64,
}

impl Watcher {
    pub fn connect(socket: &Path, name: &str) -> Self {
        let stream = UnixStream::connect(socket).expect("the socket takes watchers");
        stream
            .set_read_timeout(Some(Duration::from_millis(20)))
            .expect("can be set");
        let mut watcher = Self {
            stream,
            input: Vec::new(),
            said: Instant::now(),
            last_id: 0,
            lost: 0,
        };
        watcher.write(&json!({"command": "hello", "version": 1, "name": name}));
        watcher
    }

    /// Writes a line as it is.
    pub fn write(&mut self, line: &Value) {
        self.stream.write_all(format!("{line}\n").as_bytes()).expect("it reads");
    }

    /// The next line, or none for a moment. Says that it is there, meanwhile.
    fn line(&mut self) -> Option<Value> {
        if self.said.elapsed() >= ALIVE {
            self.said = Instant::now();
            self.write(&json!({"command": "alive"}));
        }
        if !self.input.contains(&b'\n') {
            let mut bytes = [0; 65_536];
            match self.stream.read(&mut bytes) {
                Ok(0) => panic!("the connection has ended"),
                Ok(count) => self.input.extend_from_slice(&bytes[..count]),
                Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
                Err(error) => panic!("{error}"),
            }
        }
        let end = self.input.iter().position(|byte| *byte == b'\n')?;
        let line: Vec<u8> = self.input.drain(..=end).collect();
        let line: Value = serde_json::from_slice(&line).expect("JSON");
        self.lost += line["lost"]["frames"].as_u64().unwrap_or(0);
        Some(line)
    }

    fn wait(&mut self, what: &str, patience: Duration, is_it: impl Fn(&Value) -> bool) -> Value {
        let begun = Instant::now();
        loop {
            if let Some(line) = self.line().filter(&is_it) {
                return line;
            }
            assert!(begun.elapsed() < patience, "no {what} within {patience:?}");
        }
    }

    pub fn hello(&mut self, patience: Duration) -> Value {
        self.wait("hello", patience, |line| line["hello"].is_object())["hello"].take()
    }

    /// The next frame of which this is true.
    pub fn frame(&mut self, patience: Duration, is_it: impl Fn(&Value) -> bool) -> Value {
        self.wait("such frame", patience, |line| {
            line["frame"].is_object() && is_it(&line["frame"])
        })["frame"]
            .take()
    }

    /// Asks, and does not wait.
    pub fn send(&mut self, command: &str) -> u64 {
        self.last_id += 1;
        self.write(&json!({"id": self.last_id, "command": command}));
        self.last_id
    }

    /// Asks, and waits for the answer.
    pub fn ask(&mut self, command: &str, patience: Duration) -> Value {
        let id = self.send(command);
        self.answer(id, patience)
    }

    /// The answer to the request with this number.
    pub fn answer(&mut self, id: u64, patience: Duration) -> Value {
        let what = format!("answer to request {id}");
        self.wait(&what, patience, |line| line["answer"]["id"] == json!(id))["answer"].take()
    }

    /// Reads for a while.
    pub fn listen(&mut self, time: Duration) {
        let begun = Instant::now();
        while begun.elapsed() < time {
            self.line();
        }
    }

    /// Frames that were said to be lost.
    pub fn lost(&self) -> u64 {
        self.lost
    }
}
