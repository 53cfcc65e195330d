//! The relay and its watchers: real processes, real sockets, a real terminal. The clients here are written from docs/relay.md alone.

use super::any_order::make_crawl_again;
use super::attending::{COLUMNS, ROWS, stalled_terminal};
use super::process::{Process, wait_for};
use super::worm::Worm;
use super::{Crawling, PATIENCE};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::{Value, json};
use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use worm_estimator::message::{CommandKind, Mode};

/// A watcher that reads JSON lines.
pub struct Client {
    stream: UnixStream,
    input: Vec<u8>,
    lines: Vec<Value>,
}

impl Client {
    pub fn connect(worm: &Worm) -> Self {
        let socket = worm.folder().join("relay.sock");
        let mut stream = None;
        wait_for("a relay that listens", PATIENCE, || {
            stream = UnixStream::connect(&socket).ok();
            stream.is_some()
        });
        let stream = stream.expect("is connected");
        stream.set_nonblocking(true).expect("can be set");
        Self {
            stream,
            input: Vec::new(),
            lines: Vec::new(),
        }
    }

    /// Reads what is there; false once the relay has closed the connection.
    fn read(&mut self) -> bool {
        let mut bytes = [0; 65_536];
        let mut is_open = true;
        while is_open {
            match self.stream.read(&mut bytes) {
                Ok(0) => is_open = false,
                Ok(count) => self.input.extend_from_slice(&bytes[..count]),
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) => panic!("the relay's socket: {error}"),
            }
        }
        while let Some(end) = self.input.iter().position(|byte| *byte == b'\n') {
            let line: Vec<u8> = self.input.drain(..=end).collect();
            self.lines
                .push(serde_json::from_slice(&line).expect("each line is one JSON object"));
        }
        is_open
    }

    fn send(&mut self, request: &Value) {
        let line = format!("{request}\n");
        self.stream
            .write_all(line.as_bytes())
            .expect("there is room for a line");
    }

    /// Sends a command and waits for its answer.
    fn ask(&mut self, command: &str) -> Value {
        let id = self.lines.len() as u64 + 1000;
        self.send(&json!({"command": command, "id": id}));
        let mut answer = None;
        wait_for("an answer", PATIENCE, || {
            self.read();
            let mut answers = self.lines.iter().filter_map(|line| line.get("answer"));
            answer = answers.find(|answer| answer["id"] == id).cloned();
            answer.is_some()
        });
        answer.expect("was found")
    }

    fn of<'a>(&'a self, kind: &'a str) -> impl Iterator<Item = &'a Value> {
        self.lines.iter().filter_map(move |line| line.get(kind))
    }

    fn wait_for_frames(&mut self, count: usize) {
        wait_for("frames", PATIENCE, || {
            assert!(self.read(), "the relay is there");
            self.of("frame").count() >= count
        });
    }

    /// Waits until the topic that every recording has says this of whoever asked.
    pub fn wait_for_record(&mut self, kind: &str, sender_ends: &str) {
        wait_for(kind, PATIENCE, || {
            assert!(self.read(), "the relay is there");
            let records = self.of("frame").filter_map(|frame| frame["commands"].as_array());
            records.flatten().any(|record| {
                record["kind"] == kind
                    && record["sender"]
                        .as_str()
                        .is_some_and(|sender| sender.ends_with(sender_ends))
            })
        });
    }

    fn newest(&self) -> &Value {
        self.of("frame").last().expect("a frame")
    }
}

/// A worm at work, and its relay.
pub fn crawling_with_relay(name: &str) -> (Process, Crawling) {
    let crawling = Crawling::start_again(Worm::on_a_steady_computer(name));
    (crawling.worm.wormd(&["relay"]).start_with_log(), crawling)
}

fn resident_mb(process: &Process) -> f64 {
    let status = std::fs::read_to_string(format!("/proc/{}/status", process.id())).expect("is alive");
    let line = status
        .lines()
        .find(|line| line.starts_with("VmRSS"))
        .expect("has memory");
    let kb = line.split_whitespace().nth(1).expect("a number");
    kb.parse::<f64>().expect("a number") / 1024.0
}

