//! Whether watchers make the loop late: runs of `wormd up --json` without watchers and with many in turns, one of which never reads.
//!
//! ```sh
//! cargo bench --bench watchers -- --pairs 6 --watchers 50 --duration 20
//! ```
//!
//! With `--pages 3` the watchers are a dashboard with that many pages (streams of events that are read; no browser, whose own work would be
//! measured). It also prints the processor time that the dashboard takes.
//!
//! It prints the loop's wake lateness of each run, and of both kinds the median over the runs with their ratio. The watchers come
//! while the worm crawls, through the relay; they read what they get and do nothing with it.

use clap::Parser;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use serde_json::Value;
use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
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
    /// Pages of a dashboard, in the place of the watchers
    #[arg(long, default_value_t = 0)]
    pages: usize,
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

/// A dashboard with pages that are read.
struct Pages {
    dashboard: Child,
    end: Arc<AtomicBool>,
    readers: Vec<JoinHandle<u64>>,
    since: Instant,
}

impl Pages {
    fn start(name: &str, count: usize) -> Self {
        let mut dashboard = wormd(name, &["dashboard", "--listen", "127.0.0.1:0"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("the dashboard starts");
        let mut line = String::new();
        BufReader::new(dashboard.stdout.take().expect("is piped"))
            .read_line(&mut line)
            .expect("it says where it is");
        let (_, url) = line.split_once("http://").expect("an address");
        let address = url.trim().trim_end_matches('/').to_owned();
        let end = Arc::new(AtomicBool::new(false));
        let reader = |_| {
            let (address, end) = (address.clone(), Arc::clone(&end));
            std::thread::spawn(move || {
                let mut stream = TcpStream::connect(&address).expect("it listens");
                let ask = format!("GET /api/events HTTP/1.1\r\nHost: {address}\r\n\r\n");
                stream.write_all(ask.as_bytes()).expect("it reads");
                let mut bytes = vec![0; 1 << 16];
                let mut events = 0;
                while !end.load(Ordering::Relaxed) {
                    let count = stream.read(&mut bytes).expect("it sends");
                    events += bytes[..count].windows(6).filter(|window| *window == b"event:").count() as u64;
                }
                events
            })
        };
        Self {
            readers: (0..count).map(reader).collect(),
            dashboard,
            end,
            since: Instant::now(),
        }
    }

    /// How many events they read.
    fn end(mut self) -> u64 {
        let (cpu_s, memory_mb) = usage(self.dashboard.id());
        let share = 100.0 * cpu_s / self.since.elapsed().as_secs_f64();
        println!("     the dashboard took {share:.2} % of a core and {memory_mb:.1} MB");
        self.end.store(true, Ordering::Relaxed);
        let events = self
            .readers
            .drain(..)
            .map(|reader| reader.join().expect("no reader panics"))
            .sum();
        self.dashboard.kill().expect("is alive");
        self.dashboard.wait().expect("has ended");
        events
    }
}

/// Processor time, s, and resident memory, MB, of a process.
fn usage(pid: u32) -> (f64, f64) {
    /// Ticks of the kernel's accounts in a second, on all its common ports.
    const TICKS_PER_S: f64 = 100.0;
    let of = |file: &str| std::fs::read_to_string(format!("/proc/{pid}/{file}")).expect("is alive");
    let stat = of("stat");
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let number = |index: usize| fields[index].parse::<f64>().expect("a number");
    let status = of("status");
    let memory = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let memory_kb: f64 = memory
        .and_then(|text| text.split_whitespace().next())
        .and_then(|text| text.parse().ok())
        .unwrap_or(f64::NAN);
    ((number(11) + number(12)) / TICKS_PER_S, memory_kb / 1024.0)
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
    let pages = if watchers > 0 { arguments.pages } else { 0 };
    let dashboard = (pages > 0).then(|| Pages::start(name, pages));
    let there = (watchers > 0 && pages == 0).then(|| Watchers::start(name, watchers));
    let output = up.wait_with_output().expect("the worm ends");
    let lines = there.map_or(0, Watchers::end) + dashboard.map_or(0, Pages::end);
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
    let mut arguments = Arguments::parse();
    if arguments.pages > 0 {
        arguments.watchers = arguments.pages;
    }
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
