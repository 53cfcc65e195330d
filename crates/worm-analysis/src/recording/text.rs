//! Text from other programs, made ready for a parser.

use std::io::{self, Read};

/// Bytes between two calls of the progress callback.
const REPORT_EVERY: u64 = 64 * 1024;

/// A reader that drops carriage returns, terminates an unterminated last line, and reports progress. Line numbers are then those
/// that an editor shows.
pub(crate) struct Text<'a, R> {
    inner: R,
    total: u64,
    read: u64,
    reported: u64,
    last: u8,
    unterminated: bool,
    progress: &'a mut dyn FnMut(f64),
}

impl<'a, R: Read> Text<'a, R> {
    /// Text of about `total` bytes; `progress` receives the fraction that was read.
    pub(crate) fn new(inner: R, total: u64, progress: &'a mut dyn FnMut(f64)) -> Self {
        Self {
            inner,
            total,
            read: 0,
            reported: 0,
            last: b'\n',
            unterminated: false,
            progress,
        }
    }

    /// Whether the text ended without a line end, as a truncated file does; known once all is read.
    pub(super) fn is_unterminated(&self) -> bool {
        self.unterminated
    }

    fn report(&mut self) {
        if self.read - self.reported >= REPORT_EVERY {
            self.reported = self.read;
            (self.progress)((self.read as f64 / self.total.max(1) as f64).min(1.0));
        }
    }
}

impl<R: Read> Read for Text<'_, R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if out.is_empty() {
            return Ok(0);
        }
        loop {
            let count = self.inner.read(out)?;
            if count == 0 {
                if self.last == b'\n' {
                    return Ok(0);
                }
                self.unterminated = true;
                self.last = b'\n';
                out[0] = b'\n';
                return Ok(1);
            }
            self.read += count as u64;
            self.report();
            let kept = drop_carriage_returns(&mut out[..count]);
            if kept > 0 {
                self.last = out[kept - 1];
                return Ok(kept);
            }
        }
    }
}

/// Moves all bytes but carriage returns to the front and returns their number.
fn drop_carriage_returns(bytes: &mut [u8]) -> usize {
    let Some(first) = bytes.iter().position(|&byte| byte == b'\r') else {
        return bytes.len();
    };
    let mut kept = first;
    for index in first..bytes.len() {
        if bytes[index] != b'\r' {
            bytes[kept] = bytes[index];
            kept += 1;
        }
    }
    kept
}

#[cfg(test)]
mod tests;
