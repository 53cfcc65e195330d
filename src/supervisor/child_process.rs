//! A process of a running worm, as a child of this one.

use crate::failure::Failure;
use crate::print;
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

/// How long a process may take to be ready. Cleaning up after a killed worm takes the longest.
pub(crate) const START_TIMEOUT: Duration = Duration::from_secs(20);

/// How long a process may take to end in order once the worm stands still.
const END_TIMEOUT: Duration = Duration::from_secs(5);

/// How often a wait for a process checks whether it was cancelled.
const POLL: Duration = Duration::from_millis(20);

/// One line of a child's log.
#[derive(Debug, Clone)]
pub(crate) struct LogLine {
    pub(crate) role: &'static str,
    pub(crate) text: String,
}

impl fmt::Display for LogLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "[{}] {}", self.role, self.text)
    }
}

/// Collects the log lines of all children.
pub(crate) struct Log {
    sender: Sender<LogLine>,
    pub(crate) lines: Receiver<LogLine>,
}

impl Log {
    pub(crate) fn new() -> Self {
        let (sender, lines) = unbounded();
        Self { sender, lines }
    }

    /// The last error message of a process that has ended; earlier lines go to standard error.
    fn last_error(&self, role: &str) -> Option<String> {
        let mut last = None;
        // The thread that forwards its lines may lag a little.
        while let Ok(line) = self.lines.recv_timeout(Duration::from_millis(100)) {
            match line.text.strip_prefix("wormd: ") {
                Some(text) if line.role == role => last = Some(text.to_owned()),
                _ => print::log_line(line),
            }
        }
        last
    }
}

/// A running child. Dropping it ends it: in order if possible, by force if not.
pub(crate) struct Child {
    pub(crate) role: &'static str,
    process: Process,
    stdout_lines: Receiver<LogLine>,
    /// How long it may take to end in order.
    end_timeout: Duration,
}

impl Child {
    /// Starts this same binary with the given arguments.
    pub(crate) fn start(role: &'static str, arguments: &[OsString], log: &Log) -> Result<Self, Failure> {
        let binary = std::env::current_exe()
            .map_err(|error| Failure::failed(format!("wormd cannot find its own binary: {error}")))?;
        let mut command = Command::new(binary);
        command
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        // A process group of its own: Ctrl-C reaches only the parent, which stops the worm before it ends the processes.
        command.process_group(0);
        // SAFETY: prctl is async-signal-safe, and nothing is allocated between fork and exec.
        unsafe {
            command.pre_exec(|| {
                // If the parent is killed, the kernel asks the child to end.
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
            end_timeout: END_TIMEOUT,
        })
    }

    /// Allows it this much more time to end in order than a process usually has.
    pub(crate) fn extend_end_timeout(&mut self, more: Duration) {
        self.end_timeout = END_TIMEOUT + more;
    }

    /// Process id.
    pub(crate) fn id(&self) -> u32 {
        self.process.id()
    }

    /// Waits for the first line on the child's standard output, which it writes when it is ready.
    ///
    /// # Errors
    /// The child's last error message when it ended: [`Failure::Unusable`] if its exit status says so. Also when `timeout`
    /// passed, or `end` was set meanwhile.
    pub(crate) fn wait_until_ready(&mut self, timeout: Duration, log: &Log, end: &AtomicBool) -> Result<(), Failure> {
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
        let last_error = log
            .last_error(self.role)
            .unwrap_or_else(|| format!("ended at once, {status}"));
        let text = format!("{}: {last_error}", self.role);
        Err(if status.code() == Some(2) {
            Failure::unusable(text)
        } else {
            Failure::failed(text)
        })
    }

    /// The last line on the standard output of a child that has ended, if it wrote any after it was ready.
    pub(crate) fn last_line(&self) -> Option<String> {
        // The forwarding thread closes the channel at the end of the stream, which ends this iteration.
        self.stdout_lines.iter().last().map(|line| line.text)
    }

    /// How it ended, if it has.
    pub(crate) fn exit_status(&mut self) -> Option<ExitStatus> {
        self.process.try_wait().ok().flatten()
    }

    fn ask_to_end(&self) {
        // Fails only when the process has ended already.
        let _ = kill(Pid::from_raw(self.process.id() as i32), Signal::SIGTERM);
    }

    /// Ends it, and returns how it ended.
    pub(crate) fn end(&mut self) -> Option<ExitStatus> {
        if let Some(status) = self.exit_status() {
            return Some(status);
        }
        self.ask_to_end();
        let deadline = Instant::now() + self.end_timeout;
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
            self.end_timeout
        );
        // Fails only when the process has ended already.
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
