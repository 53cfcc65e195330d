//! Whether watchers make the loop late: runs of `wormd up --json` without watchers and with many in turns, one of which never reads.
//!
//! ```sh
//! cargo bench --bench watchers -- --pairs 6 --watchers 50 --duration 20
//! ```
//!
//! It prints the loop's wake lateness of each run, and of both kinds the median over the runs with their ratio. The watchers come
//! while the worm crawls, through the relay; they read what they get and do nothing with it.

use clap::Parser;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use serde_json::Value;
use std::io::{ErrorKind, Read};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;
use worm_estimator::config::Config;
use wormd::topics::Instance;

#[derive(Parser)]
struct Arguments {
    /// Runs of each kind
    #[arg(long, default_value_t = 3)]
    pairs: u32,
    /// Watchers in the second run of each pair
    #[arg(long, default_value_t = 50)]
    watchers: usize,
    /// Seconds of crawling in each run
    #[arg(long, default_value_t = 20)]
    duration: u32,
    /// Given by cargo
    #[arg(long, hide = true)]
    bench: bool,
}

/// Wake lateness of one run, µs.
#[derive(Debug, Clone, Copy)]
struct Wake {
    p50: f64,
    p99: f64,
}

/// Watchers in one thread, until they are to say what they got.
struct Watchers {
    relay: Child,
    end: Arc<AtomicBool>,
    reader: JoinHandle<u64>,
}

fn wormd(name: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_wormd"));
    command.args(arguments).args(["--name", name]).stdin(Stdio::null());
    command
}

impl Watchers {
    fn start(name: &str, count: usize) -> Self {
        let mut config = Config::default();
        name.clone_into(&mut config.worm.name);
        let socket = Instance::of(&config)
            .expect("the folder of the topics")
            .folder()
            .join("relay.sock");
        let relay = wormd(name, &["relay"])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the relay starts");
        let end = Arc::new(AtomicBool::new(false));
        let until = Arc::clone(&end);
        let reader = std::thread::spawn(move || {
            let connect = || loop {
                match UnixStream::connect(&socket) {
                    Ok(stream) => return stream,
                    Err(_) => std::thread::sleep(Duration::from_millis(10)),
                }
            };
            let _stalled = connect();
            let streams: Vec<_> = (1..count).map(|_| connect()).collect();
            read_all(&streams, &until)
        });
        Self { relay, end, reader }
    }

    /// How many lines they read.
    fn end(mut self) -> u64 {
        self.end.store(true, Ordering::Relaxed);
        let lines = self.reader.join().expect("the reader does not panic");
        self.relay.wait().expect("the relay ends without watchers");
        lines
    }
}

fn read_all(streams: &[UnixStream], end: &AtomicBool) -> u64 {
    let mut bytes = vec![0; 1 << 20];
    let mut lines = 0;
    for stream in streams {
        stream.set_nonblocking(true).expect("can be set");
    }
    while !end.load(Ordering::Relaxed) {
        let mut readable: Vec<_> = streams
            .iter()
            .map(|it| PollFd::new(it.as_fd(), PollFlags::POLLIN))
            .collect();
        poll(&mut readable, PollTimeout::from(100u8)).expect("can be polled");
        for mut stream in streams {
            match stream.read(&mut bytes) {
                Ok(0) => return lines,
                Ok(count) => lines += bytes[..count].iter().filter(|byte| **byte == b'\n').count() as u64,
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                Err(error) => panic!("a watcher: {error}"),
            }
        }
    }
    lines
}

fn run(name: &str, arguments: &Arguments, watchers: usize) -> Wake {
    let duration = arguments.duration.to_string();
    let up = wormd(name, &["up", "--json", "--duration", &duration])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the worm starts");
    // The worm's processes are there, and its start is not what is measured.
    std::thread::sleep(Duration::from_secs(2));
    let there = (watchers > 0).then(|| Watchers::start(name, watchers));
    let output = up.wait_with_output().expect("the worm ends");
    let lines = there.map_or(0, Watchers::end);
    let summary: Value = serde_json::from_slice(&output.stdout).expect("a summary");
    let wake = &summary["timing"]["wake_us"];
    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    let wake = Wake {
        p50: number(&wake["p50"]),
        p99: number(&wake["p99"]),
    };
    println!(
        "{watchers:>3} watchers: wake lateness p50 {:7.1} µs, p99 {:7.1} µs; {} overruns; they read {lines} lines",
        wake.p50, wake.p99, summary["overruns"]
    );
    wake
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() % 2 {
        _ if values.is_empty() => f64::NAN,
        0 => f64::midpoint(values[middle - 1], values[middle]),
        _ => values[middle],
    }
}

fn main() {
    let arguments = Arguments::parse();
    let name = format!("watchers-{}", std::process::id());
    let (mut without, mut with) = (Vec::new(), Vec::new());
    for _ in 0..arguments.pairs {
        without.push(run(&name, &arguments, 0));
        with.push(run(&name, &arguments, arguments.watchers));
    }
    for (what, of) in [
        ("p50", (|wake: &Wake| wake.p50) as fn(&Wake) -> f64),
        ("p99", |wake| wake.p99),
    ] {
        let (before, after) = (
            median(without.iter().map(of).collect()),
            median(with.iter().map(of).collect()),
        );
        println!(
            "{what}: median {before:.1} µs without, {after:.1} µs with {} watchers: ratio {:.2}",
            arguments.watchers,
            after / before
        );
    }
}
