//! The computer's log, where there is one.

use std::os::unix::net::UnixDatagram;

/// Where it takes lines.
const SOCKET: &str = "/dev/log";
/// Facility user, severity notice (RFC 5424).
const PRIORITY: u32 = 8 + 5;

/// Gives it a line about a worm. Does not wait.
pub(crate) fn write(program: &str, worm: &str, text: &str) {
    let line = format!("<{PRIORITY}>{program}[{}]: {worm}: {text}", std::process::id());
    let sent = UnixDatagram::unbound().and_then(|socket| {
        socket.set_nonblocking(true)?;
        socket.send_to(line.as_bytes(), SOCKET)
    });
    if let Err(error) = sent {
        tracing::debug!("{SOCKET}: {error}");
    }
}
