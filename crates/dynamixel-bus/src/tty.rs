//! A serial port of the operating system: opened exclusively, raw, with low latency.

use std::io::{self, ErrorKind};
use std::os::fd::{AsRawFd, BorrowedFd};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::time::Instant;

use nix::errno::Errno;
use nix::fcntl::{FcntlArg, Flock, FlockArg, OFlag, fcntl};
use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;
use nix::unistd;
use serialport::{SerialPort, TTYPort};

use super::latency_timer;
use super::{Finding, Port, PortError};

/// Most bytes discarded at once. If there are more, a device sends without end, and the next transaction will show it.
const DISCARD_LIMIT: usize = 16 * 1024;

/// A serial port of the operating system (or a pseudo-terminal), open for this process alone.
#[derive(Debug)]
pub struct Tty {
    port: TTYPort, // with O_NONBLOCK, so that no call waits except in `ppoll`
}

/// Why a port could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// No such file.
    #[error("{path}: no such port: check the cable and `ls /dev/serial/by-id`", path = path.display())]
    NotFound {
        /// The port.
        path: PathBuf,
    },
    /// The user has no permission.
    #[error("{path}: permission denied: add the user to the group that owns it (dialout, uucp)", path = path.display())]
    PermissionDenied {
        /// The port.
        path: PathBuf,
    },
    /// Another process has it.
    #[error("{path}: already in use: one worm has one controller; find the other one with `fuser -v {path}`", path = path.display())]
    AlreadyInUse {
        /// The port.
        path: PathBuf,
    },
    /// It is not a terminal, or cannot be set up as one.
    #[error("{path}: cannot be set to {baud} baud, raw, 8N1: {reason}", path = path.display())]
    Setup {
        /// The port.
        path: PathBuf,
        /// The baud rate, in bit/s.
        baud: u32,
        /// The message of the operating system.
        reason: String,
    },
}

impl Tty {
    /// Opens the port at `path` with `baud` bit/s, raw, 8N1, for this process alone, and turns off the latency timer of an adapter that
    /// has one (FTDI: 16 ms).
    ///
    /// # Errors
    /// [`OpenError`]
    pub fn open(path: &Path, baud: u32) -> Result<(Self, Vec<Finding>), OpenError> {
        let path_buf = || path.to_path_buf();
        let setup = |reason: String| OpenError::Setup {
            path: path_buf(),
            baud,
            reason,
        };
        // `serialport` uses TIOCEXCL and an exclusive flock. But TIOCEXCL does not keep root out, and a second process that then fails at
        // the flock would remove TIOCEXCL from the first; so the lock is tried before anything else. The probe stays open until the
        // port is open, so that the other end of a pseudo-terminal sees no hang-up in between.
        let probe = std::fs::OpenOptions::new()
            .read(true)
            .write(true)
            .custom_flags(libc::O_NOCTTY | libc::O_NONBLOCK)
            .open(path)
            .map_err(|error| match (error.kind(), error.raw_os_error()) {
                (ErrorKind::NotFound, _) => OpenError::NotFound { path: path_buf() },
                (ErrorKind::PermissionDenied, _) => OpenError::PermissionDenied { path: path_buf() },
                (_, Some(libc::EBUSY)) => OpenError::AlreadyInUse { path: path_buf() },
                _ => setup(error.to_string()),
            })?;
        let probe = match Flock::lock(probe, FlockArg::LockExclusiveNonblock) {
            Ok(lock) => lock.unlock().map_err(|(_, errno)| setup(errno.to_string()))?,
            Err((_, Errno::EWOULDBLOCK)) => {
                return Err(OpenError::AlreadyInUse { path: path_buf() });
            }
            Err((_, errno)) => return Err(setup(errno.to_string())),
        };
        let name = path.to_str().ok_or_else(|| setup("its name is not UTF-8".into()))?;
        let port = serialport::new(name, baud)
            .exclusive(true)
            .open_native()
            .map_err(|error| match error.kind() {
                serialport::ErrorKind::NoDevice => OpenError::AlreadyInUse { path: path_buf() },
                _ => setup(error.to_string()),
            })?;
        drop(probe);
        let tty = Self { port };
        fcntl(tty.fd(), FcntlArg::F_SETFL(OFlag::O_NONBLOCK)).map_err(|errno| setup(errno.to_string()))?;
        let findings = latency_timer::correct(tty.fd(), path).into_iter().collect();
        Ok((tty, findings))
    }

