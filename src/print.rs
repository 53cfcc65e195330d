//! Printing that never panics: a reader may close its end at any time, and the worm must not suffer for it.

use crate::failure::Failure;
use std::fmt::Display;
use std::io::Write;

/// Writes a line to standard output, and flushes it.
///
/// # Errors
/// [`Failure::Failed`] when the reader has closed its end, as in `wormd … | head -1`.
pub(crate) fn line(text: impl Display) -> Result<(), Failure> {
    let mut stdout = std::io::stdout().lock();
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

/// Writes the line "ready" to standard output. A parent that does not wait for it may have closed the pipe.
pub(crate) fn ready() {
    let _ = line("ready");
}

/// Writes a line to standard error.
pub fn log_line(text: impl Display) {
    // When standard error is closed, there is nowhere left to report that.
    let _ = writeln!(std::io::stderr(), "{text}");
}