#[test]
fn who_joins_late_gets_the_history_first() {
    let (relay, crawling) = crawling_with_relay("w-late");
    let mut first = Client::connect(&crawling.worm);
    wait_for("a finished cycle", PATIENCE, || {
        assert!(first.read());
        first
            .of("frame")
            .any(|frame| frame["cycles"].as_array().is_some_and(|cycles| !cycles.is_empty()))
    });
    let mut late = Client::connect(&crawling.worm);
    late.wait_for_frames(3);
    let hello = &late.lines[0]["hello"];
    assert_eq!((&hello["version"], &hello["worm"]["cells"]), (&json!(1), &json!(4)));
    let length = |of: &Value| of.as_array().map_or(0, Vec::len);
    assert!(
        length(&hello["cycles"]) >= 1 && length(&hello["samples"]) >= 5,
        "{hello}"
    );
    let sample = &hello["samples"][length(&hello["samples"]) - 1];
    assert!(
        sample["position_m"][0].is_f64() && length(&sample["deformation_m"]) == 4,
        "{sample}"
    );
    // Nothing twice, nothing missing.
    let frames: Vec<u64> = late.of("frame").filter_map(|frame| frame["number"].as_u64()).collect();
    assert!(frames.windows(2).all(|pair| pair[1] == pair[0] + 1), "{frames:?}");
    let newest = late.newest();
    assert_eq!(
        (&newest["state"]["mode"], &newest["watchers"]),
        (&json!("crawling"), &json!(2))
    );
    assert!(
        newest["age_ms"]["state"].as_u64().is_some_and(|age| age < 1000),
        "{newest}"
    );

    // A controller that is gone is old, and the relay is there.
    let Crawling { controller, worm, .. } = crawling;
    controller.end();
    wait_for("an old state", PATIENCE, || {
        assert!(late.read());
        late.newest()["age_ms"]["state"].as_u64().is_some_and(|age| age > 1000)
    });
    drop((first, late));
    let (status, log) = relay.log_at_its_end();
    assert!(status.success(), "{log}");
    assert!(!worm.folder().join("relay.sock").exists());
}

#[test]
fn fifty_watchers_are_served_though_one_of_them_never_reads() {
    let (relay, crawling) = crawling_with_relay("w-many");
    let mut stalled = Client::connect(&crawling.worm);
    let mut watchers: Vec<_> = (0..49).map(|_| Client::connect(&crawling.worm)).collect();
    let mut read_for = |seconds: f64| {
        let begun = Instant::now();
        while begun.elapsed().as_secs_f64() < seconds {
            assert!(watchers.iter_mut().all(Client::read), "nobody is cut off");
            std::thread::sleep(Duration::from_millis(10));
        }
        watchers
            .iter()
            .map(|watcher| watcher.of("frame").count())
            .min()
            .unwrap_or(0)
    };
    let warm = read_for(1.0);
    let before_mb = resident_mb(&relay);
    let frames = read_for(7.0);
    let after_mb = resident_mb(&relay);
    println!("{warm}, then {frames} frames at least; resident memory {before_mb:.1}, then {after_mb:.1} MB");
    assert!(
        after_mb < before_mb + 8.0 && after_mb < 40.0,
        "bounded: {before_mb:.1} to {after_mb:.1} MB"
    );
    assert!(frames > 40, "{frames} frames in eight seconds");
    for watcher in &watchers {
        assert_eq!(watcher.of("lost").count(), 0);
        let numbers: Vec<u64> = watcher
            .of("frame")
            .filter_map(|frame| frame["number"].as_u64())
            .collect();
        assert!(numbers.windows(2).all(|pair| pair[1] == pair[0] + 1), "{numbers:?}");
        assert_eq!(watcher.newest()["watchers"], 50);
    }
    // It learns how many it lost, and gets all cycles nevertheless.
    wait_for("the count of lost frames", PATIENCE, || {
        stalled.read();
        stalled.of("lost").count() > 0
    });
    let lost = stalled.of("lost").next().expect("is there")["frames"]
        .as_u64()
        .expect("a number");
    stalled.wait_for_frames(stalled.of("frame").count() + 1);
    let numbers: Vec<u64> = stalled
        .of("frame")
        .filter_map(|frame| frame["number"].as_u64())
        .collect();
    let gap: u64 = numbers.windows(2).map(|pair| pair[1] - pair[0] - 1).sum();
    println!("the stalled watcher lost {lost} frames");
    assert_eq!(gap, lost, "{numbers:?}");
    let cycles = |client: &Client| -> Vec<u64> {
        let lists = client
            .of("hello")
            .chain(client.of("frame"))
            .filter_map(|it| it["cycles"].as_array());
        lists.flatten().filter_map(|cycle| cycle["index"].as_u64()).collect()
    };
    let all = cycles(&watchers[0]);
    assert!(
        !all.is_empty() && cycles(&stalled).starts_with(&all),
        "{all:?}, {:?}",
        cycles(&stalled)
    );
}

