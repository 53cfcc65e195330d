//! Printing that never panics: a reader may close its end at any time, and the worm must not suffer for it.
//!
//! A reader may also stay and not read: a terminal of a stalled ssh takes nothing any more, and whoever writes to it waits for ever.
//! A process that attends to a worm therefore prints its log from a thread of its own ([`log_in_background`]).

use crate::failure::Failure;
use crossbeam::channel::{Receiver, Sender, bounded};
use std::fmt::Display;
use std::io::{self, Write};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Lines of the log that wait to be printed in the background; more are dropped and counted.
const QUEUE: usize = 1024;
/// How often the end of a background is looked for.
const POLL: Duration = Duration::from_millis(2);
/// What is written at once where each write is watched, bytes: what a pipe takes as a whole.
const PIECE: usize = 4096;

/// Writes a line to standard output, and flushes it.
///
/// # Errors
/// [`Failure::Failed`] when the reader has closed its end, as in `wormd … | head -1`.
pub(crate) fn line(text: impl Display) -> Result<(), Failure> {
    let mut stdout = io::stdout().lock();
    // One write: a reader such as `head -1` that leaves after it has left nothing unwritten.
    stdout
        .write_all(format!("{text}\n").as_bytes())
        .and_then(|()| stdout.flush())
        .map_err(|error| {
            Failure::failed(format!(
                "standard output: {error}: whatever reads it must stay to the end"
            ))
        })
}

/// As [`line()`], but gives up when standard output takes nothing for `patience`.
///
/// # Errors
/// As [`line()`], and when it gave up.
pub(crate) fn line_within(text: impl Display, patience: Duration) -> Result<(), Failure> {
    let text = format!("{text}\n");
    let (sender, progress) = bounded(0);
    let write = move || {
        let mut stdout = io::stdout().lock();
        for piece in text.as_bytes().chunks(PIECE) {
            let written = stdout.write_all(piece).and_then(|()| stdout.flush());
            let is_over = written.is_err();
            // Nobody listens any more after the patience.
            if sender.send(written).is_err() || is_over {
                return;
            }
        }
    };
    std::thread::Builder::new()
        .name("output".to_owned())
        .spawn(write)
        .map_err(|error| Failure::failed(format!("no thread can be started: {error}")))?;
    loop {
        match progress.recv_timeout(patience) {
            Ok(Ok(())) => {}
            Ok(Err(error)) => {
                return Err(Failure::failed(format!(
                    "standard output: {error}: whatever reads it must stay to the end"
                )));
            }
            Err(error) if error.is_disconnected() => return Ok(()),
            Err(_) => {
                return Err(Failure::failed(format!(
                    "standard output took nothing for {patience:?}: the summary is lost; whatever reads it must go on reading"
                )));
            }
        }
    }
}

/// Writes the line "ready" to standard output: see [`announce`].
pub(crate) fn ready() {
    announce("ready");
}

/// Writes a line to standard output for a parent that waits for it, in the background where that was asked for. A parent that does not
/// wait may have closed the pipe, or may not read.
pub(crate) fn announce(text: impl Display) {
    let Some(background) = BACKGROUND.get() else {
        let _ = line(text);
        return;
    };
    background.waiting.fetch_add(1, Ordering::Relaxed);
    // One that nobody reads is in the way.
    if background.announced.try_send(text.to_string()).is_err() {
        background.waiting.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Writes a line to standard error, in the background where that was asked for.
pub fn log_line(text: impl Display) {
    // When standard error is closed, there is nowhere left to report that.
    let _ = LogOutput.write_all(format!("{text}\n").as_bytes());
}

/// What is printed in the background.
static BACKGROUND: OnceLock<Background> = OnceLock::new();

struct Background {
    queue: Sender<Vec<u8>>,
    announced: Sender<String>,
    /// Lines that were queued and are not printed yet.
    waiting: AtomicU64,
    dropped: AtomicU64,
}

/// From now on whoever logs never waits for standard error, and [`announce`] never for standard output. Call it before requesting
/// real-time priority, so that what prints keeps the ordinary scheduler.
///
/// # Errors
/// [`Failure::Failed`] when there is no thread to be had.
pub(crate) fn log_in_background() -> Result<(), Failure> {
    let (queue, lines) = bounded(QUEUE);
    let (announced, announcements) = bounded(1);
    let background = BACKGROUND.get_or_init(|| Background {
        queue,
        announced,
        waiting: AtomicU64::new(0),
        dropped: AtomicU64::new(0),
    });
    let start = |name: &str, print: Box<dyn FnOnce() + Send>| {
        std::thread::Builder::new()
            .name(name.to_owned())
            .spawn(print)
            .map(drop)
            .map_err(|error| Failure::failed(format!("no thread can be started: {error}")))
    };
    start("log", Box::new(move || background.print(&lines)))?;
    // A thread of its own: a reader of standard output is not to wait for one of standard error.
    start(
        "output",
        Box::new(move || background.print_announcements(&announcements)),
    )
}

/// Waits until the log is printed, but no longer than `patience`.
pub fn finish_log(patience: Duration) {
    let Some(background) = BACKGROUND.get() else { return };
    let begun = Instant::now();
    while background.waiting.load(Ordering::Acquire) > 0 && begun.elapsed() < patience {
        std::thread::sleep(POLL);
    }
}

impl Background {
    fn print(&self, lines: &Receiver<Vec<u8>>) {
        for line in lines {
            let dropped = self.dropped.swap(0, Ordering::Relaxed);
            let mut stderr = io::stderr();
            if dropped > 0 {
                let _ = writeln!(
                    stderr,
                    "wormd: {dropped} lines are missing here: standard error did not take them"
                );
            }
            // When standard error is closed, there is nowhere left to report that.
            let _ = stderr.write_all(&line);
            self.waiting.fetch_sub(1, Ordering::Release);
        }
    }

    fn print_announcements(&self, announcements: &Receiver<String>) {
        for text in announcements {
            let _ = line(text);
            self.waiting.fetch_sub(1, Ordering::Release);
        }
    }
}

/// Standard error: directly, or in the background. One write is one line.
#[derive(Debug, Clone, Copy)]
pub struct LogOutput;

impl Write for LogOutput {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        let Some(background) = BACKGROUND.get() else {
            return io::stderr().write(line);
        };
        background.waiting.fetch_add(1, Ordering::Relaxed);
        if background.queue.try_send(line.to_vec()).is_err() {
            background.waiting.fetch_sub(1, Ordering::Relaxed);
            background.dropped.fetch_add(1, Ordering::Relaxed);
        }
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
