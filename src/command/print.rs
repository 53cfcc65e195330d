//! Printing that never panics: whoever reads may leave at any time, and a worm must not pay for it.

use super::Failure;
use std::fmt::Display;
use std::io::Write;

/// Writes a line to standard output, and flushes it.
///
/// # Errors
/// [`Failure::Failed`] when nobody reads it any more, as in `wormd … | head -1`.
pub(super) fn line(text: impl Display) -> Result<(), Failure> {
    let mut stdout = std::io::stdout().lock();
    // In one piece: a reader that has seen enough, as `head -1`, leaves none of it unwritten.
    stdout
        .write_all(format!("{text}\n").as_bytes())
        .and_then(|()| stdout.flush())
        .map_err(|error| {
            Failure::failed(format!(
                "standard output: {error}: whatever reads it must stay to the end"
            ))
        })
}

/// Writes a line to standard error.
pub fn log_line(text: impl Display) {
    // There is nobody left to tell that standard error is gone.
    let _ = writeln!(std::io::stderr(), "{text}");
}
