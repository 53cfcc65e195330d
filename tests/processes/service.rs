//! What a service manager hears of the processes, at a real notification socket, with `WATCHDOG_USEC` as systemd sets it.

use super::process::{Invocation, Process, wait_for};
use super::worm::Worm;
use super::{PATIENCE, any_order::make_crawl_again};
use std::os::unix::net::UnixDatagram;
use std::process::Command;
use std::time::{Duration, Instant};

/// The watchdog's time. It is fed four times in it.
const WATCHDOG: Duration = Duration::from_secs(2);

/// A notification socket, and what has come in.
struct Manager {
    socket: UnixDatagram,
    path: String,
    heard: Vec<String>,
    _folder: tempfile::TempDir,
}

impl Manager {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("notify");
        let socket = UnixDatagram::bind(&path).expect("a socket");
        socket.set_nonblocking(true).expect("it can be polled");
        Self {
            socket,
            path: path.to_string_lossy().into_owned(),
            heard: Vec::new(),
            _folder: folder,
        }
    }

    /// Starts a process as systemd would.
    fn start(&self, invocation: Invocation) -> Process {
        invocation
            .with_environment("NOTIFY_SOCKET", &self.path)
            .with_environment("WATCHDOG_USEC", &WATCHDOG.as_micros().to_string())
            .start()
    }

    fn listen(&mut self) {
        let mut message = [0; 4096];
        while let Ok(length) = self.socket.recv(&mut message) {
            let text = String::from_utf8_lossy(&message[..length]);
            self.heard.extend(text.lines().map(str::to_owned));
        }
    }

    fn wait_for(&mut self, message: &str) {
        wait_for(message, PATIENCE, || {
            self.listen();
            self.heard.iter().any(|heard| heard == message)
        });
    }

    /// How often the watchdog is fed in `time`.
    fn feeds_in(&mut self, time: Duration) -> usize {
        self.listen();
        let before = self.feeds();
        let begun = Instant::now();
        while begun.elapsed() < time {
            std::thread::sleep(Duration::from_millis(20));
            self.listen();
        }
        self.feeds() - before
    }

    fn feeds(&self) -> usize {
        self.heard.iter().filter(|heard| *heard == "WATCHDOG=1").count()
    }
}

/// One thread of a process, stopped by the kernel while all others run.
struct StoppedThread(libc::pid_t);

impl StoppedThread {
    /// Stops the process's first thread; none where the system does not allow it.
    fn first_of(process: &Process) -> Option<Self> {
        let thread = libc::pid_t::try_from(process.id()).expect("a process number");
        // SAFETY: these requests take no memory of ours.
        let is_stopped = unsafe {
            libc::ptrace(libc::PTRACE_SEIZE, thread, 0, 0) == 0
                && libc::ptrace(libc::PTRACE_INTERRUPT, thread, 0, 0) == 0
                && libc::waitpid(thread, std::ptr::null_mut(), libc::__WALL) == thread
        };
        is_stopped.then_some(Self(thread))
    }
}

impl Drop for StoppedThread {
    fn drop(&mut self) {
        // SAFETY: the request takes no memory of ours. A process that has gone needs no release.
        unsafe { libc::ptrace(libc::PTRACE_DETACH, self.0, 0, 0) };
    }
}

/// What `wormd status` says about a worm, if it runs, and whether it found none with torque.
fn status_of(worm: &Worm) -> (Option<serde_json::Value>, bool) {
    let output = Command::new(env!("CARGO_BIN_EXE_wormd"))
        .args(["status", "--json", "--fail-if-armed"])
        .output()
        .expect("the binary starts");
    let worms: Vec<serde_json::Value> = serde_json::from_slice(&output.stdout).expect("an array");
    let of_worm = worms.into_iter().find(|found| found["worm"] == worm.name());
    (of_worm, output.status.success())
}

#[test]
fn a_controller_is_ready_when_it_ticks_and_is_fed_only_while_it_does() {
    let worm = Worm::on_a_steady_computer("service");
    let virtual_worm = worm.virtual_worm(&[]);
    let mut manager = Manager::new();
    let port = worm.port();
    let controller = manager.start(worm.wormd(&["control", "--port", &port]));
    let estimator = worm.wormd(&["estimate"]).start();
    manager.wait_for("READY=1");
    manager.wait_for("STATUS=disarmed");
    make_crawl_again(&worm);
    manager.wait_for("STATUS=crawling");
    manager.wait_for("WATCHDOG=1");

    let (status, may_be_removed) = status_of(&worm);
    let status = status.expect("it runs");
    assert_eq!(
        (&status["mode"], &status["pid"], &status["program_replaced"]),
        (&"crawling".into(), &controller.id().into(), &false.into())
    );
    assert!(!may_be_removed, "a worm that crawls has torque");

    match StoppedThread::first_of(&controller) {
        Some(stopped) => {
            // What was counted before it stopped may still be fed.
            manager.feeds_in(WATCHDOG);
            assert_eq!(manager.feeds_in(2 * WATCHDOG), 0, "the loop stands still");
            drop(stopped);
            assert!(manager.feeds_in(2 * WATCHDOG) > 0, "the loop goes on");
            make_crawl_again(&worm);
        }
        None => println!("SKIPPED: this system lets no thread be stopped alone (ptrace)"),
    }
    controller.end();
    manager.wait_for("STOPPING=1");
    let last = manager.heard.iter().rfind(|heard| heard.starts_with("STATUS="));
    assert_eq!(last.map(String::as_str), Some("STATUS=disarmed"));
    assert!(status_of(&worm).0.is_none(), "it has ended");
    for process in [estimator, virtual_worm] {
        process.end();
    }
}

#[test]
fn estimator_and_recorder_are_ready_and_fed_too() {
    let worm = Worm::on_a_steady_computer("services");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let log = folder.path().join("log.mcap").to_string_lossy().into_owned();
    for arguments in [&["estimate"][..], &["record", "--out", &log]] {
        let mut manager = Manager::new();
        let process = manager.start(worm.wormd(arguments));
        manager.wait_for("READY=1");
        manager.wait_for("WATCHDOG=1");
        process.end();
        manager.wait_for("STOPPING=1");
    }
}
