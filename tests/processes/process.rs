//! Processes of `wormd` that a test starts, asks and ends, and that pause when the computer does.

use nix::sys::resource::{Resource, setrlimit};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::io::{BufRead, BufReader, Read};
use std::os::fd::OwnedFd;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::sync::Arc;
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};
use testkit::process_pauses::HostPauses;

/// A call of `wormd` that is not made yet.
pub struct Invocation {
    command: Command,
    what: String,
    pauses: Option<Arc<HostPauses>>,
}

impl Invocation {
    /// Of some arguments; what it starts pauses with the rest.
    pub fn new(arguments: &[&str], pauses: Option<Arc<HostPauses>>) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_wormd"));
        // What it remembers is not for the user who tests.
        let state = concat!(env!("CARGO_TARGET_TMPDIR"), "/state");
        command
            .args(arguments)
            .stdin(Stdio::null())
            .env("XDG_STATE_HOME", state);
        Self {
            command,
            what: arguments.join(" "),
            pauses,
        }
    }

    /// Allows it files of at most this size: as on a full disk, but for it alone.
    pub fn with_file_size_limit(mut self, bytes: u64) -> Self {
        // SAFETY: setrlimit is async-signal-safe, and nothing is allocated between fork and exec.
        unsafe {
            self.command
                .pre_exec(move || setrlimit(Resource::RLIMIT_FSIZE, bytes, bytes).map_err(std::io::Error::from));
        }
        self
    }

    /// Gives it a variable of the environment.
    pub fn with_environment(mut self, name: &str, value: &str) -> Self {
        self.command.env(name, value);
        self
    }

    /// Runs it in a network of its own.
    #[allow(
        dead_code,
        reason = "the tests of dashboard and bridge, which share this harness, need it"
    )]
    pub fn in_network(mut self, namespace: &std::fs::File) -> Self {
        let namespace = namespace.try_clone().expect("a descriptor is free");
        // SAFETY: setns is async-signal-safe, and nothing is allocated between fork and exec.
        unsafe {
            self.command.pre_exec(move || {
                nix::sched::setns(&namespace, nix::sched::CloneFlags::CLONE_NEWNET).map_err(std::io::Error::from)
            });
        }
        self
    }

    /// Runs it to its end, which must come within three minutes: it hangs otherwise, however busy the computer is.
    pub fn output(mut self) -> Output {
        self.command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut process = self.spawn();
        let child = &mut process.child;
        let pid = Pid::from_raw(child.id() as i32);
        let (ended, watch) = std::sync::mpsc::channel::<()>();
        let guard = std::thread::spawn(move || {
            let hangs = watch.recv_timeout(Duration::from_secs(180)) == Err(RecvTimeoutError::Timeout);
            if hangs {
                // The process group is the test's own child alone.
                let _ = kill(pid, Signal::SIGTERM);
            }
            hangs
        });
        let mut stdout = child.stdout.take().expect("is piped");
        let reader = std::thread::spawn(move || {
            let mut bytes = Vec::new();
            stdout.read_to_end(&mut bytes).expect("can be read");
            bytes
        });
        let mut stderr = Vec::new();
        child
            .stderr
            .take()
            .expect("is piped")
            .read_to_end(&mut stderr)
            .expect("can be read");
        let status = process.wait();
        drop(ended);
        let hung = guard.join().expect("the guard does not panic");
        assert!(
            !hung,
            "`{}` did not end within three minutes:\n{}",
            self.what,
            String::from_utf8_lossy(&stderr)
        );
        Output {
            status,
            stdout: reader.join().expect("the reader does not panic"),
            stderr,
        }
    }

    /// As [`start`](Self::start), and keeps its log for [`Process::log_at_its_end`].
    pub fn start_with_log(mut self) -> Process {
        self.command.stderr(Stdio::piped());
        self.start()
    }

    /// Starts it and waits until it says on standard output that it is ready.
    pub fn start(mut self) -> Process {
        self.command.stdout(Stdio::piped());
        let mut process = self.spawn();
        let stdout = process.child.stdout.take().expect("is piped");
        let mut line = String::new();
        BufReader::new(stdout).read_line(&mut line).expect("can be read");
        assert!(
            !line.is_empty(),
            "`{}` ended before it was ready: {:?}",
            self.what,
            process.wait()
        );
        process
    }

    fn spawn(&mut self) -> Process {
        let child = self.command.spawn().expect("the binary starts");
        if let Some(pauses) = &self.pauses {
            pauses.processes().push(Pid::from_raw(child.id() as i32));
        }
        Process {
            child,
            pauses: self.pauses.clone(),
        }
    }

    /// The call itself, for what is not done here.
    pub fn into_command(self) -> Command {
        self.command
    }

    /// Starts it, and discards its output.
    pub fn start_silent(mut self) -> Process {
        self.command.stdout(Stdio::null()).stderr(Stdio::null());
        self.spawn()
    }

    /// Starts it, and discards its standard output.
    pub fn start_without_reader(mut self) -> Process {
        self.command.stdout(Stdio::null());
        self.spawn()
    }

    /// Starts it with a terminal of its own.
    pub fn start_in(mut self, terminal: OwnedFd) -> Process {
        let copy = || terminal.try_clone().expect("a descriptor is free");
        self.command.stdin(copy()).stdout(copy()).stderr(copy());
        self.spawn()
    }
}