/// `wormd watch` in a terminal of its own, which somebody reads and types into.
pub struct Terminal {
    process: Process,
    keyboard: File,
    screen: Arc<Mutex<vt100::Parser>>,
}

impl Terminal {
    pub fn watch(worm: &Worm) -> Self {
        let pty = stalled_terminal();
        let process = worm.wormd(&["watch"]).start_in(pty.slave);
        let keyboard = File::from(pty.master.try_clone().expect("a descriptor is free"));
        let screen = Arc::new(Mutex::new(vt100::Parser::new(ROWS, COLUMNS, 0)));
        let (mut master, painted) = (File::from(pty.master), Arc::clone(&screen));
        std::thread::spawn(move || {
            let mut bytes = [0; 65_536];
            // It ends with an error when the last process has left the terminal.
            while let Ok(count) = master.read(&mut bytes) {
                painted.lock().expect("no thread has panicked").process(&bytes[..count]);
            }
        });
        let terminal = Self {
            process,
            keyboard,
            screen,
        };
        terminal.wait_for("gait cycles");
        terminal
    }

    pub fn press(&mut self, keys: &str) {
        self.keyboard
            .write_all(keys.as_bytes())
            .expect("the terminal takes keys");
    }

    /// What is shown.
    fn picture(&self) -> String {
        self.screen.lock().expect("no thread has panicked").screen().contents()
    }

    /// Waits until a text is shown.
    pub fn wait_for(&self, text: &str) {
        let begun = Instant::now();
        while !self.picture().contains(text) {
            let picture = self.picture();
            assert!(
                begun.elapsed() < PATIENCE,
                "waited in vain for {text:?}; shown is:\n{picture}"
            );
            std::thread::sleep(Duration::from_millis(10));
        }
    }
}

