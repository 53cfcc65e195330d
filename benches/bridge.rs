//! What a bridge costs for each worm: virtual worms on this computer, one bridge for all of them, and one laptop process that is connected
//! over loopback and has a watcher at each.
//!
//! ```sh
//! cargo bench --features bridge --bench bridge -- --worms 20 --duration 20
//! ```
//!
//! It prints processor time and memory of the bridge, of the laptop's process and of the relays together. The worms' own loops run at
//! `--rate` a second, so that so many fit on a small computer: what is measured gets 20 frames a second of each worm at any rate.

use clap::Parser;
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

#[derive(Parser)]
struct Arguments {
    /// Virtual worms
    #[arg(long, default_value_t = 20)]
    worms: usize,
    /// Seconds of measuring
    #[arg(long, default_value_t = 20)]
    duration: u64,
    /// Ticks of each worm in a second
    #[arg(long, default_value_t = 50)]
    rate: u32,
    /// Given by cargo
    #[arg(long, hide = true)]
    bench: bool,
}

/// A process that is ended with the bench.
struct Process(Child);

impl Process {
    /// Starts it, and waits until it says that it is ready.
    fn start(arguments: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_wormd"))
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("wormd starts");
        let mut line = String::new();
        let stdout = child.stdout.take().expect("is piped");
        BufReader::new(stdout).read_line(&mut line).expect("can be read");
        assert!(!line.is_empty(), "{arguments:?} ended at once");
        Self(child)
    }

    fn id(&self) -> u32 {
        self.0.id()
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // SAFETY: the process is a child that was not waited for yet.
        unsafe { libc::kill(self.0.id() as i32, libc::SIGTERM) };
        let _ = self.0.wait();
    }
}

/// Processor time so far, s, and resident memory, MB.
fn usage(pid: u32) -> (f64, f64) {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).expect("it runs");
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let ticks = |index: usize| fields[index].parse::<f64>().expect("a number");
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).expect("it runs");
    let resident = status
        .lines()
        .find_map(|line| line.strip_prefix("VmRSS:"))
        .expect("has memory");
    let kb: f64 = resident.trim().trim_end_matches(" kB").parse().expect("a number");
    // Ticks of proc(5) are 10 ms on Linux.
    ((ticks(11) + ticks(12)) / 100.0, kb / 1024.0)
}

/// The relays of these worms.
fn relays(prefix: &str) -> Vec<u32> {
    let processes = std::fs::read_dir("/proc").expect("/proc").flatten();
    let ids = processes.filter_map(|process| process.file_name().to_str()?.parse::<u32>().ok());
    ids.filter(|id| {
        let line = std::fs::read(format!("/proc/{id}/cmdline")).unwrap_or_default();
        let line = String::from_utf8_lossy(&line).replace('\0', " ");
        line.contains(" relay ") && line.contains(prefix)
    })
    .collect()
}

fn make_keys(folder: &Path, arguments: &str) {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/bridge/make-keys");
    let status = Command::new(script)
        .args(arguments.split(' '))
        .current_dir(folder)
        .status();
    assert!(status.expect("the script runs").success());
}