/// A running process; dropping it ends it.
pub struct Process {
    child: Child,
    pauses: Option<Arc<HostPauses>>,
}

impl Process {
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Sends it a signal.
    pub fn signal(&self, signal: Signal) {
        kill(Pid::from_raw(self.child.id() as i32), signal).expect("is alive");
    }

    /// Suspends it for this long.
    pub fn pause(&self, pause: Duration) {
        let pid = Pid::from_raw(self.child.id() as i32);
        kill(pid, Signal::SIGSTOP).expect("is alive");
        std::thread::sleep(pause);
        kill(pid, Signal::SIGCONT).expect("is alive");
    }

    /// kill -9.
    pub fn kill(&mut self) {
        self.child.kill().expect("is alive");
        self.wait();
    }

    /// How it ended, once it has. Nobody may signal its number any more when the system gives it to another process.
    pub fn exit_status(&mut self) -> Option<ExitStatus> {
        let mut paused = self.pauses.as_ref().map(|pauses| pauses.processes());
        let status = self.child.try_wait().expect("can be waited for");
        if let (Some(paused), Some(_)) = (&mut paused, status) {
            let id = self.child.id() as i32;
            paused.retain(|pid| pid.as_raw() != id);
        }
        status
    }

    fn wait(&mut self) -> ExitStatus {
        loop {
            if let Some(status) = self.exit_status() {
                return status;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Waits until it has ended without being asked to.
    pub fn ends_by_itself(self) -> ExitStatus {
        self.ends_within(Duration::from_secs(20))
    }

    /// Waits no longer than this until it has ended.
    pub fn ends_within(mut self, timeout: Duration) -> ExitStatus {
        let mut status = None;
        wait_for("an end without being asked", timeout, || {
            status = self.exit_status();
            status.is_some()
        });
        status.expect("has ended")
    }

    /// Waits until it has ended without being asked to; gives its log, which must be short.
    pub fn log_at_its_end(mut self) -> (ExitStatus, String) {
        let mut stderr = self.child.stderr.take().expect("is piped");
        let status = self.ends_by_itself();
        let mut log = String::new();
        stderr.read_to_string(&mut log).expect("is text");
        (status, log)
    }

    /// Asks it to end and waits for that.
    pub fn end(mut self) {
        self.ask_to_end();
        wait_for("an orderly end", Duration::from_secs(20), || {
            self.exit_status().is_some()
        });
    }

    fn ask_to_end(&self) {
        // It may have been killed by the test.
        let _ = kill(Pid::from_raw(self.child.id() as i32), Signal::SIGTERM);
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        if self.exit_status().is_some() {
            return;
        }
        self.ask_to_end();
        let deadline = Instant::now() + Duration::from_secs(5);
        while Instant::now() < deadline {
            if self.exit_status().is_some() {
                return;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        let _ = self.child.kill();
        self.wait();
    }
}

/// Waits until a condition holds; a test that waits in vain says for what.
pub fn wait_for(what: &str, timeout: Duration, mut condition: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !condition() {
        assert!(begun.elapsed() < timeout, "waited {timeout:?} in vain: {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}
