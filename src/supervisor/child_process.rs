//! A process of a running worm, as a child of this one.

use crate::failure::Failure;
use crate::print;
use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, bounded, unbounded};
use nix::fcntl::{FcntlArg, OFlag, fcntl};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::ffi::OsString;
use std::fmt;
use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child as Process, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// How long a process may take to be ready. Cleaning up after a killed worm takes the longest.
pub(crate) const START_TIMEOUT: Duration = Duration::from_secs(20);

/// How long a process may take to end in order once the worm stands still.
const END_TIMEOUT: Duration = Duration::from_secs(5);

/// How often a lease is renewed that this process keeps without looking: several times in the shortest lease.
const KEEP_INTERVAL: Duration = Duration::from_millis(20);

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

/// Lines that wait to be shown; more are dropped and counted, so that a terminal that nobody reads holds up nothing.
const LOG_QUEUE: usize = 4096;

/// Collects the log lines of all children.
pub(crate) struct Log {
    sender: LogSender,
    pub(crate) lines: Receiver<LogLine>,
}

#[derive(Clone)]
struct LogSender {
    queue: Sender<LogLine>,
    dropped: Arc<AtomicU64>,
}

impl LogSender {
    /// Never waits.
    fn send(&self, line: LogLine) {
        if self.queue.try_send(line).is_err() {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl Log {
    pub(crate) fn new() -> Self {
        let (queue, lines) = bounded(LOG_QUEUE);
        let dropped = Arc::default();
        let sender = LogSender { queue, dropped };
        Self { sender, lines }
    }

    /// Adds a line of this process itself. Never waits.
    pub(crate) fn note(&self, role: &'static str, text: String) {
        self.sender.send(LogLine { role, text });
    }

    /// The lines, for the thread that shows them.
    pub(crate) fn share(&self) -> LogLines {
        LogLines {
            lines: self.lines.clone(),
            dropped: Arc::clone(&self.sender.dropped),
        }
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

/// The log lines of all children, for who shows them.
pub(crate) struct LogLines {
    lines: Receiver<LogLine>,
    dropped: Arc<AtomicU64>,
}

impl LogLines {
    /// What is new, and how many lines found no room.
    pub(crate) fn take_new(&mut self) -> impl Iterator<Item = LogLine> {
        let dropped = self.dropped.swap(0, Ordering::Relaxed);
        let gap = (dropped > 0).then(|| LogLine {
            role: "up",
            text: format!("{dropped} lines of the log were dropped, because the terminal did not take them"),
        });
        self.lines.try_iter().chain(gap)
    }
}

/// A running child. Dropping it ends it: in order if possible, by force if not.
pub(crate) struct Child {
    pub(crate) role: &'static str,
    process: Process,
    stdout_lines: Receiver<LogLine>,
    /// The pipe by which it knows that this process is there.
    lease: Option<ChildStdin>,
    /// How long it may take to end in order.
    end_timeout: Duration,
}

impl Child {
    /// Starts this same binary with the given arguments, as a process that watches standard input for the end of this one.
    pub(crate) fn start(role: &'static str, arguments: &[OsString], log: &Log) -> Result<Self, Failure> {
        let mut command = command(arguments)?;
        command.arg("--supervised").stdin(Stdio::piped());
        Self::spawn(role, command, log)
    }

    /// Starts this same binary with the given arguments, as a process that the kernel ends with this one.
    pub(crate) fn start_unsupervised(role: &'static str, arguments: &[OsString], log: &Log) -> Result<Self, Failure> {
        let mut command = command(arguments)?;
        command.stdin(Stdio::null());
        // SAFETY: prctl is async-signal-safe, and nothing is allocated between fork and exec.
        unsafe {
            command.pre_exec(|| {
                // If the parent is killed, the kernel asks the child to end.
                nix::sys::prctl::set_pdeathsig(Signal::SIGTERM).map_err(std::io::Error::from)
            });
        }
        Self::spawn(role, command, log)
    }

    fn spawn(role: &'static str, mut command: Command, log: &Log) -> Result<Self, Failure> {
        let not_started = |error| Failure::failed(format!("the {role} process cannot be started: {error}"));
        let mut process = command.spawn().map_err(not_started)?;
        let lease = process.stdin.take();
        if let Some(pipe) = &lease {
            // A child that does not read must not hold up who renews its lease.
            fcntl(pipe, FcntlArg::F_SETFL(OFlag::O_NONBLOCK)).map_err(|errno| not_started(errno.into()))?;
        }
        let (stdout_sender, stdout_lines) = unbounded();
        if let Some(stdout) = process.stdout.take() {
            // Nobody may be interested any more.
            forward_lines(role, stdout, move |line| drop(stdout_sender.send(line)));
        }
        if let Some(stderr) = process.stderr.take() {
            let sender = log.sender.clone();
            forward_lines(role, stderr, move |line| sender.send(line));
        }
        Ok(Self {
            role,
            process,
            stdout_lines,
            lease,
            end_timeout: END_TIMEOUT,
        })
    }

    /// Tells it that this process is there, and attends. Never waits.
    pub(crate) fn renew_lease(&mut self) {
        if let Some(pipe) = &mut self.lease {
            // A full pipe holds what was said before; that of a child that has ended needs nothing.
            let _ = pipe.write(&[0]);
        }
    }

    /// Tells it so from now on by itself, as long as this process lives.
    ///
    /// # Errors
    /// [`Failure::Failed`] when there is no thread to be had.
    pub(crate) fn keep_lease(&mut self) -> Result<(), Failure> {
        let Some(mut pipe) = self.lease.take() else {
            return Ok(());
        };
        let renew = move || {
            // Until the child has ended.
            while !pipe
                .write(&[0])
                .is_err_and(|error| error.kind() != ErrorKind::WouldBlock)
            {
                std::thread::sleep(KEEP_INTERVAL);
            }
        };
        let thread = std::thread::Builder::new().name("lease".to_owned()).spawn(renew);
        thread
            .map(drop)
            .map_err(|error| Failure::failed(format!("no thread can be started: {error}")))
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

/// This same binary with the given arguments.
fn command(arguments: &[OsString]) -> Result<Command, Failure> {
    let binary = std::env::current_exe()
        .map_err(|error| Failure::failed(format!("wormd cannot find its own binary: {error}")))?;
    let mut command = Command::new(binary);
    command.args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
    // A process group of its own: Ctrl-C reaches only the parent, which stops the worm before it ends the processes.
    command.process_group(0);
    Ok(command)
}

fn forward_lines(role: &'static str, stream: impl Read + Send + 'static, send: impl Fn(LogLine) + Send + 'static) {
    std::thread::spawn(move || {
        for line in BufReader::new(stream).lines() {
            let Ok(text) = line else { return };
            send(LogLine { role, text });
        }
    });
}