fn main() {
    let arguments = Arguments::parse();
    let folder = tempfile::tempdir_in("/dev/shm").expect("a folder in /dev/shm");
    let at = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    for line in ["keys authority", "keys robot robot1 127.0.0.1", "keys laptop anna"] {
        make_keys(folder.path(), line);
    }
    let free = std::net::TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let address = free.local_addr().expect("is bound");
    drop(free);
    let prefix = format!("bb{}-", std::process::id() % 10_000);
    let names: Vec<String> = (0..arguments.worms).map(|index| format!("{prefix}{index}")).collect();
    let mut bridge = format!(
        "certificate = 'keys/robot1.pem'\nkey = 'keys/robot1.key'\nauthority = 'keys/ca.pem'\nlisten = ['tls/{address}']\n\
         [access]\ndrive = ['anna']\n"
    );
    let mut processes = Vec::new();
    for name in &names {
        let config = at(&format!("{name}.toml"));
        let text = format!("[worm]\nname = '{name}'\n[control]\nrate_hz = {}\n", arguments.rate);
        std::fs::write(&config, text).expect("can be written");
        bridge += &format!("[[worms]]\nconfig = '{config}'\n");
        let port = at(&format!("{name}-port"));
        processes.push(Process::start(&["virtual-worm", "--config", &config, "--link", &port]));
        processes.push(Process::start(&["estimate", "--config", &config]));
        processes.push(Process::start(&["control", "--config", &config, "--port", &port]));
    }
    std::fs::write(at("bridge.toml"), bridge).expect("can be written");
    let fleet = format!(
        "certificate = 'keys/anna.pem'\nkey = 'keys/anna.key'\nauthority = 'keys/ca.pem'\nroot = '{}'\n[[robots]]\nname = 'robot1'\n\
         connect = 'tls/{address}'\n",
        at("laptop")
    );
    std::fs::write(at("fleet.toml"), fleet).expect("can be written");
    let bridge = Process::start(&["bridge", "--config", &at("bridge.toml")]);
    let (_, alone_mb) = usage(bridge.id());
    let fleet = Process::start(&["fleet", "--config", &at("fleet.toml")]);
    let watched = Instant::now();
    let watchers: Vec<UnixStream> = names
        .iter()
        .map(|name| watch(&folder.path().join("laptop").join(name)))
        .collect();
    let readers: Vec<_> = watchers
        .into_iter()
        .map(|stream| std::thread::spawn(move || count(stream)))
        .collect();
    // The histories have passed by then.
    std::thread::sleep(Duration::from_secs(5));

    let relays = relays(&prefix);
    let before: Vec<_> = [bridge.id(), fleet.id()]
        .iter()
        .chain(&relays)
        .map(|&pid| usage(pid))
        .collect();
    let begun = Instant::now();
    std::thread::sleep(Duration::from_secs(arguments.duration));
    let time_s = begun.elapsed().as_secs_f64();
    let after: Vec<_> = [bridge.id(), fleet.id()]
        .iter()
        .chain(&relays)
        .map(|&pid| usage(pid))
        .collect();
    let share = |range: std::ops::Range<usize>| -> f64 {
        let used: f64 = range.map(|index| after[index].0 - before[index].0).sum();
        100.0 * used / time_s
    };
    let worms = arguments.worms as f64;
    for (what, range) in [("bridge", 0..1), ("laptop", 1..2), ("relays", 2..after.len())] {
        let all = share(range.clone());
        let mb: f64 = range.map(|index| after[index].1).sum();
        println!(
            "{what}: {all:.2} % of a core, {:.3} % for each worm; {mb:.1} MB",
            all / worms
        );
    }
    println!("the bridge before anybody came: {alone_mb:.1} MB");
    drop(fleet);
    let (frames, lost) = readers
        .into_iter()
        .map(|reader| reader.join().expect("the reader does not panic"))
        .fold((0, 0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
    println!(
        "frames: {:.1} a second for each worm since the start, {lost} lost",
        frames as f64 / watched.elapsed().as_secs_f64() / worms
    );
}

/// Waits until the worm is offered, and watches it.
fn watch(worm: &Path) -> UnixStream {
    let socket: PathBuf = worm.join("relay.sock");
    let begun = Instant::now();
    loop {
        match UnixStream::connect(&socket) {
            Ok(mut stream) => {
                stream
                    .write_all(b"{\"command\":\"hello\",\"version\":1,\"name\":\"bench\"}\n")
                    .expect("it reads");
                return stream;
            }
            Err(error) => assert!(
                begun.elapsed() < Duration::from_secs(60),
                "{}: {error}",
                socket.display()
            ),
        }
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// Frames that came and that were lost, until the end.
fn count(mut stream: UnixStream) -> (u64, u64) {
    let mut text = String::new();
    // It ends when the laptop's process does.
    let _ = stream.read_to_string(&mut text);
    let lost = text.lines().filter_map(|line| {
        line.strip_prefix("{\"lost\":{\"frames\":")?
            .trim_end_matches('}')
            .parse::<u64>()
            .ok()
    });
    let lost = lost.sum();
    (
        text.lines().filter(|line| line.starts_with("{\"frame\":")).count() as u64,
        lost,
    )
}