/// Crawls by the keys of a terminal. A computer that is too busy may stop the worm: then once more.
fn crawl_by_keys(terminal: &mut Terminal, crawling: &Crawling) {
    wait_for("it crawls by keys", PATIENCE, || {
        terminal.press("cc");
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_millis(500) {
            if crawling
                .worm
                .state()
                .is_some_and(|state| state.mode == Mode::Crawling.code())
            {
                return true;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        false
    });
}

#[test]
fn one_drives_anyone_may_halt_and_a_driver_that_goes_leaves_a_worm_that_holds() {
    let crawling = Crawling::start_again(Worm::on_a_steady_computer("w-drive"));
    crawling.worm.order(CommandKind::Hold);
    crawling.wait_for_mode(Mode::Holding);
    // The first watcher starts the relay.
    let mut terminal = Terminal::watch(&crawling.worm);
    crawl_by_keys(&mut terminal, &crawling);
    let mut other = Client::connect(&crawling.worm);
    other.send(&json!({"command": "hello", "version": 1, "name": "the other"}));
    for command in ["crawl", "stop", "reset", "arm", "drive"] {
        let answer = other.ask(command);
        assert_eq!(answer["verdict"], "not-driver", "{answer}");
        assert!(
            answer["refusal"]
                .as_str()
                .is_some_and(|why| why.contains("drives since")),
            "{answer}"
        );
    }
    assert_eq!(other.ask("hold")["verdict"], "accepted");
    crawling.wait_for_mode(Mode::Holding);

    // The driver is killed.
    crawl_by_keys(&mut terminal, &crawling);
    std::thread::sleep(Duration::from_millis(1500));
    crawling.wait_for_mode(Mode::Crawling);
    let killed = Instant::now();
    terminal.process.kill();
    crawling.wait_for_mode(Mode::Holding);
    println!(
        "after kill -9 of the driver the worm held within {:?}",
        killed.elapsed()
    );

    // A driver that is there and says nothing. The test's client says nothing by itself.
    assert_eq!(other.ask("take_over")["verdict"], "accepted");
    assert_eq!(other.ask("crawl")["verdict"], "accepted");
    let silent = Instant::now();
    crawling.wait_for_mode(Mode::Holding);
    println!(
        "after the driver's last word the worm held within {:?}",
        silent.elapsed()
    );
    wait_for("nobody drives", PATIENCE, || {
        assert!(other.read());
        other.newest()["driver"].is_null()
    });
    let events: Vec<_> = other
        .of("frame")
        .filter_map(|frame| frame["events"].as_array())
        .flatten()
        .collect();
    for part in [
        "the other (user",
        "hold accepted",
        "who drove, has left",
        "took over",
        "nothing was heard",
    ] {
        let is_there = events
            .iter()
            .any(|event| event["text"].as_str().is_some_and(|text| text.contains(part)));
        assert!(is_there, "{part:?} is not in {events:?}");
    }

    // The topic that every recording has says what the relay alone decided.
    let recorded: Vec<_> = other
        .of("frame")
        .filter_map(|frame| frame["commands"].as_array())
        .flatten()
        .collect();
    for (kind, sender) in [
        ("take-over", "the other"),
        ("not-driver", "the other: crawl"),
        ("not-driver", "the other: stop"),
    ] {
        let is_there = recorded
            .iter()
            .any(|record| record["kind"] == kind && record["sender"] == sender);
        assert!(is_there, "{kind} of {sender} is not in {recorded:?}");
    }

    // Nonsense, and a newer version, are answered in words.
    other.send(&json!({"command": "dance", "id": 1}));
    other.send(&json!({"command": "hello", "version": 99, "name": "later"}));
    wait_for("it is closed", PATIENCE, || !other.read());
    assert_eq!(
        other
            .of("answer")
            .filter(|answer| answer["verdict"] == "unusable")
            .count(),
        1
    );
    let refusal = other.of("refused").next().expect("is said");
    assert!(
        refusal["reason"].as_str().is_some_and(|why| why.contains("version 99")),
        "{refusal}"
    );
}

#[test]
fn a_relay_that_is_killed_leaves_the_worm_as_leased_and_comes_back_without_moving_it() {
    let crawling = Crawling::start_again(Worm::on_a_steady_computer("w-relay"));
    crawling.worm.order(CommandKind::Hold);
    crawling.wait_for_mode(Mode::Holding);
    let mut terminal = Terminal::watch(&crawling.worm);
    crawl_by_keys(&mut terminal, &crawling);
    let lock = crawling.worm.folder().join("relay.lock");
    let relay = || {
        std::fs::read_to_string(&lock)
            .ok()
            .and_then(|text| text.trim().parse::<i32>().ok())
    };
    let first = relay().expect("there is a relay");
    kill(Pid::from_raw(first), Signal::SIGKILL).expect("is alive");
    let killed = Instant::now();
    terminal.wait_for("the connection to the relay was lost");
    crawling.wait_for_mode(Mode::Holding);
    println!("after kill -9 of the relay the worm held within {:?}", killed.elapsed());
    wait_for("another relay", PATIENCE, || relay().is_some_and(|pid| pid != first));
    let mut other = Client::connect(&crawling.worm);
    other.wait_for_frames(30);
    assert_eq!(
        other.newest()["state"]["mode"],
        "holding",
        "nothing that reconnects moves the worm"
    );
    assert!(other.newest()["driver"].is_null());

    // A worm that nobody attended to by the relay goes on.
    make_crawl_again(&crawling.worm);
    kill(Pid::from_raw(relay().expect("is there")), Signal::SIGKILL).expect("is alive");
    std::thread::sleep(Duration::from_millis(1500));
    crawling.wait_for_mode(Mode::Crawling);

    terminal.press("q");
    assert_eq!(terminal.process.ends_by_itself().code(), Some(0));
    crawling.wait_for_mode(Mode::Crawling);
    let Crawling {
        controller,
        estimator,
        virtual_worm,
        worm,
    } = crawling;
    controller.end();
    estimator.end();
    virtual_worm.end();
    worm.forget_topics();
    worm.wait_until_nothing_is_left();
}

#[test]
fn without_a_worm_there_is_nothing_to_watch() {
    let worm = Worm::on_a_steady_computer("w-none");
    let pty = stalled_terminal();
    let watch = worm.wormd(&["watch"]).start_in(pty.slave);
    assert_eq!(watch.ends_by_itself().code(), Some(2));
    let mut said = [0; 4096];
    let count = File::from(pty.master).read(&mut said).expect("it has said why");
    let said = String::from_utf8_lossy(&said[..count]).into_owned();
    assert!(said.contains("is running: start it with `wormd up --name"), "{said}");
    let output = worm.wormd(&["watch"]).output();
    assert_eq!(output.status.code(), Some(2), "without a terminal");
    assert_eq!(worm.stale_resources(), Vec::<String>::new());
}