    fn fd(&self) -> BorrowedFd<'_> {
        // SAFETY: the descriptor belongs to `self.port`, which outlives the borrow.
        unsafe { BorrowedFd::borrow_raw(self.port.as_raw_fd()) }
    }

    /// Waits for `event` until `deadline`; returns whether it, or a hang-up, has come.
    fn wait(&self, event: PollFlags, deadline: Instant) -> Result<bool, PortError> {
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let mut fds = [PollFd::new(self.fd(), event)];
            match ppoll(&mut fds, Some(TimeSpec::from_duration(left)), None) {
                Ok(ready) => return Ok(ready > 0),
                Err(Errno::EINTR) => {}
                Err(errno) => return Err(port_error("wait", errno)),
            }
        }
    }

    /// Reads what is available; none when there is nothing.
    fn read_available(&self, into: &mut [u8]) -> Result<Option<usize>, PortError> {
        loop {
            match unistd::read(self.fd(), into) {
                Ok(0) => return Err(PortError::Disconnected), // the end of file that a hang-up leaves
                Ok(count) => return Ok(Some(count)),
                Err(Errno::EAGAIN) => return Ok(None),
                Err(Errno::EINTR) => {}
                Err(errno) => return Err(port_error("receive", errno)),
            }
        }
    }
}

/// The error of a port for an error of the system. A pseudo-terminal whose other end is closed gives EIO.
fn port_error(doing: &'static str, errno: Errno) -> PortError {
    match errno {
        Errno::EIO | Errno::EPIPE | Errno::ENXIO | Errno::ENODEV | Errno::EBADF => PortError::Disconnected,
        other => PortError::Os {
            doing,
            kind: io::Error::from(other).kind(),
        },
    }
}

impl Port for Tty {
    fn send(&mut self, mut bytes: &[u8], deadline: Instant) -> Result<(), PortError> {
        while !bytes.is_empty() {
            match unistd::write(self.fd(), bytes) {
                Ok(sent) => bytes = &bytes[sent..],
                Err(Errno::EAGAIN) => {
                    if !self.wait(PollFlags::POLLOUT, deadline)? {
                        return Err(PortError::SendTimeout);
                    }
                }
                Err(Errno::EINTR) => {}
                Err(errno) => return Err(port_error("send", errno)),
            }
        }
        Ok(())
    }

    fn receive(&mut self, into: &mut [u8], deadline: Instant) -> Result<usize, PortError> {
        if into.is_empty() {
            return Ok(0);
        }
        while self.wait(PollFlags::POLLIN, deadline)? {
            if let Some(count) = self.read_available(into)? {
                return Ok(count);
            }
        }
        Ok(0)
    }

    fn discard_input(&mut self) -> Result<usize, PortError> {
        // Read rather than flushed, so that late answers are counted.
        let mut discarded = 0;
        let mut scratch = [0; 512];
        while discarded < DISCARD_LIMIT {
            match self.read_available(&mut scratch)? {
                Some(count) => discarded += count,
                None => break,
            }
        }
        Ok(discarded)
    }

    fn set_baud_rate(&mut self, baud: u32) -> Result<(), PortError> {
        self.port.set_baud_rate(baud).map_err(|error| PortError::Os {
            doing: "change its baud rate",
            kind: io::Error::from(error).kind(),
        })
    }
}
