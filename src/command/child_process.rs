//! The processes of a running worm, as children of this one: of `wormd up`, or of `wormd latency`.

use super::{Failure, print};
use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, unbounded};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::ffi::OsString;
use std::fmt;
use std::io::{BufRead, BufReader, Read};
use std::os::unix::process::CommandExt;
use std::process::{Child as Process, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How long a process may take to be ready. Starting beside the remains of a killed worm takes the longest.
pub(super) const START_PATIENCE: Duration = Duration::from_secs(20);

/// Time that a process is given to end in order, once the worm stands.
const PATIENCE: Duration = Duration::from_secs(5);

/// How often one who waits for a process looks whether it is still wanted.
const POLL: Duration = Duration::from_millis(20);

/// One line that a child has logged.
#[derive(Debug, Clone)]
pub(super) struct LogLine {
    pub(super) role: &'static str,
    pub(super) text: String,
}

impl fmt::Display for LogLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "[{}] {}", self.role, self.text)
    }
}

/// Collects what the children log.
pub(super) struct Log {
    sender: Sender<LogLine>,
    pub(super) lines: Receiver<LogLine>,
}

impl Log {
    pub(super) fn new() -> Self {
        let (sender, lines) = unbounded();
        Self { sender, lines }
    }

    /// The last error message of a process that has ended; what came before it goes to standard error.
    fn last_words(&self, role: &str) -> Option<String> {
        let mut last = None;
        // The thread that forwards its lines may be a moment behind.
        while let Ok(line) = self.lines.recv_timeout(Duration::from_millis(100)) {
            match line.text.strip_prefix("wormd: ") {
                Some(text) if line.role == role => last = Some(text.to_owned()),
                _ => print::log_line(line),
            }
        }
        last
    }
}

/// A running child. Dropping it ends it: in order if it will, by force if not.
pub(super) struct Child {
    pub(super) role: &'static str,
    process: Process,
    stdout_lines: Receiver<LogLine>,
    /// Time that it is given to end in order.
    timeout: Duration,
}

impl Child {
    /// Starts this very binary with the given arguments.
    pub(super) fn start(role: &'static str, arguments: &[OsString], log: &Log) -> Result<Self, Failure> {
        let binary = std::env::current_exe()
            .map_err(|error| Failure::failed(format!("wormd cannot find its own binary: {error}")))?;
        let mut command = Command::new(binary);
        command
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        // A group of its own: Ctrl-C goes to the parent alone, which stops the worm before it stops the processes.
        command.process_group(0);
        // SAFETY: prctl is async-signal-safe, and nothing is allocated between fork and exec.
        unsafe {
            command.pre_exec(|| {
                // Should the parent be killed, the child is asked to end in order.
                nix::sys::prctl::set_pdeathsig(Signal::SIGTERM).map_err(std::io::Error::from)
            });
        }
        let mut process = command
            .spawn()
            .map_err(|error| Failure::failed(format!("the {role} process cannot be started: {error}")))?;
        let (stdout_sender, stdout_lines) = unbounded();
        if let Some(stdout) = process.stdout.take() {
            forward_lines(role, stdout, stdout_sender);
        }
        if let Some(stderr) = process.stderr.take() {
            forward_lines(role, stderr, log.sender.clone());
        }
        Ok(Self {
            role,
            process,
            stdout_lines,
            timeout: PATIENCE,
        })
    }

    /// It may take so much longer to end in order than a process usually does.
    pub(super) fn be_patient(&mut self, more: Duration) {
        self.timeout = PATIENCE + more;
    }

    /// Process id.
    pub(super) fn id(&self) -> u32 {
        self.process.id()
    }

    /// Waits for the first line on the child's standard output: its word that it is ready.
    ///
    /// # Errors
    /// What the child said as it ended, with its exit status: unusable input stays unusable input. And when `end` was set
    /// meanwhile.
    pub(super) fn wait_until_ready(&mut self, timeout: Duration, log: &Log, end: &AtomicBool) -> Result<(), Failure> {
        let begun = Instant::now();
        while begun.elapsed() < timeout {
            match self.stdout_lines.recv_timeout(POLL) {
                Ok(_) => return Ok(()),
                Err(RecvTimeoutError::Disconnected) => break,
                Err(RecvTimeoutError::Timeout) if end.load(Ordering::Relaxed) => {
                    return Err(Failure::failed("stopped before the worm was ready"));
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
        let Some(status) = self.end() else {
            return Err(Failure::failed(format!(
                "the {} process was not ready within {timeout:?}",
                self.role
            )));
        };
        let last_words = log
            .last_words(self.role)
            .unwrap_or_else(|| format!("ended at once, {status}"));
        let text = format!("{}: {last_words}", self.role);
        Err(if status.code() == Some(2) {
            Failure::unusable(text)
        } else {
            Failure::failed(text)
        })
    }

    /// The last line on the standard output of a child that has ended, if it has written any since it was ready.
    pub(super) fn last_line(&self) -> Option<String> {
        // The thread that forwards them ends, and with it this, when all have been forwarded.
        self.stdout_lines.iter().last().map(|line| line.text)
    }

    /// How it ended, if it has.
    pub(super) fn exit_status(&mut self) -> Option<ExitStatus> {
        self.process.try_wait().ok().flatten()
    }

    fn ask_to_end(&self) {
        // It may have ended already; then there is nobody to ask.
        let _ = kill(Pid::from_raw(self.process.id() as i32), Signal::SIGTERM);
    }

    /// Ends it and tells how it ended.
    pub(super) fn end(&mut self) -> Option<ExitStatus> {
        if let Some(status) = self.exit_status() {
            return Some(status);
        }
        self.ask_to_end();
        let deadline = Instant::now() + self.timeout;
        while Instant::now() < deadline {
            if let Some(status) = self.exit_status() {
                return Some(status);
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        tracing::error!(
            "the {} process (pid {}) did not end within {:?} and was killed",
            self.role,
            self.id(),
            self.timeout
        );
        // What cannot be killed is gone.
        let _ = self.process.kill();
        self.process.wait().ok()
    }
}

impl Drop for Child {
    fn drop(&mut self) {
        self.end();
    }
}

fn forward_lines(role: &'static str, stream: impl Read + Send + 'static, sender: Sender<LogLine>) {
    std::thread::spawn(move || {
        for line in BufReader::new(stream).lines() {
            let Ok(text) = line else { return };
            if sender.send(LogLine { role, text }).is_err() {
                return;
            }
        }
    });
}
