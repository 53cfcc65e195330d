//! The pseudo-terminal that the devices sit behind, and the link that gives it a lasting name.

use nix::errno::Errno;
use nix::fcntl::{FcntlArg, FdFlag, OFlag, fcntl};
use nix::pty::openpty;
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};
use std::io;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd};
use std::path::{Path, PathBuf};

/// Why the simulated devices cannot be reached.
#[derive(Debug, thiserror::Error)]
pub enum PtyError {
    /// The system gave no pseudo-terminal, or not as it must be.
    #[error("no pseudo-terminal: failed to {doing}: {source}; is /dev/pts mounted, and not full?")]
    Pty {
        /// What was tried.
        doing: &'static str,
        /// What the system says.
        source: io::Error,
    },
    /// There is something else where the link should be.
    #[error("{}: there is a file or folder that is no link: move it away, or give another --link", path.display())]
    NotALink {
        /// Where.
        path: PathBuf,
    },
    /// The link could not be made.
    #[error("{}: cannot make a link to the pseudo-terminal: {source}; does its folder exist, and may you write there?", path.display())]
    Link {
        /// Where.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

/// Both ends of a pseudo-terminal.
///
/// The devices talk through the master. The slave stays open here too: otherwise the peer's closing would hang the line
/// up, and lose its settings.
#[derive(Debug)]
pub(super) struct Pty {
    master: OwnedFd, // with O_NONBLOCK
    slave: OwnedFd,
    path: PathBuf,
}

impl Pty {
    /// A new one, raw.
    pub(super) fn open() -> Result<Self, PtyError> {
        let failed = |doing| {
            move |errno: Errno| PtyError::Pty {
                doing,
                source: errno.into(),
            }
        };
        let ends = openpty(None, None).map_err(failed("open one"))?;
        for fd in [&ends.master, &ends.slave] {
            fcntl(fd, FcntlArg::F_SETFD(FdFlag::FD_CLOEXEC)).map_err(failed("keep it from child processes"))?;
        }
        fcntl(&ends.master, FcntlArg::F_SETFL(OFlag::O_NONBLOCK)).map_err(failed("make it non-blocking"))?;
        let mut settings = tcgetattr(&ends.slave).map_err(failed("read its settings"))?;
        cfmakeraw(&mut settings);
        tcsetattr(&ends.slave, SetArg::TCSANOW, &settings).map_err(failed("make it raw"))?;
        let path = nix::unistd::ttyname(&ends.slave).map_err(failed("learn its name"))?;
        Ok(Self {
            master: ends.master,
            slave: ends.slave,
            path,
        })
    }

    /// Path of the end that a controller opens.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn master(&self) -> BorrowedFd<'_> {
        self.master.as_fd()
    }

    /// Bytes that are there; 0 when there are none.
    pub(super) fn read(&self, into: &mut [u8]) -> io::Result<usize> {
        match nix::unistd::read(&self.master, into) {
            Ok(count) => Ok(count),
            Err(Errno::EAGAIN | Errno::EINTR) => Ok(0),
            Err(errno) => Err(errno.into()),
        }
    }

    /// Sends bytes. When the buffer is full because the peer does not read, they are lost, as on a wire.
    pub(super) fn write(&self, mut bytes: &[u8]) -> io::Result<()> {
        while !bytes.is_empty() {
            match nix::unistd::write(&self.master, bytes) {
                Ok(count) => bytes = &bytes[count..],
                Err(Errno::EAGAIN) => return Ok(()),
                Err(Errno::EINTR) => {}
                Err(errno) => return Err(errno.into()),
            }
        }
        Ok(())
    }

    /// Baud rate that the peer has set, bit/s.
    pub(super) fn peer_baud(&self) -> io::Result<u32> {
        // SAFETY: all bytes zero are a valid `termios2`, a plain struct of integers.
        let mut settings: libc::termios2 = unsafe { std::mem::zeroed() };
        // SAFETY: the descriptor is open, and TCGETS2 writes one `termios2` to the address it gets.
        Errno::result(unsafe { libc::ioctl(self.slave.as_raw_fd(), libc::TCGETS2, &mut settings) })?;
        Ok(settings.c_ospeed)
    }

    /// Lets others open the slave again after a peer that took it for itself was killed: the kernel forgets that only when
    /// the last descriptor closes, and ours never does.
    pub(super) fn forget_exclusive(&self) {
        // SAFETY: the descriptor is open, and TIOCNXCL takes no argument. It cannot fail on a terminal.
        let _always = unsafe { libc::ioctl(self.slave.as_raw_fd(), libc::TIOCNXCL) };
    }
}

/// A symbolic link that goes when this goes.
#[derive(Debug)]
pub struct PortLink {
    path: PathBuf,
    target: PathBuf,
}

impl PortLink {
    /// Makes `path` a link to `target` in one step, so that it is never missing; replaces an older link.
    ///
    /// # Errors
    /// [`PtyError::NotALink`] when something else is there, [`PtyError::Link`] when the system refuses.
    pub fn create(path: &Path, target: &Path) -> Result<Self, PtyError> {
        let failed = |source| PtyError::Link {
            path: path.to_path_buf(),
            source,
        };
        match std::fs::symlink_metadata(path) {
            Ok(metadata) if !metadata.file_type().is_symlink() => {
                let path = path.to_path_buf();
                return Err(PtyError::NotALink { path });
            }
            Ok(_) => {}
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(failed(error)),
        }
        let mut beside = path.as_os_str().to_owned();
        beside.push(format!(".{}", std::process::id()));
        let beside = PathBuf::from(beside);
        match std::fs::remove_file(&beside) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(failed(error)),
            _ => {} // left behind by a process that had our number, or nothing
        }
        std::os::unix::fs::symlink(target, &beside).map_err(failed)?;
        std::fs::rename(&beside, path).map_err(failed)?;
        Ok(Self {
            path: path.to_path_buf(),
            target: target.to_path_buf(),
        })
    }
}

impl Drop for PortLink {
    fn drop(&mut self) {
        // Another virtual worm may have taken the name meanwhile; a link that cannot be removed is replaced next time.
        if std::fs::read_link(&self.path).is_ok_and(|target| target == self.target) {
            let _stale = std::fs::remove_file(&self.path);
        }
    }
}
